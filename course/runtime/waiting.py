"""Waiting for a condition, with a deadline, woken by what callbacks do."""

from __future__ import annotations

import contextlib
import itertools
import queue
import time
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")

_LONGEST_NAP = 0.02  # s. Not every condition changes in a callback: look at it this often at least.


class Pulse:
    """Wakes those who wait for the next change: mostly, for a callback to end.

    `beat` is on the path of every callback, so it does next to nothing unless somebody waits. Each
    who waits has a queue: that may be interrupted anywhere. A `threading.Condition` may not; Ctrl-C
    at the wrong moment makes it release a lock that it does not hold, and raise for that.

    Attributes:
        count: another number after each beat, and never an earlier one again.
    """

    def __init__(self) -> None:
        """Start at 0."""
        self.count = 0
        self._numbers = itertools.count(1)
        self._waiting: list[queue.SimpleQueue[None]] = []

    def beat(self) -> None:
        """Tell everyone who waits that something may have changed; from a signal handler, too."""
        self.count = next(self._numbers)  # in one step, where += would lose some
        while self._waiting:
            with contextlib.suppress(IndexError):  # another thread has woken the last of them
                self._waiting.pop().put(None)

    def wait(self, seen: int, timeout: float | None = None) -> None:
        """Return when `count` is no longer `seen`, or after `timeout` seconds (None: no limit)."""
        mine: queue.SimpleQueue[None] = queue.SimpleQueue()
        try:
            self._waiting.append(mine)
            if self.count == seen:
                with contextlib.suppress(queue.Empty):
                    mine.get(timeout=timeout)
        finally:
            with contextlib.suppress(ValueError):  # a beat has taken it off
                self._waiting.remove(mine)


def poll(condition: Callable[[], T], timeout: float, pulse: Pulse) -> T | None:
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
        pulse.wait(seen, min(left, _LONGEST_NAP))


class Deadline:
    """A point in time that several waits share."""

    def __init__(self, timeout: float) -> None:
        """Set it `timeout` seconds from now."""
        self.total = timeout
        self._end = time.monotonic() + timeout

    @property
    def left(self) -> float:
        """Seconds left, not below 0."""
        return max(0.0, self._end - time.monotonic())
