"""The examiner's publishers on the topics of a student's design: of messages that bear marks."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, LivelinessPolicy, QoSProfile, ReliabilityPolicy

from autograder.observe.graph.ros_graph import End, GraphTopic
from autograder.observe.marks.marked_types import load_type, marked_message
from course.design.lifelike import FAR_M, lifelike_message

REPEAT_S = 0.02
"""Seconds until a marked message is sent again: a node may work on the newest now and then."""
AT_ONCE_S = 0.005
"""Seconds until it may be sent again because somebody else's message was newer than it."""


class MarkedPublishers:
    """A publisher on each topic of a graph that something is to be said on."""

    def __init__(self, node: Node) -> None:
        """Have ``node`` publish, which is the examiner's."""
        self._node = node
        self._publishers: dict[str, Any] = {}

    def on(self, topic: GraphTopic) -> Any:
        """Return the publisher on a topic; it is there from the first call on.

        Raises:
            TypeNotInstalledError: the topic's type is not installed here.
        """
        if topic.name not in self._publishers:
            self._publishers[topic.name] = self._node.create_publisher(
                load_type(topic.types[0]), topic.name, fitting_qos(topic.readers)
            )
        return self._publishers[topic.name]

    def publish(self, topic: GraphTopic, tag: int) -> None:
        """Publish a reading with a mark, or (0) one without that sees free room around."""
        publisher = self.on(topic)
        kind = publisher.msg_type
        publisher.publish(marked_message(kind, tag) if tag else lifelike_message(kind, FAR_M))


class MarkedStream:
    """Messages with one mark, again and again, on each of some topics.

    Attributes:
        topics: by their names.
        tag: the mark.
        publish_at_once: sends it again, but not more often than every `AT_ONCE_S`.
    """

    def __init__(self, publishers: MarkedPublishers, topics: Mapping[str, GraphTopic]) -> None:
        """Send nothing yet."""
        self.topics, self.tag = topics, 0
        self.publish_at_once = Periodic(AT_ONCE_S, self.publish)
        self._publishers = publishers

    def publish(self) -> None:
        """Send a message with the mark on each of the topics."""
        for topic in self.topics.values():
            self._publishers.publish(topic, self.tag)


class Periodic:
    """Acts when it is called, and the last time was so long ago."""

    def __init__(self, seconds: float, act: Callable[[], None]) -> None:
        """Act for the first time after so many seconds."""
        self._seconds, self._act = seconds, act
        self.put_off()

    def __call__(self) -> None:
        """Act if it is time."""
        if time.monotonic() - self._last >= self._seconds:
            self._act()
            self.put_off()

    def put_off(self) -> None:
        """Act no earlier than so many seconds from now."""
        self._last = time.monotonic()


def fitting_qos(readers: Iterable[End]) -> QoSProfile:
    """Return a profile of a publisher that each of some subscriptions connects to."""
    asked = [end.qos for end in readers]
    manual = any(qos.liveliness == LivelinessPolicy.MANUAL_BY_TOPIC for qos in asked)
    return QoSProfile(
        depth=10,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL,
        deadline=_shortest(qos.deadline for qos in asked),
        liveliness=LivelinessPolicy.MANUAL_BY_TOPIC if manual else LivelinessPolicy.AUTOMATIC,
        liveliness_lease_duration=_shortest(qos.liveliness_lease_duration for qos in asked),
    )


def _shortest(durations: Iterable[Duration]) -> Duration:
    """Return the shortest that is set: none is 0."""
    limited = [duration for duration in durations if duration.nanoseconds > 0]
    return min(limited, key=lambda duration: duration.nanoseconds, default=Duration())
