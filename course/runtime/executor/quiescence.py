"""Let executors come to rest: run what is ready, and all that follows from it, then return."""

from __future__ import annotations

import contextlib
import math
import threading
import time
from collections.abc import Iterator, Sequence

from course.runtime.executor.background import BackgroundExecutor

_NAP_S = 0.0005  # s between looks at callbacks that run in other threads
_ENDLESS = ((1.0, 100), (2.5, 10))
"""Seconds, and callbacks that have ended in them, after which more will follow for ever: somebody
polls in many short callbacks, as a coroutine does that sleeps a little between two awaits."""
_AGAIN = ((0.5, 10),)
"""The same, if that has been seen before: code that polled once will poll again."""
_TURN = ((0.03, 8), (0.05, 2), (0.5, 1))
"""The same, where callbacks have been found to follow each other without end a moment ago: then
each of them has had its turn, and so has everything else."""
_RECENT_S = 5.0  # s
_MAX_AGE_S = 1.0  # s that a callback may run, and be one of many


@contextlib.contextmanager
def all_held(executors: Sequence[BackgroundExecutor]) -> Iterator[None]:
    """Hold every executor; see `BackgroundExecutor.hold_still`."""
    with contextlib.ExitStack() as stack:
        for executor in executors:
            stack.enter_context(executor.hold_still())
        yield


def settle_executors(executors: Sequence[BackgroundExecutor], timeout: float = 5.0) -> bool:
    """Return True once nothing is ready anywhere and no callback runs, False after `timeout` s.

    Called from a callback of one of the executors it cannot work, and returns False.
    """
    if any(executor.has_thread(threading.current_thread()) for executor in executors):
        return False
    with all_held(executors):
        return come_to_rest(executors, timeout)


def come_to_rest(executors: Sequence[BackgroundExecutor], timeout: float) -> bool:
    """Do the work of `settle_executors` on executors that are held already.

    Callbacks that go on setting each other off, as a coroutine that polls does, are left behind
    once each has had its turn.
    """
    deadline = time.monotonic() + timeout
    chain = _Chain(executors)
    idle = 0
    while True:
        working = [(executor, job) for executor in executors for job in executor.working_jobs()]
        if working:
            # One that only looks again whether what it awaits has come is no sign of life.
            idle = idle if all(executor.is_resuming(job) for executor, job in working) else 0
            working[0][0].wait_for_a_job(_NAP_S)
        else:
            progress = [executor.run_ready() for executor in executors]
            idle = 0 if any(progress) else idle + 1
            # A coroutine that goes on may let another one go on, which only a further round shows.
            if idle > sum(executor.awaiting_count for executor in executors) and _nothing_runs(
                executors
            ):
                return True
        if chain.is_endless():
            return True
        if time.monotonic() >= deadline:
            return False


def follow_each_other(executors: Sequence[BackgroundExecutor]) -> bool:
    """Return whether callbacks were found to follow each other without end a moment ago."""
    return any(time.monotonic() - executor.endless < _RECENT_S for executor in executors)


class _Chain:
    """Callbacks that follow each other, looked at from now on."""

    def __init__(self, executors: Sequence[BackgroundExecutor]) -> None:
        self._executors = executors
        self._began = time.monotonic()
        self._ended_before = self._count_ended()
        self._signs = _TURN if follow_each_other(executors) else self._first_signs()

    def _first_signs(self) -> tuple[tuple[float, int], ...]:
        before = any(executor.endless > -math.inf for executor in self._executors)
        return _AGAIN if before else _ENDLESS

    def _count_ended(self) -> int:
        return sum(executor.finished for executor in self._executors)

    def is_endless(self) -> bool:
        """Return whether they go on and on, and none of them does so alone."""
        now = time.monotonic()
        ended = self._count_ended() - self._ended_before
        if not any(now - self._began >= s and ended >= number for s, number in self._signs):
            return False
        running = [job for executor in self._executors for job in executor.running.copy()]
        if any(now - job.since > _MAX_AGE_S for job in running):
            return False
        for executor in self._executors:
            executor.endless = now
        return True


def _nothing_runs(executors: Sequence[BackgroundExecutor]) -> bool:
    """Return whether each callback that has begun is done, or is blocked and remains so."""
    if not any(executor.running for executor in executors):
        return True
    # What this round has set off may have woken it: let it show.
    executors[0].wait_for_a_job(_NAP_S)
    return not any(executor.working_jobs() for executor in executors)
