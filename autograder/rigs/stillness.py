"""Proof that nothing is under way between the examiner and a subject, taken from the kernel.

"It did not publish" must not rest on a short wait. When every thread of both processes sleeps, and
none has run between two looks, then every message that was sent has been dealt with: what has not
happened now does not happen until something new comes in, or time moves on.
"""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Mapping
from pathlib import Path

RESTLESS = 0.25  # s; a subject with a thread that polls is never still: then this is the pause
_NAP = 0.0005  # s between two looks

Look = Mapping[tuple[int, int], str]
"""How often each thread of each process has run, by process and thread id."""


class Stillness:
    """Watches the threads of the examiner's own process and of the subject's."""

    def __init__(self, subject_pid: int) -> None:
        """Watch both."""
        self._pids = (subject_pid, os.getpid())
        self._nap = threading.Event()  # never set

    def reached(self, timeout: float = RESTLESS) -> bool:
        """Return once both processes are at rest, or after ``timeout`` s; say which it was."""
        deadline = time.monotonic() + timeout
        before = self._look()
        while True:
            now = self._look()
            if now is not None and now == before:
                return True
            if time.monotonic() >= deadline:
                return False
            before = now
            if now is None:
                self._nap.wait(_NAP)

    def _look(self) -> Look | None:
        """Return how often each thread has run, or None if one of them runs."""
        me = threading.get_native_id()
        found: dict[tuple[int, int], str] = {}
        for pid in self._pids:
            for task in _tasks(pid):
                if int(task.name) == me:
                    continue
                runs = _runs(task)
                if runs is None:
                    return None
                found[pid, int(task.name)] = runs
        return found


def _tasks(pid: int) -> list[Path]:
    try:
        return list(Path(f"/proc/{pid}/task").iterdir())
    except OSError:  # it has ended, or is not to be seen: then the examiner's own must do
        return []


def _runs(task: Path) -> str | None:
    """Return a thread's count of context switches, or None if it is not asleep (proc(5))."""
    try:
        status = (task / "status").read_text(encoding="ascii", errors="replace")
    except OSError:  # it has just ended
        return None
    state = status.partition("\nState:\t")[2][:1]
    return status[status.index("voluntary_ctxt") :] if state in "SI" else None
