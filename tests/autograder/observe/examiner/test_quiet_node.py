"""An examiner's nodes wait for nothing that nobody asked for."""

from __future__ import annotations

from typing import Any

import pytest
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import String

from autograder.observe.examiner.quiet_node import QuietNode
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
