"""The writer's process of an experiment: does what it is told on standard input, line by line.

    {"offer": {...}}          make the publisher
    {"matched": seconds}      wait for a subscription; answers whether there is one
    {"publish": [first, count, rate]}
    {"acked": seconds}        wait until every reader has everything; answers whether that is so
    {"pause": seconds}

Each line is answered by one on standard output.
"""

from __future__ import annotations

import json
import sys
import threading
import time
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import UInt32

from course.qos_lab import private_stdout
from course.qos_lab.profile import Profile

TOPIC = "experiment"


class Writer:
    """Carries the lines out."""

    def __init__(self, node: Node) -> None:
        """Publish through ``node``."""
        self._node = node
        self._publisher: Publisher | None = None
        self._never = threading.Event()

    def carry_out(self, line: dict[str, Any]) -> Any:
        """Carry one line out; return the answer."""
        ((verb, value),) = line.items()
        return getattr(self, f"_{verb}")(value)

    def _offer(self, profile: dict[str, Any]) -> bool:
        self._publisher = self._node.create_publisher(UInt32, TOPIC, Profile(**profile).to_rclpy())
        return True

    def _matched(self, seconds: float) -> bool:
        publisher, end = self._publisher, time.monotonic() + seconds
        assert publisher is not None
        while not publisher.get_subscription_count() and time.monotonic() < end:
            self._never.wait(0.01)
        return bool(publisher.get_subscription_count())

    def _publish(self, what: tuple[int, int, float]) -> bool:
        assert self._publisher is not None
        first, count, rate = what
        start = time.monotonic()
        for number in range(count):
            self._never.wait(max(0.0, start + number / rate - time.monotonic()))
            self._publisher.publish(UInt32(data=first + number))
        return True

    def _acked(self, seconds: float) -> bool:
        assert self._publisher is not None
        return bool(self._publisher.wait_for_all_acked(Duration(seconds=seconds)))

    def _pause(self, seconds: float) -> bool:
        self._never.wait(seconds)
        return True


def main() -> None:
    """Run until standard input ends."""
    answer = private_stdout.claim_stdout()
    context = Context()
    rclpy.init(args=[], context=context, signal_handler_options=SignalHandlerOptions.NO)
    node = Node("writer", context=context, enable_rosout=False, start_parameter_services=False)
    writer = Writer(node)
    for line in sys.stdin:
        answer(json.dumps(writer.carry_out(json.loads(line))))
    node.destroy_node()
    context.try_shutdown()


if __name__ == "__main__":
    main()
