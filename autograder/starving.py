"""Deadlines that are fair on a busy machine: what other programs take of the time does not count.

The kernel counts for how long each thread was ready to run and did not (proc(5): `schedstat`). Of a
process its first thread counts, which runs a notebook's cells and answers an examiner. Sleeping is
not being kept: whoever sleeps for too long is found after the same time on any machine.
"""

from __future__ import annotations

import time
from contextlib import suppress
from pathlib import Path

_LONGEST = 2  # times its length by which a deadline can be put off
_SHORTEST = 0.1  # s by which it is worth it


def kept_waiting(pid: int) -> float:
    """Return for how many s a process's first thread was ready and got no processor.

    0 if the process has ended, and where the kernel does not count (CONFIG_SCHED_INFO).
    """
    with suppress(OSError, IndexError):
        return int(Path(f"/proc/{pid}/schedstat").read_bytes().split()[1]) / 1e9
    return 0.0


class FairDeadline:
    """A point in time that is put off, up to a limit, while others keep a process from running."""

    def __init__(self, timeout: float, pid: int) -> None:
        """Set it `timeout` s from now, of the process's own; it is three times as far at most."""
        self._pid = pid
        self._end = time.monotonic() + timeout
        self._before = kept_waiting(pid)
        self._most = _LONGEST * timeout
        self._added = 0.0

    @property
    def left(self) -> float:
        """Seconds left, not below 0."""
        if (left := self._end - time.monotonic()) <= 0:
            more = min(kept_waiting(self._pid) - self._before, self._most) - self._added
            if more >= _SHORTEST:
                self._added += more
                self._end += more
                left = self._end - time.monotonic()
        return max(0.0, left)
