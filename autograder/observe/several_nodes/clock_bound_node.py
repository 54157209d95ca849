"""A node among things that fail: all its waiting has to run on its clock, and nothing may raise.

The examiner plays the servers that it uses, which are slow, refuse, or vanish.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, TypeVar

from autograder.examination.check_context import CheckContext
from autograder.examination.exam import Failed
from autograder.observe.examiner.actions import ActionServerEnd
from autograder.observe.examiner.examiner_end import ExaminerEnd
from autograder.observe.examiner.services import ServiceServer
from autograder.observe.nouns import Action, Service, Task
from autograder.observe.observed_node import ObservedNode
from autograder.observe.several_nodes.wall_waits import NAP_S, WallWaitWatch
from autograder.observe.stillness import Stillness
from course.errors import WaitTimeout

ROUNDS = 10
"""Requests that may follow from each other while time stands still."""

ServerT = TypeVar("ServerT", ServiceServer, ActionServerEnd)


class WallWait(Failed):
    """A callback waits by the wall clock: what comes after that, and when, says nothing more."""


class ClockBoundNode(ObservedNode):
    """One of the student's nodes, all of whose waiting has to run on its own clock."""

    def __init__(self, bench: CheckContext, task: Task, end: ExaminerEnd, still: Stillness) -> None:
        """Make the node, and require its endpoints.

        Raises:
            StudentError: its class is missing, or its constructor raised.
            Failed: it lacks an endpoint of its task.
        """
        self._server: ServiceServer | ActionServerEnd | None = None
        self._is_unserved = False
        self._goes_on = False  # a callback that was there at the end of the last stride
        self._waits = WallWaitWatch(bench, lambda seconds: self._comes_within(seconds))
        # What earlier nodes of the same session raised, of whom this one knows nothing.
        self._known = bench.subject.own_errors()
        self._ended = frozenset(bench.subject.thread_errors())
        super().__init__(bench, task, end, still)
        self.require_endpoints()

    def rest(self) -> None:
        """Return when all that was sent has been dealt with, on both sides.

        A node that meets each answer with another request never comes to rest: time goes on.
        """
        super().rest()
        for _ in range(ROUNDS):
            if self._server is None or not self._server.release():
                return
            super().rest()

    @contextmanager
    def served_by(
        self, server: Callable[[Any, Callable[[], float]], ServerT], served: Service | Action
    ) -> Iterator[ServerT]:
        """Play a server that the node uses for the length of the block; then it vanishes.

        Args:
            server: `ServiceServer` or `ActionServerEnd`.
            served: what it serves.
        """
        made: Any = self._bench.session.run(lambda: server(served, lambda: self.now_s))
        self._server = made
        try:
            self._await_seen({"services": served.services, "publishers": served.topics})
            self.rest()
            yield made
        finally:
            self._server = None
            self._bench.session.stop(made)

    def is_served(self, served: Service | Action) -> bool:
        """Return whether the examiner plays a server that the node uses just now."""
        return self._server is not None and self._server.served == served

    @contextmanager
    def unserved(self, served: Service | Action) -> Iterator[None]:
        """Require all waiting to run on the node's clock while nobody serves what it asks for.

        Outside such a block that is looked for only while some callback goes on; and where it is
        seen from outside, before every stride.
        """
        self._await_seen({"services": served.services}, there=False)
        self._is_unserved = True
        try:
            yield
        finally:
            self._is_unserved = False

    def _advance_by(self, seconds: float) -> bool:
        # Now, and not after the stride: what the node does has just come to rest, so that a wait
        # has only begun, while a stride with a blocked callback takes long in real time.
        if self._is_unserved or self._goes_on or self._waits.sees_from_outside:
            self._require_no_wall_wait()
        self._goes_on = super()._advance_by(seconds)
        return self._goes_on

    def _require_no_wall_wait(self) -> None:
        if wait := self._waits.find_wait():
            raise WallWait(expected=self._by_the_clock, actual=wait)

    @property
    def _by_the_clock(self) -> str:
        return f"All waiting of {self._task.node} runs on the node's clock."

    def _comes_within(self, seconds: float, happened: Callable[[], Any] = lambda: False) -> bool:
        """Return whether something happens within so many s of wall time."""
        with suppress(WaitTimeout):
            self._bench.session.until(happened, timeout=seconds, what="an observation")
            return True
        return False

    def require_standstill(self, happened: Callable[[], Any], what: str, seconds: float) -> None:
        """Require that something does not happen while the node's clock stands still.

        A thread or a timer on the wall clock would go on.

        Args:
            happened: whether it has.
            what: it would be, as a clause.
            seconds: of wall time in which it would.

        Raises:
            WallWait: it did, or a callback waits by the wall clock.
        """
        self._require_no_wall_wait()
        if happened() or not self._still.wait_for_rest():
            return  # it came by then, or somebody is at work all the time: that proves nothing
        self._require_no_wall_wait()  # on a busy machine one may not have begun at the first look
        if not self._comes_within(NAP_S, happened) and self._comes_within(seconds, happened):
            raise WallWait(
                expected=self._by_the_clock,
                actual=f"{what}, within {seconds:g} s of wall time, while that stood still.",
            )

    def error_note(self) -> str:
        """Return what a callback and a thread raised since the node was made, a sentence each."""
        ended = [e for e in self._bench.subject.thread_errors() if e not in self._ended]
        thread = f" A thread of yours ended with {ended[-1].rstrip('.')}." if ended else ""
        return super().error_note() + thread

    def require_no_errors(self) -> None:
        """Require that nothing of the student's own has left a callback since the node was made.

        A subject is believed where it speaks against itself. What it does not tell of shows in a
        plain program, which ends when the same is done to a node there: see
        `autograder.observe.several_nodes.program_trials`.

        Raises:
            Failed: something has.
        """
        for told, count in self._bench.subject.own_errors().items():
            if count > self._known.get(told, 0):
                raise Failed(
                    expected="Nothing leaves a callback as an exception.",
                    actual=f"What was seen from outside was right, but {told.rstrip('.')}.",
                )
