"""The student's process at work in wall time: waits for what it does, and keeps its nodes busy.

For exams in which DDS itself is looked at: queues, lifespans, deadlines and repairs know no other
clock than the wall's. `autograder.observe.observed_node` is for nodes on simulated time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from typing import Any

from autograder.examination.check_context import CheckContext, StudentError
from autograder.examination.exam import Failed, NotExaminable
from autograder.observe.examiner.spinner import Spinner
from autograder.observe.patience import Patience
from autograder.observe.phrases import callback_raised
from autograder.observe.stillness import HANGS_S, RESTLESS_S, Stillness
from autograder.processes.outside.holding import HoldError
from course.errors import WaitTimeout

NOW_S = 0.05
"""Seconds in which a busy machine comes to a look at all threads, and another."""


class ObservedProcess:
    """The student's process, beside the examiner's nodes that look at it.

    Attributes:
        bench: what the check works with; ``subject`` is its grip on the student's process.
        spinner: runs the examiner's nodes, which are to be added to it.
    """

    def __init__(self, bench: CheckContext) -> None:
        """Begin to observe, as yet without nodes of the examiner's."""
        self.bench, self.subject = bench, bench.subject
        self.spinner = Spinner(bench.session.context)
        self._still = Stillness(bench.outside)

    def close(self) -> None:
        """Take the examiner's nodes down."""
        self.spinner.close()

    def start_node(self, name: str) -> None:
        """Make a node of a class of the student's.

        Raises:
            Failed: its class is missing, or its constructor raised.
        """
        try:
            self.subject.start(name)
        except StudentError as error:
            raise Failed(
                expected=f"{name}() makes a node without an error.", actual=error.feedback_text
            ) from None

    def wait(
        self, condition: Callable[[], Any], timeout_s: float | None = None, *, often: bool = True
    ) -> bool:
        """Wait until ``condition`` holds; return whether it did before the deadline.

        Args:
            condition: what is waited for.
            timeout_s: seconds; left out, it is when it would have come: see `Patience`.
            often: look after each callback of the examiner's, else every 20 ms, which is right
                while many messages come in.
        """
        if timeout_s is None:
            return self.start_patience().wait(self.spinner, condition)
        with suppress(WaitTimeout):
            self.spinner.until(condition, timeout_s, "an observation", often=often)
            return True
        return False

    def start_patience(self) -> Patience:
        """Return for how long something is waited for that may never come."""
        return Patience(self._still)

    def wait_for_rest(self, patience_s: float = RESTLESS_S) -> None:
        """Return when all that was sent has been dealt with, or after so many s of work."""
        self._still.wait_for_rest(patience_s, max(patience_s, HANGS_S))

    def is_at_rest(self) -> bool:
        """Return whether all is at rest just now."""
        return self._still.wait_for_rest(timeout=NOW_S)

    def error_note(self) -> str:
        """Return which error a callback raised last, as a phrase in brackets, or nothing."""
        raised = self.subject.errors()
        return f" ({callback_raised(raised[-1])})" if raised else ""

    @property
    def can_hold(self) -> bool:
        """Whether the process is in a sandbox, where all its threads can be held from outside."""
        return self.bench.outside.own_network

    @contextmanager
    def keep_busy(self, name: str) -> Iterator[Callable[[], bool]]:
        """Keep the node of a class busy for the length of the block, while DDS goes on receiving.

        In a sandbox all threads of the process are held, and with them its other nodes; else only
        the callbacks of this node. What is yielded lets it go on before the end of the block, and
        returns whether DDS could not receive meanwhile, by an accident
        (`autograder.processes.outside.holding.HeldThreads.is_jammed`).

        Raises:
            NotExaminable: its threads cannot be held here.
        """
        with ExitStack() as held:
            if self.can_hold:
                self._hold_threads(held)
            else:
                self.subject.pause(name)
                held.callback(self.subject.resume, name)

            def let_go() -> bool:
                if not self.can_hold:
                    held.close()
                    return False
                held.pop_all()
                return bool(self.bench.outside.ask("release"))

            yield let_go

    def _hold_threads(self, held: ExitStack) -> None:
        try:
            self.bench.outside.ask("hold")
        except HoldError as error:
            raise NotExaminable(f"{error} After a hand-in a person looks at it.") from None
        held.callback(self.bench.outside.ask, "release")
