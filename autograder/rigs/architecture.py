"""The rig of the architecture exam: brings the design up, reads its graph, and pours dye in."""

# mypy: allow-untyped-calls

from __future__ import annotations

import importlib
import secrets
from collections import defaultdict
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any

from rclpy.duration import Duration
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)

from autograder.bench import Bench
from autograder.rigs.robot_graph import RobotGraph, Topic, read_graph
from autograder.rigs.robot_jobs import SENSORS, Jobs
from course import WaitTimeout
from course.design import dye
from course.interfaces import define

DESIGN = "design"
SETTLE = 8.0
"""Seconds that something expected may take: discovery takes 0.3 s, on a busy machine a few."""
POURS = 8
"""How often dye is poured in before it counts as lost, each time with another tag."""
ARRIVALS = 2
"""How many of the tags must arrive: one could be a lucky guess of somebody who makes tags up."""

NAVIGATE_TO = "robot_msgs/action/NavigateTo"
NAVIGATE_TO_TEXT = """\
geometry_msgs/PoseStamped waypoint
---
bool arrived
string message
---
float32 distance_left
"""
"""The action that the notebook gives: the examiner needs its type, too."""


class UnknownTypeError(Exception):
    """A type on the graph that is not installed where the examiner runs."""


class GoalRejectedError(Exception):
    """The action server did not take a goal."""


def load_type(name: str) -> Any:
    """Return the class of a type on the graph.

    Raises:
        UnknownTypeError: it is not installed.
    """
    if name == NAVIGATE_TO:
        return define(NAVIGATE_TO, NAVIGATE_TO_TEXT)
    package, kind, cls = name.split("/")
    try:
        return getattr(importlib.import_module(f"{package}.{kind}"), cls)
    except (ImportError, AttributeError):
        raise UnknownTypeError(name) from None


