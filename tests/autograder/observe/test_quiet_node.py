"""An examiner's nodes wait for nothing that nobody asked for, and let go of their guests."""

from __future__ import annotations

from collections import defaultdict
from contextlib import suppress
from typing import Any

import pytest
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import String

from autograder.exercises.qos.readings import STOP, Heard, Tag
from autograder.exercises.qos.sensor_examiner import ExaminerNode, lossless_profile
from autograder.observe.quiet_node import QuietNode
from course import Session

BEST_EFFORT = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)


def test_only_the_events_that_were_asked_for_are_waited_for(
    capfd: pytest.CaptureFixture[str],
) -> None:
    refused: list[Any] = []
    with Session() as session:
        node = session.run(QuietNode, "quiet")
        node.create_publisher(String, "words", BEST_EFFORT)
        node.create_subscription(String, "words", print, 10)
        assert not list(node.waitables)
        asks = SubscriptionEventCallbacks(
            incompatible_qos=refused.append, use_default_callbacks=False
        )
        node.create_subscription(String, "words", print, 10, event_callbacks=asks)
        assert len(list(node.waitables)) == 1
        session.until(lambda: refused)
    assert "incompatible" not in "".join(capfd.readouterr())


def test_a_guest_hears_in_its_block_only() -> None:
    guest: Heard = defaultdict(list)
    with Session() as session:
        node = session.run(ExaminerNode)
        before = set(node.subscriptions)
        stops = session.run(QuietNode, "driver").create_publisher(
            STOP.type, STOP.topic, lossless_profile()
        )

        def stop(number: int) -> None:
            tag = Tag(node.nonce, node.phase_number("event"), number)
            stops.publish(STOP.make_message(node.replacement_tag(STOP, tag)))

        with suppress(ZeroDivisionError), node.temporary_listeners():
            node.listen(STOP, STOP.topic, lossless_profile(), guest)
            session.until(lambda: stops.get_subscription_count() == 2)
            stop(0)
            session.until(lambda: guest[STOP.name] and node.witnessed[STOP.name])
            raise ZeroDivisionError
        assert set(node.subscriptions) == before
        session.until(lambda: stops.get_subscription_count() == 1)
        stop(1)
        session.until(lambda: len(node.witnessed[STOP.name]) == 2)
    assert [tag.number for tag in guest[STOP.name]] == [0]
