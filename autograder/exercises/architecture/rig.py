"""The rig of the architecture exam: brings the design up, reads its graph, and sends marks in."""

from __future__ import annotations

import secrets
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress

from autograder.examination.check_context import CheckContext
from autograder.exercises.architecture.missing_jobs import all_command_motors
from autograder.exercises.architecture.robot_jobs import (
    ACTION,
    EYES,
    MOTORS,
    SCAN,
    SENSORS,
    WHEELS,
    Jobs,
)
from autograder.observe import GraphReader, GraphTopic, RosGraph, find_link_faults
from autograder.observe.mark_tracer import MarkTracer, Trace
from autograder.observe.marked_goals import MarkedGoals
from autograder.observe.marked_types import TypeNotInstalledError, is_installed, load_type
from autograder.observe.phrases import callback_raised
from autograder.observe.quiet_node import QuietNode
from course.design.message_tags import has_room

DESIGN = "design"
OUTSIDE = (MOTORS, ACTION)
THREADS = 8
"""Threads that run the design's nodes: one that waits in a callback holds up itself alone."""


class ArchitectureRig:
    """The examiner's view of one design.

    Attributes:
        graph: what was on the ROS graph when all of the design had come up.
        jobs: who does what on it.
        tracer: follows marks through it; from `start` on.
        goals: those for the action, if they can bear marks and their type is installed.
    """

    tracer: MarkTracer

    def __init__(self, bench: CheckContext) -> None:
        """Bring up the examiner's node; the design is started by its first check."""
        self._bench = bench
        self.node = bench.session.run(QuietNode, f"examiner_{secrets.token_hex(4)}")
        self._reader = GraphReader(bench, self.node)
        self.graph = RosGraph()
        self.jobs = Jobs(self.graph)
        self.goals: MarkedGoals | None = None

    def start(self) -> None:
        """Bring up every node of the design and read the graph when all of it is there.

        Raises:
            StudentError: there is no design, or a node of it does not come up.
            SubjectGone: the process ended or hangs.
        """
        self._bench.subject.open(threads=THREADS)
        first, *_ = self._bench.subject.start_all(DESIGN)
        self.graph = self._reader.read()
        self.jobs = Jobs(self.graph)
        self.tracer = MarkTracer(self._bench, self.node, self.graph)
        self.tracer.await_listening(f"{DESIGN}.{first}")
        with suppress(TypeNotInstalledError):
            kind = load_type(self.graph.action(ACTION).type)
            if has_room(kind.Goal):
                self.goals = MarkedGoals(self._bench.session, ACTION, kind)

    def late_faults(self) -> list[str]:
        """Return what is wrong with endpoints that have come since the start, a sentence each."""
        now = self._reader.read()
        drivers = now.topic(MOTORS).written_by
        more = len(drivers) > 1 and drivers - self.jobs.controllers
        faults = [all_command_motors(drivers)] if more else []
        return faults + find_link_faults(now.added_since(self.graph), OUTSIDE)

    def has_pose(self, poses: Collection[str]) -> bool:
        """Whether anything comes on one of ``poses`` while wheels and LIDAR report."""
        sensors = self._sensors(WHEELS, SCAN)
        return self.tracer.publish_until(
            sensors, lambda: not self.tracer.heard.isdisjoint(poses), free=EYES
        )

    def trace_goals(self, goals: MarkedGoals) -> Trace:
        """Follow marked goals to the motors."""
        return self.tracer.trace_goals(
            goals, [MOTORS], beside=self._sensors(WHEELS), seeing=self._sensors(*EYES)
        )

    def trace(self, topics: Collection[GraphTopic], wanted: Collection[str]) -> Trace:
        """Follow marked messages on topics to others, with a goal under way."""
        names = [topic.name for topic in topics]
        beside = self._sensors(*(name for name in SENSORS if name not in names))
        return self.tracer.trace_messages(topics, wanted, beside=beside, goals=self.goals)

    def _sensors(self, *names: str) -> list[GraphTopic]:
        topics = [self.graph.topic(name) for name in names]
        return [topic for topic in topics if topic.readers and is_installed(topic.types)]

    def error_note(self, nodes: Collection[str] = ()) -> str:
        """Return what a callback raised, of any node or of some, as the end of a sentence."""
        errors = self._bench.subject.errors()
        if nodes:
            errors = [error for error in errors if any(f" of {n}: " in error for n in nodes)]
        return f"; {callback_raised(errors[-1])}" if errors else ""


@contextmanager
def architecture_rig(bench: CheckContext) -> Iterator[ArchitectureRig]:
    """Give a rig, and take the examiner's endpoints down afterwards."""
    rig = ArchitectureRig(bench)
    try:
        yield rig
    finally:
        bench.session.stop(rig.node)
