"""A listener hears each message once, whichever reliability is offered."""

from __future__ import annotations

from typing import Any

from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import Int32

from autograder.observe.examiner.lossless_listener import LosslessListener
from autograder.observe.examiner.quiet_node import QuietNode
from autograder.observe.nouns import Topic
from course import Session

BEST_EFFORT = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)


def read_count(message: Any) -> int | None:
    """Return a count, which is never below 0."""
    return int(message.data) if message.data >= 0 else None


COUNT = Topic("count", Int32, read_count)


def test_what_both_readers_hear_is_one_message_and_the_list_only_grows() -> None:
    with Session() as session:
        listener = session.run(LosslessListener, COUNT)
        counter = session.run(QuietNode, "counter")
        offers = counter.create_publisher(Int32, COUNT.name, BEST_EFFORT)
        keeps = counter.create_publisher(Int32, COUNT.name, 10)
        session.until(
            lambda: (
                (offers.get_subscription_count(), keeps.get_subscription_count()) == (1, 2)
                and listener.count_publishers(COUNT.name) == 2
            )
        )
        lists = []
        for number in range(20):
            (offers if number % 3 else keeps).publish(Int32(data=number))
            session.until(lambda least=number: len(listener.heard()) > least)  # type: ignore[misc]
            lists.append(listener.heard())
        assert [heard.value for heard in lists[-1]] == list(range(20))
        assert all(lists[-1][: len(earlier)] == earlier for earlier in lists)


def test_what_is_sent_again_counts_again_and_what_is_no_message_of_the_task_is_strange() -> None:
    with Session() as session:
        listener = session.run(LosslessListener, COUNT)
        counter = session.run(QuietNode, "counter")
        counts = counter.create_publisher(Int32, COUNT.name, 10)
        session.until(lambda: counts.get_subscription_count() == 2)
        for number in (7, 7, 7, -1):
            counts.publish(Int32(data=number))
        session.until(lambda: len(listener.heard()) == 3 and listener.count_strange() == 1)
        assert {heard.value for heard in listener.heard()} == {7}
