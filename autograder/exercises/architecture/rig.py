"""The rig of the architecture exam: brings the design up, reads its graph, and pours dye in."""

from __future__ import annotations

import secrets
from collections import defaultdict
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any

from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy

from autograder.examination.check_context import CheckContext, StudentError
from autograder.examination.exam import Failed
from autograder.exercises.architecture.goal_sender import SETTLE, WAYPOINT, marked_message
from autograder.exercises.architecture.link_faults import link_faults, name_all_nodes, name_nodes
from autograder.exercises.architecture.robot_graph import Offer, RobotGraph, Topic, read_graph
from autograder.exercises.architecture.robot_roles import ACTION, MOTORS, SENSORS, WHEELS, Jobs
from autograder.exercises.architecture.tracing import Poured, Pours
from autograder.observe.marked_types import TypeNotInstalledError, load_type
from autograder.observe.participants import (
    NO_NODE,
    count_listening,
    known_participants,
    node_of,
    of_others,
)
from autograder.observe.patience import Patience
from autograder.observe.quiet_node import QuietNode
from autograder.observe.stillness import Stillness
from course.design import message_tags
from course.errors import WaitTimeout

DESIGN = "design"
THREADS = 8
"""Threads that run the design's nodes: one that waits in a callback holds up itself alone."""
USUAL_PARTICIPANTS = 2
"""The examiner's, and the one that all of a design's nodes share."""
AT_REST_S = 3.0
"""Seconds of a busy process after which what it has made counts as discovered."""


