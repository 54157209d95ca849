"""The student's program: makes a camera driver's nodes, and has them destroyed in several ways.

What it raises in this is a failure of the check.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

from autograder.examination.check_context import REPLY_TIMEOUT_S, StudentError, Subject, SubjectGone
from autograder.examination.exam import Failed
from autograder.exercises.resources.camera_graph import CameraGraph


class Program:
    """One subject, as the place where nodes begin and end."""

    def __init__(self, subject: Subject, graph: CameraGraph) -> None:
        """Act on ``subject``; ``graph`` is told which nodes are its own."""
        self._subject = subject
        self._graph = graph

    def start(self, name: str, *args: Any) -> str:
        """Make a node; return its fully qualified name."""
        try:
            node = self._subject.start(name, *args)
        except StudentError as error:
            shown = ", ".join(repr(arg) for arg in args)
            raise Failed(
                expected=f"{name}({shown}) makes a node without an error.",
                actual=error.feedback_text,
            ) from None
        self._graph.note_started(node)
        return node

    def stop(self, name: str, *, bare: bool = False) -> None:
        """Have the node taken out of its executor and destroyed.

        A session tidies up after its ``destroy_node()``; ``bare``: nobody does.
        """
        self._run_cleanup(name, lambda: self._subject.stop(name, bare=bare))

    def destroy(self, name: str) -> None:
        """Have ``destroy_node()`` called while the node spins."""
        self._run_cleanup(name, lambda: self._subject.call(name, "destroy_node"))

    def destroy_again(self, name: str) -> None:
        """Have ``destroy_node()`` called a second time, which must return as well."""
        try:
            self.destroy(name)
        except SubjectGone as gone:
            if not self._subject.hangs:
                raise
            raise Failed(
                expected="destroy_node() can be called a second time.",
                actual=f"The second call did not return within {REPLY_TIMEOUT_S:.0f} s.",
            ) from gone

    def drop_node(self, name: str) -> None:
        """Have the session let go of a node that is destroyed; it destroys it once more."""
        with suppress(StudentError):
            self._subject.stop(name)

    def _run_cleanup(self, name: str, act: Callable[[], object]) -> None:
        try:
            act()
        except StudentError as error:
            raise Failed(
                expected=f"destroy_node() of {name} ends without an error.",
                actual=error.feedback_text,
            ) from None
