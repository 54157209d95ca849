"""Recorder: what arrived, when, how often."""

from __future__ import annotations

import pytest
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import String

from course.errors import WaitTimeout


@pytest.fixture
def publisher(any_session):
    return any_session.run(Node, "publisher").create_publisher(String, "words", 10)


def texts(recorder):
    return [stamped.message.data for stamped in recorder.messages]


def test_it_keeps_messages_in_order_with_rising_stamps(any_session, publisher):
    recorder = any_session.record("words")
    for number in range(5):
        publisher.publish(String(data=str(number)))
    recorder.wait(5)
    assert texts(recorder) == ["0", "1", "2", "3", "4"]
    stamps = [stamped.stamp_ns for stamped in recorder.messages]
    assert stamps == sorted(stamps)
    assert (recorder.count, len(recorder), recorder.msg_type) == (5, 5, String)


def test_the_oldest_go_first_at_the_limit_but_are_counted(any_session, publisher):
    recorder = any_session.record("words", String, limit=3)
    for number in range(5):
        publisher.publish(String(data=str(number)))
        recorder.wait(number + 1)
    assert texts(recorder) == ["2", "3", "4"]
    assert (recorder.count, len(recorder)) == (5, 3)
    recorder.clear()
    assert (recorder.count, len(recorder), recorder.rate()) == (0, 0, 0.0)


def test_stop_ends_recording_and_keeps_what_there_is(any_session, publisher):
    recorder = any_session.record("words", String)
    publisher.publish(String(data="kept"))
    recorder.wait()
    recorder.stop()
    recorder.stop()
    any_session.until(lambda: publisher.get_subscription_count() == 0)
    assert texts(recorder) == ["kept"]


def test_it_stops_at_the_end_of_a_with_block(any_session, publisher):
    with any_session.record("words", String):
        any_session.until(lambda: publisher.get_subscription_count() == 1)
    any_session.until(lambda: publisher.get_subscription_count() == 0)


def test_the_qos_is_the_strongest_that_every_publisher_offers(any_session, publisher):
    node = next(iter(any_session.nodes.values()))
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    node.create_publisher(String, "map", latched)
    assert any_session.record("map").qos.durability == DurabilityPolicy.TRANSIENT_LOCAL
    assert any_session.record("words").qos.durability == DurabilityPolicy.VOLATILE
    assert any_session.record("words").qos.reliability == ReliabilityPolicy.RELIABLE
    best_effort = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    node.create_publisher(String, "words", best_effort)
    assert any_session.record("words").qos.reliability == ReliabilityPolicy.BEST_EFFORT


def test_too_few_messages_are_counted_and_none_is_explained(any_session, publisher):
    recorder = any_session.record("words", String)
    with pytest.raises(
        WaitTimeout, match=r"0 of 2 messages arrived on /words in 0\.1 s\. 1 publis"
    ):
        recorder.wait(2, timeout=0.1)
    publisher.publish(String())
    recorder.wait(1)
    with pytest.raises(WaitTimeout, match=r"1 of 2 messages arrived on /words in 0\.1 s\.$"):
        recorder.wait(2, timeout=0.1)