class ArchitectureRig:
    """The examiner's view of one design."""

    def __init__(self, bench: CheckContext) -> None:
        """Bring up the examiner's node; the design is started by its first check."""
        self.subject = bench.subject
        self._session = bench.session
        self._outside = bench.outside
        self.node = bench.session.run(QuietNode, f"examiner_{secrets.token_hex(4)}")
        self.graph = RobotGraph()
        self.jobs = Jobs(self.graph)
        self.seen: dict[str, set[int]] = defaultdict(set)
        self._heard: set[str] = set()
        self._pours = Pours(bench.session, self.node, self.seen)
        self._labels: list[str] = []
        self._marks: set[str] = set()
        self._drove: set[str] = set()  # nodes that could when a mark came to the motors
        self._unread: UnicodeDecodeError | None = None  # of a name that is no text

    def start(self) -> None:
        """Bring up every node of the design and read the graph when all of it is there.

        Raises:
            StudentError: there is no design, or a node of it does not come up.
            SubjectGone: the process ended or hangs.
        """
        self.subject.open(threads=THREADS)
        self._labels = list(self.subject.start_all(DESIGN))
        self.graph = self._read_graph()
        self.jobs = Jobs(self.graph)
        for topic in self.graph.topics.values():
            if topic.writers:
                self._tap_topic(topic)

    def _read_graph(self) -> RobotGraph:
        """Read the graph when all is on it that the subject's nodes have by now."""
        mark = f"_mark_{secrets.token_hex(4)}"
        self._marks.add(f"/{mark}")
        self.subject.mark(mark)
        if not self.wait(partial(self._has_seen, mark), 4 * SETTLE):
            raise Failed(
                expected="What your program makes comes up on the ROS graph.",
                actual=f"A small node that was made beside yours did not within {4 * SETTLE:.0f} "
                "s: does something in the notebook keep the process from talking to others?",
            )
        self._discover_others()
        graph = read_graph(self.node, self._marks)
        if NO_NODE in graph.nodes:  # each participant tells its names in its own time
            self.wait(lambda: NO_NODE not in read_graph(self.node, self._marks).nodes, SETTLE)
            graph = read_graph(self.node, self._marks)
        return graph

    def _discover_others(self) -> None:
        """Wait for what is in participants of other contexts: the mark tells of its own alone."""
        domain_id = self._session.domain_id
        self.wait(lambda: len(known_participants(self.node)) >= count_listening(domain_id))
        if len(known_participants(self.node)) > USUAL_PARTICIPANTS:
            Stillness(self._outside).wait_for_rest(timeout=AT_REST_S)

    def new_faults(self) -> list[str]:
        """Return what is wrong with endpoints that have come since the start, a sentence each."""
        if self._unread is not None:
            raise self._unread
        now = self._read_graph()
        drivers = now.get_topic(MOTORS).written_by
        faults = link_faults(now.added_since(self.graph))
        if len(drivers) > 1 and drivers - self.jobs.controllers:
            faults.insert(0, f"{name_all_nodes(drivers)} command the motors.")
        elif passing := self._drove - self.jobs.controllers - drivers - {NO_NODE}:
            faults.insert(0, f"{name_nodes(passing)} commanded the motors for a while.")
        return faults

    def _has_seen(self, mark: str) -> bool:
        ends = (
            self.node.get_publishers_info_by_topic(f"/{mark}"),
            self.node.get_subscriptions_info_by_topic(f"/{mark}"),
        )
        return all(any(end.node_name == mark for end in side) for side in ends)

    def _tap_topic(self, topic: Topic) -> None:
        """Note the tags that go over a topic; of a type that we know."""
        with suppress(TypeNotInstalledError):
            for name in topic.types:
                self.node.create_subscription(
                    load_type(name),
                    topic.name,
                    partial(self._note_message, topic.name),
                    QoSProfile(
                        history=HistoryPolicy.KEEP_ALL, reliability=ReliabilityPolicy.BEST_EFFORT
                    ),
                )

    def _note_message(self, topic: str, message: Any) -> None:
        tags = message_tags.read_all(message)
        self._heard.add(topic)
        self.seen[topic].update(tags)
        if topic == MOTORS and tags:
            self._note_drivers()
        self._pours.answer_overheard(topic, tags)

    def _note_drivers(self) -> None:
        """Note who can command the motors now; what cannot be read is for `new_faults` to tell."""
        try:
            ends = of_others(self.node.get_publishers_info_by_topic(MOTORS))
        except UnicodeDecodeError as error:
            self._unread = error
        else:
            self._drove |= {node_of(end) for end in ends}

    def knows_type(self, topic: Topic) -> bool:
        """Whether a topic's type is installed here."""
        try:
            return bool([load_type(name) for name in topic.types])
        except TypeNotInstalledError:
            return False

    def wait(self, condition: Callable[[], Any], timeout: float | None = None) -> bool:
        """Wait until ``condition`` holds; return whether it did before the deadline.

        Without ``timeout`` (s) that is when it would have come: see `Patience`.
        """
        if timeout is None:
            return Patience(Stillness(self._outside)).wait(self._session, condition)
        with suppress(WaitTimeout):
            self._session.until(condition, timeout, "an observation")
            return True
        return False

    def gets_answer(self, offer: Offer) -> bool:
        """Whether a service answers a lifelike request; one of a type unknown here is not asked."""
        with suppress(TypeNotInstalledError):
            kind = load_type(offer.type)
            request = marked_message(kind.Request, message_tags.fresh_tag(), WAYPOINT)
            try:
                self._session.call(kind, offer.name, request, SETTLE)
            except WaitTimeout:
                return False
        return True

    # Dye.

    def has_pose_estimate(self, poses: Collection[str]) -> bool:
        """Whether anything comes on one of ``poses`` while wheels and LIDAR report."""
        self._wait_for_taps()
        topics = [topic for topic in self._sensor_topics() if topic.name in (WHEELS, "/scan")]
        return self._pours.roll_until(topics, lambda: bool(self._heard & set(poses)))

    def colour_goal(self, action: str, action_type: Any, arrived_on: Collection[str]) -> Poured:
        """Send marked navigation goals: see `Pours.pour_goals`."""
        self._wait_for_taps()
        return self._pours.pour_goals(action, action_type, self._sensor_topics(), arrived_on)

    def colour_topics(self, topics: Collection[Topic], arrived_on: Collection[str]) -> Poured:
        """Publish marked messages, with a goal under way: see `Pours.pour_topics`.

        A robot that stands still without a goal is right, and nothing would arrive at its motors.
        """
        self._wait_for_taps()
        with suppress(TypeNotInstalledError):
            if self.jobs.navigators:
                self._pours.under_way(ACTION, load_type(self.graph.get_action(ACTION).type))
        poured = {topic.name for topic in topics}
        others = [topic for topic in self._sensor_topics() if topic.name not in poured]
        return self._pours.pour_topics(topics, others, arrived_on)

    def _sensor_topics(self) -> list[Topic]:
        topics = [self.graph.get_topic(name) for name in SENSORS]
        return [topic for topic in topics if topic.readers and self.knows_type(topic)]

    def _wait_for_taps(self) -> None:
        """Wait until the design's nodes know who listens: what is sent before is not seen here."""
        tapped = [t for t in self.graph.topics.values() if t.writers and self.knows_type(t)]
        wanted = {topic.name: len(topic.readers) + 1 for topic in tapped}

        def known() -> bool:
            counts = self.subject.sees(
                f"{DESIGN}.{self._labels[0]}", {"subscribers": list(wanted)}
            )["subscribers"]
            return all(counts[name] >= wanted[name] for name in wanted)

        with suppress(StudentError):  # a node of a student's own may be gone by now
            self.wait(known, SETTLE / 4)


@contextmanager
def architecture_rig(bench: CheckContext) -> Iterator[ArchitectureRig]:
    """Give a rig, and take the examiner's endpoints down afterwards."""
    rig = ArchitectureRig(bench)
    try:
        yield rig
    finally:
        bench.session.stop(rig.node)
