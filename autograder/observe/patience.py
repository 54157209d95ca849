"""How long an examiner waits for what a wrong design may never do.

An examiner that waits for an answer must allow for a busy machine, and so waits for long if none
comes. But while every thread of both processes sleeps, nobody is at work on the answer, and the
machine is not what delays it: only a timer or DDS may still bring it. So such time is counted by
itself, and little of it is enough.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Protocol

from autograder.observe.stillness import Stillness
from course.errors import WaitTimeout

SETTLE_S = 8.0
"""Seconds that something expected may take: discovery takes 0.3 s, on a busy machine a few."""
IDLE_S = 3.2
"""Seconds of these in which all sleep: a reliable writer of Fast DDS says every 3 s what it has, so
that a loss is repaired; a slower timer is none that anything of the tasks could wait for."""
_LOOK_S = 0.05  # between two looks at the threads
_AT_FIRST_S = 0.25  # before the first look: what comes, comes within that time as a rule
_CLIP_S = 0.2  # that may count between two looks: an examiner that was late itself saw nothing


class Waits(Protocol):
    """A session, or whatever else tells when a callback of its nodes has ended."""

    def until(self, condition: Callable[[], Any], timeout: float, what: str) -> Any:
        """Return the first true value of ``condition``; raise `WaitTimeout` if none is in time."""


class Patience:
    """Lasts for ``seconds``, or until all threads have slept for ``idle`` s of them."""

    def __init__(self, still: Stillness, seconds: float = SETTLE_S, idle: float = IDLE_S) -> None:
        """Begin now."""
        self._still = still
        self._began = time.monotonic()
        self._end = self._began + seconds
        self._idle = idle * still.patience
        self._looked: float | None = None  # when all slept at the last look, else None

    @property
    def seconds_left(self) -> float:
        """Seconds left if nobody sleeps, not below 0."""
        return max(0.0, self._end - time.monotonic())

    @property
    def seconds_spent(self) -> float:
        """Seconds since it began."""
        return time.monotonic() - self._began

    def has_time_left(self) -> bool:
        """Whether there is some left; to be asked again and again, as it looks who sleeps."""
        now = time.monotonic()
        asleep = self._still.all_asleep()
        if asleep and self._looked is not None:
            self._idle -= min(now - self._looked, _CLIP_S)
        self._looked = now if asleep else None
        return self._idle > 0 and now < self._end

    def wait(self, session: Waits, condition: Callable[[], Any]) -> bool:
        """Wait until ``condition`` holds; return whether it did before the patience was over."""
        if condition():  # before the first look, which costs as much as many a wait
            return True
        if self.has_time_left() and _is_met_within(
            session, condition, min(_AT_FIRST_S, self.seconds_left)
        ):
            return True
        while self.has_time_left():
            if _is_met_within(session, condition, min(_LOOK_S, self.seconds_left)):
                return True
        return bool(condition())


def _is_met_within(session: Waits, condition: Callable[[], Any], seconds: float) -> bool:
    with suppress(WaitTimeout):
        session.until(condition, timeout=seconds, what="an observation")
        return True
    return False
