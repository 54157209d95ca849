"""Proof that nothing is under way between the examiner and a subject, taken from the kernel.

"It did not publish" must not rest on a short wait. When every thread of both processes sleeps, and
none has run between two looks, then every message that was sent has been dealt with: what has not
happened now does not happen until something new comes in, or time moves on.

A thread that computes for ever must not cost the patience for it again and again, or an exam would
not end in its time. Once it has shown what it is, the others' rest is what counts.
"""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from autograder.processes.fair_deadline import run_times
from autograder.processes.process_folders import Processes

RESTLESS_S = 0.25
"""Seconds of activity after which a subject counts as one that is never still: a thread polls."""
HANGS_S = 5.0
"""Seconds of wall time after which it is not waited for in any case."""
ENDLESS_S = 3.0
"""Seconds of computing by which a thread keeps a row of rests from being reached, until it is known
to compute for ever. A callback that takes as long has failed the exam by then."""
QUIET_S = 0.02
"""Seconds for which all others must have slept beside such a thread: one that waits for the
interpreter's lock, which it holds, also sleeps, but wakes up to ask for it every 5 ms."""
_ASLEEP = (b"S", b"I", b"t", b"Z", b"X")
"""States of proc(5). Those of a thread that is held (see `holding`), and of one that has ended and
is still there for its parent, are none in which it could go on."""
_NAP_S = 0.0005  # s between two looks
_CLIP_S = 0.005  # s that one look may count for

Task = tuple[str, int]
"""A process, by its folder in proc(5), and one of its threads."""


class KernelSample(NamedTuple):
    """How often each thread has run, if all were asleep; else one that was not."""

    runs: Mapping[Task, bytes]
    awake: Task | None = None


class KernelStillness:
    """Watches the threads of the examiner and of the subject."""

    def __init__(self, *watched: Processes) -> None:
        """Watch all these processes; the thread that asks does not count."""
        self._watched = watched
        self._nap = threading.Event()  # never set
        self._open: dict[Task, _Thread] = {}
        self._listed: dict[str, frozenset[Task]] = {}  # by process; see `_list_tasks`
        self._suspect: Task | None = None  # was awake last, and so may well be again
        self._restless: dict[Task, float] = {}  # s of computing in the last rests, none reached
        self._endless: set[Task] = set()  # have done so for ENDLESS_S s

    def wait_for_rest(self, restless: float = RESTLESS_S, timeout: float = HANGS_S) -> bool:
        """Return once both processes are at rest, or prove to be restless; say which it was.

        They are restless if a thread has computed, or slept and woken again, for ``restless`` s. A
        thread that is kept from running by other processes does neither: it is waited for, but not
        longer than ``timeout`` s. One that has computed through one rest after another, for
        ENDLESS_S s in all, does not count until it is found asleep.
        """
        deadline = time.monotonic() + timeout
        unrest = _Unrest()
        asleep = {task: self._runs_of(task) for task in self._endless}
        before, looked = self._look_once(), time.monotonic()
        since = looked  # when a thread was last seen to have run
        while True:
            now, moment = self._look_once(), time.monotonic()
            if now.awake is not None or now != before:
                since = moment
                unrest.add_look(now.awake, moment - looked)
            elif not self._endless or moment - since >= QUIET_S:
                self._reset_restless(asleep)
                return True
            if unrest.spent >= restless or moment >= deadline:
                self._note_restless(unrest.worked, restless / 2)
                return False
            if now.awake is not None or self._endless:
                self._nap.wait(_NAP_S)
            before, looked = now, moment

    def all_asleep(self) -> bool:
        """Return whether every thread of both sleeps just now; one that never does not count.

        An examiner that asks for this has yet to fall asleep over it: so a second look decides.
        """
        if self._look_once().awake is None:
            return True
        self._nap.wait(_NAP_S)
        return self._look_once().awake is None

    def _note_restless(self, worked: Mapping[Task, float], most: float) -> None:
        """Note who has computed for the larger part of a rest that was not reached."""
        row = {t: s + self._restless.get(t, 0.0) for t, s in worked.items() if s >= most}
        self._endless |= {task for task, seconds in row.items() if seconds >= ENDLESS_S}
        self._restless, self._suspect = row, None

    def _reset_restless(self, asleep: Mapping[Task, bytes | None]) -> None:
        """Begin a new row of rests; let those count again that slept through this one."""
        self._restless = {}
        self._endless -= {t for t, runs in asleep.items() if runs and runs == self._runs_of(t)}

    def _look_once(self) -> KernelSample:
        if self._suspect in self._open and self._runs_of(self._suspect) is None:
            return KernelSample({}, self._suspect)
        self._suspect = None
        mine = f"/proc/{os.getpid()}", threading.get_native_id()
        folders = {folder for watched in self._watched for folder in watched.list_folders()}
        for gone in self._listed.keys() - folders:
            del self._listed[gone]
        tasks = frozenset().union(*map(self._list_tasks, folders)) - {mine}
        for ended in self._open.keys() - tasks:
            del self._open[ended]
        self._endless &= tasks
        found: dict[Task, bytes] = {}
        for task in tasks - self._endless:
            runs = self._runs_of(task)
            if runs is None:
                self._suspect = task
                return KernelSample({}, task)
            found[task] = runs
        return KernelSample(found)

    def _runs_of(self, task: Task) -> bytes | None:
        """Return what a thread's runs change, or None if it is not asleep."""
        try:
            if task not in self._open:
                self._open[task] = _Thread(task)
            return self._open[task].read_runs()
        except OSError:  # it has just ended; another may get its number
            self._open.pop(task, None)
            self._listed.pop(task[0], None)
            return None

    def _list_tasks(self, process: str) -> frozenset[Task]:
        """Return a process's threads, which are listed again only if there must be others.

        If as many as were listed are there, and each of these is then found to be there, they are
        the same: to count them, by the links to the folder, takes a tenth of the time.
        """
        folder = f"{process}/task"
        try:
            listed = self._listed.get(process, frozenset())
            if len(listed) != os.stat(folder).st_nlink - 2:  # noqa: PTH116 - pathlib takes longer
                with os.scandir(folder) as tasks:
                    listed = frozenset((process, int(task.name)) for task in tasks)
                self._listed[process] = listed
        except OSError:  # it has ended, or is not to be seen: then the examiner's own must do
            self._listed.pop(process, None)
            return frozenset()
        return listed


