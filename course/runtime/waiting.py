"""Waiting for a condition, with a deadline, woken by what callbacks do."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")

_LONGEST_NAP = 0.02  # s. Not every condition changes in a callback: look at it this often at least.


class Pulse:
    """Counts finished callbacks and wakes those who wait for the next one.

    `beat` is on the path of every callback, so it takes no lock unless somebody waits.
    """

    def __init__(self) -> None:
        """Start at 0."""
        self.count = 0
        self._waiting = 0
        self._condition = threading.Condition()

    def beat(self) -> None:
        """Tell everyone who waits that something may have changed."""
        self.count += 1
        if self._waiting:
            with self._condition:
                self._condition.notify_all()

    def wait(self, seen: int, timeout: float) -> None:
        """Return when `count` is no longer `seen`, or after `timeout` seconds."""
        with self._condition:
            self._waiting += 1
            try:
                if self.count == seen:
                    self._condition.wait(timeout)
            finally:
                self._waiting -= 1


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
