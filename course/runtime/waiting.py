"""Waiting for a condition, with a deadline, woken by what callbacks do."""

from __future__ import annotations

import contextlib
import itertools
import threading
import time
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")

_LONGEST_NAP_S = (
    0.02  # s. Not every condition changes in a callback: look at it this often at least.
)


class Pulse:
    """Wakes those who wait for the next change: mostly, for a callback to end.

    `beat` is on the path of every callback, so it does next to nothing unless somebody waits. Each
    thread that waits has a lock that a beat opens: that may be interrupted anywhere. A Condition
    may not: Ctrl-C at the wrong moment makes it release a lock that it does not hold, and raise for
    that. (A SimpleQueue does not do either: in Python 3.11, its `get` never returns if a short
    timeout is over before it has begun to wait.)

    Attributes:
        count: another number after each beat, and never an earlier one again.
    """

    def __init__(self) -> None:
        """Start at 0."""
        self.count = 0
        self._numbers = itertools.count(1)
        self._waiting: list[threading.Lock] = []  # of each who waits, closed

    def beat(self) -> None:
        """Tell everyone who waits that something may have changed; from a signal handler, too."""
        self.count = next(self._numbers)  # in one step, where += would lose some
        while self._waiting:
            with contextlib.suppress(IndexError):  # another thread has woken the last of them
                self._waiting.pop().release()

    def wait(self, seen: int, timeout: float = -1.0) -> None:
        """Return when `count` is no longer `seen`, or after `timeout` seconds (-1: no limit)."""
        mine = threading.Lock()
        mine.acquire()
        try:
            self._waiting.append(mine)
            if self.count == seen:
                mine.acquire(timeout=timeout)
        finally:
            with contextlib.suppress(ValueError):  # a beat has taken it off
                self._waiting.remove(mine)


def poll_condition(condition: Callable[[], T], timeout: float, pulse: Pulse) -> T | None:
    """Return the first true value of `condition`, or None after `timeout` seconds.

    The condition is looked at once more at the deadline, so a timeout of 0 asks exactly once.
    """
    deadline = time.monotonic() + timeout
    while True:
        seen = pulse.count
        if value := condition():
            return value
        left = deadline - time.monotonic()
        if left <= 0:
            return None
        pulse.wait(seen, min(left, _LONGEST_NAP_S))


class Deadline:
    """A point in time that several waits share."""

    def __init__(self, timeout: float) -> None:
        """Set it `timeout` seconds from now."""
        self.total = timeout
        self._end = time.monotonic() + timeout

    @property
    def seconds_left(self) -> float:
        """Seconds left, not below 0."""
        return max(0.0, self._end - time.monotonic())
