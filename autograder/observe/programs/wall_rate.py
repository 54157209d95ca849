"""The rate of messages by the machine's clock, in a plain program: a busy machine is no fault."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

from autograder.observe.lifecycle.observer import Observer
from autograder.processes.fair_deadline import FairDeadline

COUNTED = 6
"""Messages whose rate is taken."""
SLOWEST, FASTEST = 0.6, 1.6
"""Times a rate that are taken for it."""
TAKES, SLOW_TAKES = 12, 2
"""Of a rate, as messages that have been held up come many at a time; and of one that is too slow
although nothing has held it up."""
HELD_UP = 0.2
"""Part of a take's time from which on a busy machine may be why it was slow: it says nothing."""


@dataclass(frozen=True)
class Take:
    """One take of a rate: how many messages came in how many seconds, held up for how many.

    Example:
        >>> Take(came=6, seconds=0.6, held_up_s=0.0).is_about(10.0)
        True
    """

    came: int
    seconds: float
    held_up_s: float

    def is_about(self, hz: float) -> bool:
        """Whether it is about this rate."""
        return self.is_not_slow(hz) and self.came <= FASTEST * hz * self.seconds

    def is_not_slow(self, hz: float) -> bool:
        """Whether it is this rate or a higher one."""
        return self.came >= SLOWEST * hz * self.seconds

    @property
    def was_held_up(self) -> bool:
        """Whether the machine may be why it was slow."""
        return self.came >= COUNTED and self.held_up_s >= HELD_UP * self.seconds


def find_wrong_rate(observer: Observer, count: Callable[[], int], hz: float) -> Take | None:
    """Return a take of a rate if no take is about ``hz``; None also if the machine was too busy.

    Args:
        observer: someone in the network of a plain program.
        count: returns how many messages have come so far.
        hz: messages a second of wall time.
    """
    takes: list[Take] = []
    for _ in range(TAKES):
        take = _take_rate(observer, count, hz)
        if take.is_about(hz):
            return None
        takes.append(take)
        slow = [take for take in takes if not take.is_not_slow(hz)]
        if sum(not take.was_held_up for take in slow) == SLOW_TAKES:
            return take
    return None if sum(take.was_held_up for take in slow) > TAKES // 2 else take


def _take_rate(observer: Observer, count: Callable[[], int], hz: float) -> Take:
    delay = observer.outside.delay
    begun, before, mark = time.monotonic(), count(), delay.mark()
    deadline = FairDeadline(COUNTED / (SLOWEST * hz), delay)
    while (left := deadline.seconds_left) and count() < before + COUNTED and not observer.is_gone():
        observer.wait(lambda: count() >= before + COUNTED, left)
    seconds = time.monotonic() - begun
    return Take(count() - before, seconds, delay.delay_since(mark))
