"""Let executors come to rest: run what is ready, and all that follows from it, then return."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Iterator, Sequence

from course.runtime.executor import BackgroundExecutor

_NAP = 0.0005  # s between looks at callbacks that run in other threads


@contextlib.contextmanager
def all_held(executors: Sequence[BackgroundExecutor]) -> Iterator[None]:
    """Hold every executor; see `BackgroundExecutor.held`."""
    with contextlib.ExitStack() as stack:
        for executor in executors:
            stack.enter_context(executor.held())
        yield


def settle(executors: Sequence[BackgroundExecutor], timeout: float = 5.0) -> bool:
    """Return True once nothing is ready anywhere and no callback runs, False after `timeout` s.

    Called from a callback of one of the executors it cannot work, and returns False.
    """
    if any(executor.owns(threading.current_thread()) for executor in executors):
        return False
    with all_held(executors):
        return come_to_rest(executors, timeout)


def come_to_rest(executors: Sequence[BackgroundExecutor], timeout: float) -> bool:
    """Do the work of `settle` on executors that are held already."""
    deadline = time.monotonic() + timeout
    idle = 0
    while True:
        if running := [executor for executor in executors if executor.busy()]:
            running[0].wait_for_a_job(_NAP)
            idle = 0
        else:
            progress = [executor.run_ready() for executor in executors]
            idle = 0 if any(progress) else idle + 1
            # A coroutine that goes on may let another one go on, which only a further round shows.
            if idle > sum(executor.awaiting for executor in executors) and _nothing_runs(executors):
                return True
        if time.monotonic() >= deadline:
            return False


def _nothing_runs(executors: Sequence[BackgroundExecutor]) -> bool:
    """Return whether each callback that has begun is done, or is blocked and remains so."""
    if not any(executor.running for executor in executors):
        return True
    # What this round has set off may have woken it: let it show.
    executors[0].wait_for_a_job(_NAP)
    return not any(executor.busy() for executor in executors)
