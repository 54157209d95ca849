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
from typing import NamedTuple

RESTLESS = 0.25
"""Seconds of activity after which a subject counts as one that is never still: a thread polls."""
HANGS = 5.0
"""Seconds of wall time after which it is not waited for in any case."""
_NAP = 0.0005  # s between two looks
_CLIP = 0.005  # s that one look may count for

Task = tuple[int, int]
"""A process and one of its threads."""


class Look(NamedTuple):
    """How often each thread has run, if all were asleep; else one that was not."""

    runs: Mapping[Task, str]
    awake: Task | None = None


class Stillness:
    """Watches the threads of the examiner's own process and of the subject's."""

    def __init__(self, subject_pid: int) -> None:
        """Watch both."""
        self._pids = (subject_pid, os.getpid())
        self._nap = threading.Event()  # never set
        self._open: dict[Task, _Status] = {}
        self._suspect: Task | None = None  # who was awake last, and so may well be again

    def reached(self, restless: float = RESTLESS, timeout: float = HANGS) -> bool:
        """Return once both processes are at rest, or prove to be restless; say which it was.

        Restless is who has computed, or slept and woken again, for ``restless`` s. A thread that
        is kept from running by other processes does neither: it is waited for, but not longer
        than ``timeout`` s.
        """
        deadline = time.monotonic() + timeout
        spent, worked = 0.0, dict[Task, float]()
        before, looked = self._look(), time.monotonic()
        while True:
            now, moment = self._look(), time.monotonic()
            if now.awake is None:
                if now == before:
                    return True
                spent += min(moment - looked, _CLIP)
            elif (total := _worked(now.awake)) is None:
                worked.pop(now.awake, None)
            else:
                spent += max(0.0, total - worked.get(now.awake, total))
                worked[now.awake] = total
            if spent >= restless or moment >= deadline:
                return False
            if now.awake is not None:
                self._nap.wait(_NAP)
            before, looked = now, moment

    def _look(self) -> Look:
        if self._suspect in self._open and self._runs(self._suspect) is None:
            return Look({}, self._suspect)
        self._suspect = None
        mine = os.getpid(), threading.get_native_id()
        tasks = [task for pid in self._pids for task in _tasks(pid) if task != mine]
        for ended in self._open.keys() - tasks:
            del self._open[ended]
        found: dict[Task, str] = {}
        for task in tasks:
            runs = self._runs(task)
            if runs is None:
                self._suspect = task
                return Look({}, task)
            found[task] = runs
        return Look(found)

    def _runs(self, task: Task) -> str | None:
        """Return a thread's count of context switches, or None if it is not asleep."""
        try:
            if task not in self._open:
                self._open[task] = _Status(task)
            return self._open[task].runs()
        except OSError:  # it has just ended; another may get its number
            self._open.pop(task, None)
            return None


class _Status:
    """What the kernel says of a thread (proc(5)); kept open, as it is looked at very often."""

    def __init__(self, task: Task) -> None:
        self._file = os.open("/proc/{}/task/{}/status".format(*task), os.O_RDONLY)

    def __del__(self) -> None:
        if hasattr(self, "_file"):
            os.close(self._file)

    def runs(self) -> str | None:
        """Return its count of context switches, or None if it is not asleep."""
        status = os.pread(self._file, 8192, 0).decode("ascii", "replace")
        state = status.partition("\nState:\t")[2][:1]
        return status[status.index("voluntary_ctxt") :] if state in "SI" else None


def _tasks(pid: int) -> list[Task]:
    try:
        with os.scandir(f"/proc/{pid}/task") as tasks:
            return [(pid, int(task.name)) for task in tasks]
    except OSError:  # it has ended, or is not to be seen: then the examiner's own must do
        return []


def _worked(task: Task) -> float | None:
    """Return for how many s a thread has computed, by the wall's clock if the kernel keeps none.

    None: it has ended since it was looked at.
    """
    kept = Path("/proc/{}/task/{}/schedstat".format(*task))
    try:
        return int(kept.read_text(encoding="ascii").split()[0]) / 1e9
    except (OSError, ValueError):
        return time.monotonic() if kept.parent.exists() else None
