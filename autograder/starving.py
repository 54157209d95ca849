"""Deadlines that are fair on a busy machine: what other programs take of the time does not count.

The kernel counts for how long each thread was ready to run and did not (proc(5): `schedstat`). Of a
process its first thread counts, which runs a notebook's cells and answers an examiner. Sleeping is
not being kept: whoever sleeps for too long is found after the same time on any machine.
"""

from __future__ import annotations

import os
import time
from contextlib import suppress

_LONGEST = 2  # times its length by which a deadline can be put off


def kept_waiting(pid: int) -> float:
    """Return for how many s a process's first thread was ready and got no processor.

    0 if the process has ended, and where the kernel does not count (CONFIG_SCHED_INFO).
    """
    with suppress(OSError, ValueError):
        return run_times(f"/proc/{pid}")[1]
    return 0.0


def run_times(folder: str) -> tuple[float, float]:
    """Return for how many s a thread has computed, and was ready and got no processor.

    Args:
        folder: the thread's in proc(5), or a process's, for its first thread.

    Raises:
        OSError: it has ended.
        ValueError: the kernel does not say.
    """
    file = os.open(f"{folder}/schedstat", os.O_RDONLY)  # asked often, and pathlib takes far longer
    try:
        worked, kept, _ = map(int, os.read(file, 64).split())
    finally:
        os.close(file)
    return worked / 1e9, kept / 1e9


class FairDeadline:
    """A point in time that is put off, up to a limit, while others keep a process from running."""

    def __init__(self, timeout: float, pid: int) -> None:
        """Set it `timeout` s from now, of the process's own; it is three times as far at most."""
        self._pid, self._timeout = pid, timeout
        self._begun, self._kept = time.monotonic(), kept_waiting(pid)

    @property
    def left(self) -> float:
        """Seconds left, not below 0."""
        left = self._timeout - (time.monotonic() - self._begun)
        if left <= 0:
            left += min(kept_waiting(self._pid) - self._kept, _LONGEST * self._timeout)
        return max(0.0, left)
