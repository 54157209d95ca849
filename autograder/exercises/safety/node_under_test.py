"""One of the student's nodes at work in the error-handling exam, on simulated time.

Only the examiner moves time. It does so in short strides, and lets both processes come to rest
after each, so that what it observes does not depend on the machine's load.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, NamedTuple

from autograder.examination.check_context import CheckContext, Endpoints, StudentError
from autograder.examination.exam import Failed
from autograder.exercises.safety.counterpart import Player
from autograder.observe.patience import Patience
from autograder.observe.stillness import Stillness
from course.errors import WaitTimeout

STRIDE = 0.1  # s of simulated time between two looks
COARSE = 0.5  # s between two looks where it does not matter when exactly something happens
ROUNDS = 10  # of requests that may follow from each other while time stands still


NAP_S = 0.1
"""Seconds of wall time that a thread may nap between two looks at the node's clock."""
SAME_S = 0.02
"""Seconds by which two looks may differ in when a sleep ends."""


class WallWait(Failed):
    """A callback waits by the wall clock: what comes after that, and when, says nothing more."""


class Sleep(NamedTuple):
    """A thread that sleeps ``until`` a time as of time.monotonic(), if nothing wakes it before."""

    thread: int
    until: float
    to_the_end: bool
    """Nothing can: see `autograder.processes.outside.sleeping`."""


