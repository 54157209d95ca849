"""Several nodes that one object of the notebook declares, as they really come up."""

from __future__ import annotations

import secrets
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import Any

from autograder.examination.check_context import CheckContext, StudentError
from autograder.examination.exam import Failed
from autograder.observe.examiner.quiet_node import QuietNode
from autograder.observe.graph.graph_reader import GraphReader
from autograder.observe.graph.ros_graph import GraphTopic, RosGraph
from autograder.observe.marks.mark_tracer import MarkTracer
from autograder.observe.marks.marked_goals import MarkedGoals
from autograder.observe.marks.marked_types import TypeNotInstalledError, is_installed, load_type
from course.design.message_tags import has_room


class ObservedDesign:
    """Nodes that an object of the notebook declares, such as a `course.Design`.

    Attributes:
        graph: what was on the ROS graph when all of them had come up; empty before `start`.
        tracer: sends marks into it and sees where they come out; there after `start`.
    """

    tracer: MarkTracer

    def __init__(self, bench: CheckContext, name: str, threads: int) -> None:
        """Bring up the examiner's node; the student's come up with `start`."""
        self.graph = RosGraph()
        self._bench, self._name, self._threads = bench, name, threads
        self._node = bench.session.run(QuietNode, f"examiner_{secrets.token_hex(4)}")
        self._reader = GraphReader(bench, self._node)
        self._goals: dict[str, MarkedGoals] = {}

    def start(self) -> None:
        """Bring up every node that is declared, and read the graph when all of it is there.

        Raises:
            Failed: there is no such object, or a node of it does not come up.
            SubjectGone: the process ended or hangs.
        """
        expected = f"The notebook has a `{self._name}` whose nodes all come up."
        self._bench.subject.open(threads=self._threads)
        try:
            first, *_ = self._bench.subject.start_all(self._name)
        except StudentError as error:
            raise Failed(expected=expected, actual=error.feedback_text) from None
        self.graph = self.read_again()
        if not self.graph.nodes:
            raise Failed(expected=expected, actual="No node appeared on the ROS graph.")
        self.tracer = MarkTracer(self._bench, self._node, self.graph)
        self.tracer.await_listening(f"{self._name}.{first}")

    def read_again(self) -> RosGraph:
        """Return what is on the graph now: see `RosGraph.added_since`."""
        return self._reader.read()

    def inputs(self, names: Iterable[str]) -> list[GraphTopic]:
        """Return those of some topics that are read, and on which the examiner can speak."""
        topics = [self.graph.topic(name) for name in names]
        return [topic for topic in topics if topic.readers and is_installed(topic.types)]

    def goals(self, action: str) -> MarkedGoals | None:
        """Return the examiner's goals for an action; None if they cannot bear marks.

        Nor can they if the action has no server, or its type is not installed here.
        """
        if action not in self._goals:
            try:
                kind = load_type(self.graph.action(action).type)
            except TypeNotInstalledError:
                return None
            if not has_room(kind.Goal):
                return None
            self._goals[action] = MarkedGoals(self._bench.session, action, kind)
        return self._goals[action]

    def close(self) -> None:
        """Take the examiner's endpoints down."""
        self._bench.session.stop(self._node)


def declared_nodes(name: str, *, threads: int = 1) -> Callable[[CheckContext], Any]:
    """Return what an `Exam` of several nodes takes: each check gets the same `ObservedDesign`.

    Args:
        name: of the object of the notebook; its ``node_factories()`` gives {label: factory}.
        threads: how many run the callbacks of all nodes.

    Example:
        >>> from autograder.examination.exam import Exam
        >>> exam = Exam("robot", declared_nodes("design", threads=8))
    """

    @contextmanager
    def stage(bench: CheckContext) -> Iterator[ObservedDesign]:
        design = ObservedDesign(bench, name, threads)
        try:
            yield design
        finally:
            design.close()

    return stage