class ArchitectureRig:
    """The examiner's view of one design."""

    def __init__(self, bench: Bench) -> None:
        """Bring up the examiner's node; the design is started by its first check."""
        self.subject = bench.subject
        self._session = bench.session
        self.node = bench.session.run(
            Node,
            f"examiner_{secrets.token_hex(4)}",
            start_parameter_services=False,
            enable_rosout=False,
        )
        self.graph = RobotGraph()
        self.jobs = Jobs(self.graph)
        self.seen: dict[str, set[int]] = defaultdict(set)
        self._inlets: dict[str, Any] = {}
        self._lost: set[int] = set()

    def start(self) -> None:
        """Bring up every node of the design and read the graph when all of it is there.

        Raises:
            StudentError: there is no design, or a node of it does not come up.
            SubjectGone: the process ended or hangs.
        """
        self.subject.start_all(DESIGN)
        mark = f"_mark_{secrets.token_hex(4)}"
        self.subject.mark(mark)
        self._session.until(partial(self._has_seen, mark), 4 * SETTLE, "the mark on the graph")
        self.graph = read_graph(self.node)
        self.jobs = Jobs(self.graph)
        for topic in self.graph.topics.values():
            if topic.writers:
                self._tap(topic)

    def _has_seen(self, mark: str) -> bool:
        ends = (
            self.node.get_publishers_info_by_topic(f"/{mark}"),
            self.node.get_subscriptions_info_by_topic(f"/{mark}"),
        )
        return all(any(end.node_name == mark for end in side) for side in ends)

    def _tap(self, topic: Topic) -> None:
        """Note the tags that go over a topic; of a type that we know."""
        with suppress(UnknownTypeError):
            for name in topic.types:
                self.node.create_subscription(
                    load_type(name),
                    topic.name,
                    partial(self._note, topic.name),
                    QoSProfile(
                        history=HistoryPolicy.KEEP_ALL, reliability=ReliabilityPolicy.BEST_EFFORT
                    ),
                    event_callbacks=SubscriptionEventCallbacks(use_default_callbacks=False),
                )

    def _note(self, topic: str, message: Any) -> None:
        if (tag := dye.read(message)) is not None:
            self.seen[topic].add(tag)

    def knows(self, topic: Topic) -> bool:
        """Whether a topic's type is installed here."""
        try:
            return bool([load_type(name) for name in topic.types])
        except UnknownTypeError:
            return False

    def wait(self, condition: Callable[[], Any], timeout: float = SETTLE) -> bool:
        """Wait until ``condition`` holds; return whether it did before the deadline."""
        with suppress(WaitTimeout):
            self._session.until(condition, timeout, "an observation")
            return True
        return False

    # Dye.

    def colour_topics(self, topics: Collection[Topic], arrived_on: Collection[str]) -> bool:
        """Publish tagged messages on topics until tags are seen on one of ``arrived_on``.

        Returns:
            Whether they were, in time.

        Raises:
            UnknownTypeError: a topic's type is not installed here.
        """
        inlets = [(self._inlet(topic), topic) for topic in topics]
        # The examiner's own tap is a subscription, too. Who is late all the same gets a later pour.
        self.wait(
            lambda: all(i.get_subscription_count() > len(t.readers) for i, t in inlets), SETTLE / 4
        )

        def publish(tag: int) -> None:
            for inlet, _ in inlets:
                inlet.publish(_marked(inlet.msg_type, tag))

        return self._colour(publish, arrived_on)

    def colour_goal(self, action: str, action_type: Any, arrived_on: Collection[str]) -> bool:
        """Do the same with navigation goals, while the sensors go on as on a robot.

        A node may have to be woken by a reading before it asks for what a goal has changed.

        Raises:
            WaitTimeout: the action server did not answer; says why.
            GoalRejectedError: it did not take the goal.
        """
        topics = [self.graph.topic(name) for name in SENSORS]
        sensors = [self._inlet(topic) for topic in topics if topic.readers and self.knows(topic)]

        def send(tag: int) -> None:
            goal = _marked(action_type.Goal, tag)
            if not self._session.send_goal(action_type, action, goal, timeout=SETTLE).accepted:
                raise GoalRejectedError
            for sensor in sensors:
                sensor.publish(_marked(sensor.msg_type, dye.fresh_tag()))

        return self._colour(send, arrived_on)

    def _colour(self, pour: Callable[[int], None], arrived_on: Collection[str]) -> bool:
        # A link may still be about to connect: what it loses does not come back, so pour again.
        tags: set[int] = set()
        arrived: set[int] = set()
        for _ in range(POURS):
            tags.add(tag := dye.fresh_tag())
            pour(tag)
            self.wait(lambda new=tag: self._at(arrived_on, {new}), SETTLE / POURS)  # type: ignore[misc]
            arrived = self._at(arrived_on, tags)
            if len(arrived) >= ARRIVALS:
                return True
        self._lost = tags - arrived
        return False

    def _at(self, topics: Collection[str], tags: set[int]) -> set[int]:
        return {tag for name in topics for tag in tags & self.seen[name]}

    def got_to(self) -> list[str]:
        """Return the topics on which the dye that did not arrive was seen."""
        seen = list(self.seen.items())  # at once: another thread adds to it
        return sorted(name for name, tags in seen if tags & self._lost)

    def _inlet(self, topic: Topic) -> Any:
        if topic.name not in self._inlets:
            self._inlets[topic.name] = self.node.create_publisher(
                load_type(topic.types[0]),
                topic.name,
                _serving(topic),
                event_callbacks=PublisherEventCallbacks(use_default_callbacks=False),
            )
        return self._inlets[topic.name]


def _marked(msg_type: Any, tag: int) -> Any:
    message = msg_type()
    dye.mark(message, tag)
    return message


def _serving(topic: Topic) -> QoSProfile:
    """Return a profile that every reader of a topic connects to."""
    asked = [end.qos for end in topic.readers]
    manual = any(qos.liveliness == LivelinessPolicy.MANUAL_BY_TOPIC for qos in asked)
    return QoSProfile(
        depth=10,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL,
        deadline=_shortest([qos.deadline for qos in asked]),
        liveliness=LivelinessPolicy.MANUAL_BY_TOPIC if manual else LivelinessPolicy.AUTOMATIC,
        liveliness_lease_duration=_shortest([qos.liveliness_lease_duration for qos in asked]),
    )


def _shortest(durations: list[Duration]) -> Duration:
    return min((d for d in durations if d.nanoseconds > 0), key=lambda d: d.nanoseconds,
               default=Duration())  # fmt: skip


@contextmanager
def architecture_rig(bench: Bench) -> Iterator[ArchitectureRig]:
    """Give a rig, and take the examiner's endpoints down afterwards."""
    rig = ArchitectureRig(bench)
    try:
        yield rig
    finally:
        bench.session.stop(rig.node)
