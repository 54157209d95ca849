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
            else:
                total = _worked(now.awake)
                spent += max(0.0, total - worked.get(now.awake, total))
                worked[now.awake] = total
            if spent >= restless or moment >= deadline:
                return False
            if now.awake is not None:
                self._nap.wait(_NAP)
            before, looked = now, moment

    def _look(self) -> Look:
        me = threading.get_native_id()
        found: dict[Task, str] = {}
        for pid in self._pids:
            for task in _tasks(pid):
                name = pid, int(task.name)
                if name[1] == me:
                    continue
                runs = _runs(task)
                if runs is None:
                    return Look({}, name)
                found[name] = runs
        return Look(found)


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


def _worked(task: Task) -> float:
    """Return for how many s a thread has computed, by the wall's clock if the kernel keeps none."""
    try:
        text = Path("/proc/{}/task/{}/schedstat".format(*task)).read_text(encoding="ascii")
        return int(text.split()[0]) / 1e9
    except (OSError, ValueError):
        return time.monotonic()
