"""The student's nodes in a plain program of rclpy, and a clock that only the examiner moves.

Nobody asks the program for anything: what is done to its nodes comes over DDS, and so does time.
What leaves a callback ends the program.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Protocol

from autograder.examination.plain_programs import Program
from autograder.observe.examiner.actions import ActionServerEnd
from autograder.observe.examiner.examiner_end import ExaminerEnd
from autograder.observe.examiner.services import ServiceServer
from autograder.observe.nouns import Action, Service, Task, Topic
from autograder.observe.patience import Patience
from autograder.observe.programs.simulated_clock import SimulatedClock
from autograder.observe.several_nodes.clock_bound_node import ServerT
from autograder.observe.stillness import Stillness

COARSE_S = 0.5
"""Seconds of simulated time in a stride, where nothing has to be punctual."""
MEET_S = 3.0
"""Seconds in which nodes and examiner find each other, if they are all there."""
MEET_IDLE_S = 0.25
"""Seconds, with nobody at work, after which they know each other on both sides: DDS says who is
there every 0.1 s at first."""
END_IDLE_S = 0.3
"""Seconds, with nobody at work, in which a program ends if something in it ends it."""


class ProgramEnded(Exception):  # noqa: N818 - it is a finding, not a fault
    """The program has gone: something left one of its callbacks."""


class Clocked(Protocol):
    """The student's nodes at work, in a session or in a program, by a clock that is moved here.

    What an exam does to them and sees of them can be written once for both.
    """

    end: ExaminerEnd

    @property
    def now_s(self) -> float:
        """Their time in s."""

    def forget(self, *topics: Topic) -> None:
        """Forget what has come on topics so far."""

    def advance_until(self, condition: Callable[[], Any], seconds: float) -> bool:
        """Let so much time pass at most, until a condition holds; return whether it does."""


class ObservedProgram:
    """Nodes of the student's in a plain program.

    Attributes:
        end: the examiner's end of their topics, services and actions.
        there: the classes whose node was seen.
        times: what an exam has timed, in s, by names of its own.
        rested: whether all came to rest after each stride in which something was timed: else it
            may have come later than it seems.
    """

    def __init__(self, program: Program, still: Stillness, tasks: Sequence[Task]) -> None:
        """Bring up the examiner's end in the network of a program, and wait until they have met."""
        self._program, self._still, self._tasks = program, still, tasks
        self._clock = SimulatedClock(program.session)
        end: Any = program.session.run(ExaminerEnd)
        self.end: ExaminerEnd = end
        self.times: dict[str, float] = {}
        self.rested = True
        self._stride_s, self._is_timing = COARSE_S, False
        self._server: ServiceServer | ActionServerEnd | None = None
        for task in tasks:
            for topic in task.subscribes:
                end.publisher(topic)
            for served in task.serves:
                end.connect(served)
        program.wait(self.is_complete, MEET_S)
        for task in tasks:
            for topic in task.publishes:
                end.listen(topic)
        self.meet()
        self.there = frozenset(task.node for task in tasks if not end.missing(task))

    @property
    def now_s(self) -> float:
        """The time of its nodes in s."""
        return self.end.now_s

    def forget(self, *topics: Topic) -> None:
        """Forget what has come on topics so far, so that it answers nothing that comes now."""
        for topic in topics:
            self.end.clear(topic)

    def meet(self) -> None:
        """Wait until those who are there know each other: what is sent before would be lost."""
        Patience(self._still, idle=MEET_IDLE_S).wait(self._program.session, lambda: False)

    def wait(self, condition: Callable[[], Any], idle_s: float | None = None) -> bool:
        """Wait, while time stands still, until a condition holds or the program has gone.

        Args:
            condition: what may take its time.
            idle_s: seconds with nobody at work after which it does not come any more.
        """
        patience = Patience(self._still, idle=idle_s) if idle_s else Patience(self._still)
        patience.wait(self._program.session, lambda: condition() or self.has_ended())
        return bool(condition())

    def is_complete(self) -> bool:
        """Return whether every endpoint of its nodes is on the graph."""
        return not any(map(self.end.missing, self._tasks))

    def has_ended(self) -> bool:
        """Return whether the program has gone."""
        return self._program.has_ended()

    def ends_soon(self) -> bool:
        """Return whether the program goes: what a callback raised ends it with its next one."""
        try:
            for _ in range(2):
                self._stride()
        except ProgramEnded:
            return True
        return self.wait(self.has_ended, END_IDLE_S)

    def interrupt(self) -> None:
        """Interrupt the program: see `autograder.examination.plain_programs.Program`."""
        self._program.interrupt()

    @contextmanager
    def timing(self, stride_s: float) -> Iterator[None]:
        """Let time pass in strides of so many s for the length of the block."""
        self._stride_s, self._is_timing = stride_s, True
        try:
            yield
        finally:
            self._stride_s, self._is_timing = COARSE_S, False

    @contextmanager
    def served_by(
        self, server: Callable[[Any, Callable[[], float]], ServerT], served: Service | Action
    ) -> Iterator[ServerT]:
        """Play a server that a node uses for the length of the block; then it vanishes."""
        made: Any = self._program.session.run(lambda: server(served, lambda: self.now_s))
        self._server = made
        try:
            if self._is_timing:
                self.meet()
            self._rest()
            yield made
        finally:
            self._server = None
            self._program.session.stop(made)

    def advance_until(self, condition: Callable[[], Any], seconds: float) -> bool:
        """Let so much time pass at most, until a condition holds; return whether it does.

        Raises:
            ProgramEnded: the program has gone.
        """
        end_s = self.now_s + seconds - 1e-3  # else sums of floats decide
        self._rest()
        while not (holds := bool(condition())) and self.now_s < end_s:
            self._stride()
        return holds

    def advance(self, seconds: float = 0.0) -> None:
        """Let so much time pass, but a stride at least.

        Raises:
            ProgramEnded: the program has gone.
        """
        self.advance_until(lambda: False, max(seconds, self._stride_s))

    def _stride(self) -> None:
        if self.has_ended():
            raise ProgramEnded
        self.end.now_s += self._stride_s  # before: what comes on the way bears the stride's end
        self._clock.move(self._stride_s)
        self._rest()

    def _rest(self) -> None:
        rested = self._still.wait_for_rest()
        if self._server is not None and self._server.release():
            rested = self._still.wait_for_rest() and rested
        self.rested = self.rested and (rested or not self._is_timing)
