"""Simulated time for the nodes of a plain program: the examiner publishes /clock itself.

A session moves the time of its nodes through the student's process, where somebody may move it by
more or by less. A program follows any node that publishes /clock (ROS 2 design, "Clock and Time").
"""

from __future__ import annotations

from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.time import Time
from rosgraph_msgs.msg import Clock

from autograder.observe.examiner.quiet_node import QuietNode
from course.runtime.core_session import CoreSession


class SimulatedClock:
    """The clock of nodes that were made with ``sim_time``; it begins at 0."""

    def __init__(self, session: CoreSession) -> None:
        """Publish it from a node of its own in a program's ``session``."""
        node = session.run(lambda: QuietNode("clock"))
        assert isinstance(node, QuietNode)
        qos = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
        self._publisher, self._now_ns = node.create_publisher(Clock, "/clock", qos), 0

    @property
    def now(self) -> float:
        """Simulated time in seconds."""
        return self._now_ns / 1e9

    @property
    def is_followed(self) -> bool:
        """Whether any node has been found to follow it."""
        return bool(self._publisher.get_subscription_count())

    def move(self, seconds: float) -> None:
        """Tell the nodes that so many seconds have passed; what that sets off is under way then.

        The second message, a nanosecond later, gives executors something to do: what has come by
        then goes on.
        """
        for more_ns in (round(seconds * 1e9), 1):
            self._now_ns += more_ns
            self._publisher.publish(Clock(clock=Time(nanoseconds=self._now_ns).to_msg()))
