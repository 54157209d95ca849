"""Callbacks that wait by the wall clock, while the node's time stands still.

How much simulated time such a wait takes depends on the machine, and so would every observation
after it. In a student's own notebook the subject says so of its callbacks. Where the network is the
submission's alone, it is seen from outside: a thread that waits by the wall clock is in a system
call with a time in it, be it `time.sleep`, an event with a time-out or `wait_for_service`; one that
waits for the node's clock, or for another callback, is not.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple

from autograder.examination.check_context import CheckContext

NAP_S = 0.1
"""Seconds of wall time that a thread may nap between two looks at the node's clock."""
SAME_S = 0.02
"""Seconds by which two looks may differ in when a sleep ends."""


class Sleep(NamedTuple):
    """A thread that sleeps ``until`` a time as of time.monotonic(), if nothing wakes it before."""

    thread: int
    until: float
    to_the_end: bool
    """Nothing can: see `autograder.processes.outside.sleeping`."""


def describe_waits(waits: list[str]) -> str:
    """Return a sentence on callbacks that wait by the wall clock; empty if none does.

    Example:
        >>> describe_waits(["Asker.ask of /asker (at line 7: sleep(1))"])
        'A callback waits on the wall clock in Asker.ask of /asker (at line 7: sleep(1)).'
    """
    return f"A callback waits on the wall clock in {waits[0].rstrip('.')}." if waits else ""


def is_same_sleep(before: Sleep, later: list[Sleep]) -> bool:
    """Return whether a thread still sleeps as it did before: it has not woken in between."""
    return any(
        sleep.thread == before.thread and abs(sleep.until - before.until) < SAME_S
        for sleep in later
    )


class WallWaitWatch:
    """Looks at the threads of the student's session, which are there before its nodes are.

    Threads of the student's own may wait as they like: only those of the session run callbacks.
    """

    def __init__(self, bench: CheckContext, wait: Callable[[float], object]) -> None:
        """Note which threads the session has; ``wait`` lets so many s of wall time pass."""
        self._bench, self._wait = bench, wait
        self._threads = frozenset[int]()
        if bench.outside.own_network:
            threads = [*map(int, bench.outside.ask("threads"))]
            asleep = bench.outside.ask("sleepers", threads=threads)
            self._threads = frozenset(threads) - {int(thread) for thread, _, _ in asleep}

    @property
    def sees_from_outside(self) -> bool:
        """Whether it sees the threads by itself, and need not ask the subject."""
        return bool(self._bench.outside.own_network)

    def find_wait(self) -> str:
        """Return a sentence on a callback that waits for longer than a nap; empty if none does."""
        if not self.sees_from_outside:
            return describe_waits(self._bench.subject.wall_waits())
        sleeps = [s for s in self._find_sleeps() if s.until > time.monotonic() + NAP_S]
        if not sleeps:
            return ""
        waits = self._bench.subject.wall_waits()  # now: it may be over when it is certain
        if not any(sleep.to_the_end for sleep in sleeps):
            self._wait(NAP_S)
            later = self._find_sleeps()
            if not any(is_same_sleep(sleep, later) for sleep in sleeps):
                return ""  # what wakes up at once has not waited
        told = describe_waits(waits or self._bench.subject.wall_waits())
        return told or "A callback waits on the wall clock."

    def _find_sleeps(self) -> list[Sleep]:
        now = time.monotonic()
        found = self._bench.outside.ask("sleepers", threads=[*self._threads])
        return [Sleep(int(thread), now + left, bool(sure)) for thread, left, sure in found]