class Robot:
    """One of the student's nodes at work; ``draws`` are the numbers of the examination."""

    def __init__(
        self, bench: CheckContext, name: str, player: Player, still: Stillness,
        ended_by: Callable[[str, str], bool],
    ) -> None:  # fmt: skip
        """Make the node of class ``name`` in the subject's present session.

        ``ended_by`` is whether nodes of a class end a plain program in a trial (`survival`).

        Raises:
            Failed: it cannot be made, or lacks an endpoint of the task.
        """
        self.draws = bench.draws
        self.name, self._bench, self._player, self._still = name, bench, player, still
        self._unserved = False
        self._goes_on = False  # a callback that was there at the end of the last stride
        self._ended_by = ended_by
        self._threads = self._of_session()
        # What earlier nodes of the same session raised, of whom this one knows nothing.
        self._known = bench.subject.own_errors()
        self._raised = frozenset(bench.subject.errors())
        self._ended = frozenset(bench.subject.thread_errors())
        try:
            bench.subject.start(name)
        except StudentError as error:
            raise Failed(
                expected=f"{name}() makes a node without an error.",
                actual=error.feedback_text,
            ) from None
        self.wait(lambda: not player.describe_missing())
        if lacking := player.describe_missing():
            raise Failed(
                expected=f"{name} has every endpoint of the task right after it was made.",
                actual=lacking,
            )
        if unheard := player.describe_unheard():
            raise Failed(expected=f"{name} can hear what it is told.", actual=unheard)
        player.subscribe_all()
        self.wait_for_discovery(
            {
                "publishers": player.spoken,
                "subscribers": player.heard_topics,
                "clients": player.used,
            }
        )
        self.wait_for_rest()

    def wait(self, condition: Callable[[], Any], timeout: float | None = None) -> bool:
        """Wait for something of DDS's own, for ``timeout`` s or with `Patience`: time stands still.

        Endpoints take 0.3 s to find each other, as a rule.
        """
        if timeout is None:
            return Patience(self._still).wait(self._bench.session, condition)
        with suppress(WaitTimeout):
            self._bench.session.until(condition, timeout=timeout, what="an observation")
            return True
        return False

    def wait_for_discovery(self, endpoints: Endpoints, there: bool = True) -> bool:
        """Wait until the node has discovered each endpoint, or the loss of each; return if so."""

        def all_seen() -> bool:
            counts = self._bench.subject.sees(self.name, endpoints)
            return all(bool(n) is there for kind in counts.values() for n in kind.values())

        return self.wait(all_seen)

    def wait_for_rest(self) -> None:
        """Return when all that was sent has been dealt with, on both sides.

        A node that meets each answer with another request never comes to rest: time goes on.
        """
        self._still.wait_for_rest()
        for _ in range(ROUNDS):
            if not self._player.resume():
                return
            self._still.wait_for_rest()

    def run(self, until: Callable[[], Any], limit: float, stride: float = STRIDE) -> bool:
        """Let time pass until ``until`` holds, ``limit`` s at most; return whether it does."""
        end = self._player.now + limit
        self.wait_for_rest()
        while not until():
            if self._player.now >= end - STRIDE / 2:
                return False
            self._go_on(min(stride, end - self._player.now))
        return True

    def spend_time(self, seconds: float, stride: float = STRIDE) -> None:
        """Let so much time pass."""
        self.run(lambda: False, seconds, stride)

    @contextmanager
    def watch_wall_waits(self) -> Iterator[None]:
        """Look before each stride whether a callback waits by the wall clock: nobody serves it.

        Outside such a block that is looked for only while some callback goes on. How much simulated
        time such a wait takes depends on the machine, and so would every observation. Threads of
        the student's own may wait as they like.

        In a sandbox it is looked for before every stride: see `_require_no_wall_wait`.
        """
        self._unserved = True
        try:
            yield
        finally:
            self._unserved = False

    def _go_on(self, seconds: float) -> None:
        # Now, and not after the stride: what the node does has just come to rest, so that a wait
        # has only begun, while a stride with a blocked callback takes long in real time.
        if self._unserved or self._goes_on or self._bench.outside.own_network:
            self._require_no_wall_wait()
        self._player.now += seconds  # before: what comes in on the way bears the stride's end
        try:
            self._goes_on = self._bench.subject.advance(seconds)
        except StudentError:
            raise Failed(
                expected=f"No callback of {self.name} blocks while something is slow or broken.",
                actual="A callback held up the node so that even its clock stood still."
                + _of_waits(self._bench.subject.wall_waits())
                + self.error_note(),
            ) from None
        self.wait_for_rest()

    def _require_no_wall_wait(self) -> None:
        """Fail if a thread waits by the wall clock for longer than a nap.

        In a student's own notebook the subject says so of its callbacks. Elsewhere it is seen from
        outside. Only threads of the session run callbacks, which are there before its nodes.
        """
        waits: list[str] = []
        if self._bench.outside.own_network:
            sleeps = [s for s in self._find_sleeps() if s.until > time.monotonic() + NAP_S]
            if not sleeps:
                return
            waits = self._bench.subject.wall_waits()  # now: it may be over when it is certain
            if not any(sleep.to_the_end for sleep in sleeps):
                self.wait(lambda: False, NAP_S)
                later = {sleep.thread: sleep.until for sleep in self._find_sleeps()}
                if not any(abs(later.get(s.thread, 0.0) - s.until) < SAME_S for s in sleeps):
                    return  # what wakes up at once has not waited
        waits = waits or self._bench.subject.wall_waits()
        if waits or self._bench.outside.own_network:
            told = _of_waits(waits).strip() or "A callback waits on the wall clock."
            raise WallWait(expected=self._by_the_clock, actual=told)

    def _of_session(self) -> frozenset[int]:
        """Return the threads that are there before the node is, but those that sleep already."""
        if not self._bench.outside.own_network:
            return frozenset()
        threads = [*map(int, self._bench.outside.ask("threads"))]
        sleeping = self._bench.outside.ask("sleepers", threads=threads)
        return frozenset(threads) - {int(thread) for thread, _, _ in sleeping}

    def _find_sleeps(self) -> list[Sleep]:
        """Return which threads of the session sleep by the wall clock."""
        now = time.monotonic()
        found = self._bench.outside.ask("sleepers", threads=[*self._threads])
        return [Sleep(int(thread), now + left, bool(sure)) for thread, left, sure in found]

    @property
    def _by_the_clock(self) -> str:
        return f"All waiting of {self.name} runs on the node's clock."

    def require_still(self, happened: Callable[[], Any], what: str, seconds: float) -> None:
        """Require that something does not happen while the node's clock stands still.

        A thread or a timer on the wall clock would go on. ``what`` it would be, as a clause.
        """
        self._require_no_wall_wait()
        if happened() or not self._still.wait_for_rest():
            return  # it came by then, or somebody is at work all the time: that proves nothing
        self._require_no_wall_wait()  # on a busy machine one may not have begun at the first look
        if self.wait(happened, NAP_S):
            return
        if self.wait(happened, seconds):
            raise WallWait(
                expected=self._by_the_clock,
                actual=f"{what}, within {seconds:g} s of wall time, while that stood still.",
            )

    def error_note(self) -> str:
        """Return what a callback and a thread raised last, a sentence each; empty if none did.

        What was raised before this node was made is another one's.
        """
        subject = self._bench.subject
        raised = [error for error in subject.errors() if error not in self._raised]
        ended = [error for error in subject.thread_errors() if error not in self._ended]
        told = f" A callback raised an error, in {raised[-1].rstrip('.')}." if raised else ""
        return told + (f" A thread of yours ended with {ended[-1].rstrip('.')}." if ended else "")

    def require_no_errors(self, trial: str = "") -> None:
        """Require that nothing of the student's own has left a callback since the node was made.

        A subject is believed where it speaks against itself. What it does not tell of shows in a
        plain program, which ends when the same is done to a node there: see `survival.ended_by`.
        """
        for told, count in self._bench.subject.own_errors().items():
            if count > self._known.get(told, 0):
                raise Failed(
                    expected="Nothing leaves a callback as an exception.",
                    actual=f"What was seen from outside was right, but {told.rstrip('.')}.",
                )
        if self._ended_by(self.name, trial):
            raise Failed(
                expected="Nothing leaves a callback as an exception.",
                actual="What was seen from outside was right, but where the node runs in a plain "
                "program of rclpy, that ended: an exception left one of its callbacks.",
            )


def _of_waits(waits: list[str]) -> str:
    """Return a sentence on callbacks that wait by the wall clock, to add; empty if none does."""
    return f" A callback waits on the wall clock in {waits[0].rstrip('.')}." if waits else ""