class _Unrest:
    """What keeps one rest from being reached, in s: ``spent`` in all, ``worked`` by each thread."""

    def __init__(self) -> None:
        self.spent = 0.0
        self.worked: dict[Task, float] = {}
        self._totals: dict[Task, float] = {}

    def add_look(self, awake: Task | None, elapsed: float) -> None:
        """Count what a thread has computed, or ``elapsed`` s if all slept, but one had run."""
        if awake is None:
            self.spent += min(elapsed, _CLIP_S)
        elif (total := _computed_seconds(awake)) is None:
            self._totals.pop(awake, None)
        else:
            more = max(0.0, total - self._totals.get(awake, total))
            self._totals[awake] = total
            self.worked[awake] = self.worked.get(awake, 0.0) + more
            self.spent += more


class _Thread:
    """What the kernel says of a thread (proc(5)); kept open, as it is looked at very often."""

    def __init__(self, task: Task) -> None:
        folder = "{}/task/{}".format(*task)
        self._files = [os.open(f"{folder}/stat", os.O_RDONLY)]  # closed if the next one fails
        self._files.append(os.open(f"{folder}/{_COUNTS}", os.O_RDONLY))

    def __del__(self) -> None:
        for file in getattr(self, "_files", ()):
            os.close(file)

    def read_runs(self) -> bytes | None:
        """Return what changes whenever it stops running, or None if it is not asleep."""
        stat, counts = self._files
        state = os.pread(stat, 1024, 0).rpartition(b") ")[2][:1]  # its name may hold anything
        if state not in _ASLEEP:
            return None
        found = os.pread(counts, 8192, 0)
        return found if _COUNTS == "schedstat" else found[found.index(b"voluntary_ctxt") :]


def _counting_file() -> str:
    """Return the file of proc(5) that counts a thread's runs.

    A tenth of the text of ``status``, schedstat tells to the nanosecond for how long it has run,
    if the kernel keeps account of it (CONFIG_SCHED_INFO).
    """
    with suppress(OSError, ValueError):
        if run_times("/proc/thread-self")[0]:
            return "schedstat"
    return "status"


_COUNTS = _counting_file()


def _computed_seconds(task: Task) -> float | None:
    """Return for how many s a thread has computed, by the wall's clock if the kernel keeps none.

    None: it has ended since it was looked at.
    """
    folder = "{}/task/{}".format(*task)
    try:
        return run_times(folder)[0]
    except (OSError, ValueError):
        return time.monotonic() if Path(folder).exists() else None
