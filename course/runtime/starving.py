"""Deadlines that are fair on a busy machine: what other programs take of the time does not count.

The kernel counts for how long each thread was ready to run and did not (proc(5): `schedstat`).
"""

from __future__ import annotations

import os
import time

_LONGEST = 2  # times its length by which a deadline can be put off
_SHORTEST = 0.1  # s by which it is worth it


def kept_waiting(task: int | str = "thread-self") -> float:
    """Return for how many s a task was ready and got no processor.

    Args:
        task: a thread's id, or a process's for that of its first thread; the calling thread.

    Returns:
        0 for a task that has ended, and where the kernel does not count (CONFIG_SCHED_INFO).
    """
    try:
        # Once in each step of simulated time, and `open` is slower.
        file = os.open(f"/proc/{task}/schedstat", os.O_RDONLY)
        try:
            return int(os.read(file, 100).split()[1]) / 1e9
        finally:
            os.close(file)
    except (OSError, IndexError):
        return 0.0


class FairDeadline:
    """A point in time that is put off, up to a limit, while others keep a task from running."""

    def __init__(self, timeout: float, task: int | str = "thread-self") -> None:
        """Set it `timeout` s from now.

        Args:
            timeout: s; with what is added it becomes three times as long at most.
            task: whose time it is; see `kept_waiting`.
        """
        self._task = task
        self._end = time.monotonic() + timeout
        self._before = kept_waiting(task)
        self._most = _LONGEST * timeout
        self._added = 0.0

    @property
    def left(self) -> float:
        """Seconds left, not below 0."""
        if (left := self._end - time.monotonic()) <= 0:
            more = min(kept_waiting(self._task) - self._before, self._most) - self._added
            if more >= _SHORTEST:
                self._added += more
                self._end += more
                left = self._end - time.monotonic()
        return max(0.0, left)
