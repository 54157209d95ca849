"""Watches all processes of one sandbox from outside, and ends them when they use too much."""

from __future__ import annotations

import os
import signal
import threading
import time
from contextlib import suppress

from autograder.processes.descriptors import readable_descriptors
from autograder.sandbox.confinement import visible_files
from autograder.sandbox.resource_limits import MIB, Limits
from autograder.sandbox.resources import proc_folder
from autograder.sandbox.resources.proc_folder import ProcFolder

PERIOD_S = 0.1
"""Seconds between two looks: memory can grow by some 100 MB in that time."""
MAX_PERIOD_S = 0.5
"""Seconds that one look may stand for: on a busy machine the next one can come late."""
COUNTED = 5
"""Once in so many looks it is counted who is busy, however little they get of a busy machine, and
what the kernel holds for all of them."""
TCP, UDP = ("tcp", "tcp6"), ("udp", "udp6")
"""Tables of sockets in /proc/PID/net that tell how much waits in each."""
BLIND_TIMEOUT_S = 5.0
"""Seconds that the files of a sandbox may stay unreadable before it is ended for that."""


class SandboxProcesses:
    """For how long there have been more than so many at a time, on balance."""

    def __init__(self, most: int, longest: float) -> None:
        """Let there be more than ``most`` for ``longest`` s."""
        self.most, self._longest = most, longest
        self.seconds = 0.0

    def has_lasted(self, number: int, passed: float) -> bool:
        """Count that there were ``number`` for ``passed`` s; return if it has been too long."""
        self.seconds = max(0.0, self.seconds + (passed if number > self.most else -passed))
        return self.seconds > self._longest


class ResourceWatch:
    """Adds up what the processes of a namespace use; kills its first process if it is too much.

    A sandbox that is not complete yet has the machine's own files, its process list among them.
    """

    def __init__(self, init: int, handle: int, limits: Limits) -> None:
        """Watch the namespace whose process 1 is ``init``, as seen from here, with a pidfd."""
        self._handle = handle
        self._proc = f"/proc/{init}/root/proc"  # the sandbox's own view: only its processes
        self._root, self._net = f"/proc/{init}/root", f"/proc/{init}/net"
        self._limits = limits
        self._started = time.monotonic()
        self._over = threading.Event()
        self._used = self._gone = 0.0
        self._busy = SandboxProcesses(limits.busy, limits.crowd)
        self._busy_processes = SandboxProcesses(limits.busy_processes, limits.crowd_of_processes)
        self._queued = 0  # bytes in sockets
        self._own: dict[str, float] = {}
        self._looked, self._looks = self._started, 0
        self._blind_since: float | None = None
        self.reason = ""
        self.failed = False  # what was wrong was the watch, not what it saw
        self._thread = threading.Thread(
            target=self._watch_sandbox, name="sandbox watch", daemon=True
        )
        self._thread.start()

    def stop(self) -> None:
        """Watch no more."""
        self._over.set()
        self._thread.join()

    def cpu_seconds(self) -> float:
        """Return the processor time, in s, of all that were there when it looked."""
        return self._used

    def _watch_sandbox(self) -> None:
        while not self._over.wait(PERIOD_S) and not self._has_ended():
            try:
                self.reason = self._excess()
            except Exception as error:  # noqa: BLE001 - whatever it is, nothing runs unwatched
                self._note_error(error)
            else:
                self._blind_since = None
            if self.reason:
                with suppress(ProcessLookupError):
                    signal.pidfd_send_signal(self._handle, signal.SIGKILL)
                return

    def _has_ended(self) -> bool:
        return bool(readable_descriptors([self._handle], 0))

    def _note_error(self, error: Exception) -> None:
        """End a sandbox that cannot be looked into: at once, or if files of it stay unreadable."""
        now = time.monotonic()
        self._blind_since = self._blind_since or now
        # While a sandbox is made or ends, files are missing or another's for a moment.
        if isinstance(error, OSError) and now - self._blind_since < BLIND_TIMEOUT_S:
            return
        if not self._has_ended():
            self.failed = True
            self.reason = f"the grader could not see what it used ({type(error).__name__}: {error})"

    def _excess(self) -> str:
        """Return what is used too much of, as a phrase, or an empty string."""
        if time.monotonic() - self._started > self._limits.wall:
            return f"it ran for more than {self._limits.wall} s"
        with suppress(FileNotFoundError):
            os.stat(f"{self._proc}/self")  # noqa: PTH116
            return ""  # a sandbox's /proc has no number for us: this is still the machine's
        processes = self._process_folders()
        if len(processes) > self._limits.processes:
            return self._too_many
        found = [
            process
            for entry in processes
            if (process := proc_folder.read_process(entry)) is not None
        ]
        return self._work_excess(found) or self._held(found)

    def _process_folders(self) -> list[str]:
        names = os.listdir(self._proc)  # noqa: PTH208
        return [f"{self._proc}/{name}" for name in names if name.isdecimal()]

    @property
    def _too_many(self) -> str:
        return f"it started more than {self._limits.processes} processes"

    def _work_excess(self, processes: list[ProcFolder]) -> str:
        used = self._count_cpu_seconds(processes)
        grew, self._used = used - self._used, used
        now = time.monotonic()
        passed, self._looked = min(now - self._looked, MAX_PERIOD_S), now
        self._looks += 1
        if used > self._limits.cpu:
            return f"it used more than {self._limits.cpu} s of processor time"
        # Counting costs a little: one that hardly works, as most do, has seldom a crowd.
        crowded = self._busy.seconds > 0 or self._busy_processes.seconds > 0
        worth = grew > passed / 2 or crowded or self._looks % COUNTED == 0
        busy = (
            [number for process in processes if (number := process.count_busy_threads())]
            if worth
            else []
        )
        if self._busy.has_lasted(sum(busy), passed):
            return f"it kept more than {self._busy.most} processes and threads busy at a time"
        if self._busy_processes.has_lasted(len(busy), passed):
            return f"it kept more than {self._busy_processes.most} processes busy at a time"
        return ""

    def _count_cpu_seconds(self, processes: list[ProcFolder]) -> float:
        """Return the processor time of all that are there and of all that have ended.

        What a child has used is its parent's once that has waited for it. Of one that nobody waits
        for, what it had used when it was last seen counts.
        """
        own = {process.folder: process.own for process in processes}
        for folder, seconds in self._own.items():
            if own.get(folder, -1.0) < seconds:  # ended, or another one has its number
                self._gone += seconds
        self._own = own
        by_parents = sum(process.cpu for process in processes)
        return max(self._used, by_parents, sum(own.values()) + self._gone)

    def _held(self, processes: list[ProcFolder]) -> str:
        if sum(map(proc_folder.count_descriptors, processes)) > self._limits.all_files:
            return f"its processes had more than {self._limits.all_files} files open"
        if self._looks % COUNTED == 0 and (reason := self._kept_by_kernel()):
            return reason
        memory = [proc_folder.measure_memory(process) for process in processes]
        kernel = self._queued + sum(tables for _, tables in memory)
        # Cheap first: this counts what forked processes share once for each of them.
        if kernel + sum(anonymous for anonymous, _ in memory) <= self._limits.memory:
            return ""
        held = kernel
        for process in processes:
            # One that forks all the time keeps this watcher waiting, while others become many.
            held += proc_folder.memory_share(process)
            if len(self._process_folders()) > self._limits.processes:
                return self._too_many
        if held > self._limits.memory:
            return f"it held more than {self._limits.memory // MIB} MB of memory"
        return ""

    def _kept_by_kernel(self) -> str:
        """Count what is in no process's own account: empty files, locks, and what sockets hold."""
        own = set()
        for scratch in visible_files.SCRATCH:
            with suppress(OSError):
                place = f"{self._root}{scratch}"
                room, device = os.statvfs(place), os.stat(place).st_dev  # noqa: PTH116
                own.add((os.major(device), os.minor(device)))
                if room.f_files - room.f_ffree > self._limits.inodes:
                    return f"it had more than {self._limits.inodes} files in {scratch}"
        locked = proc_folder.locked_devices(f"{self._proc}/locks")
        if len(locked) > self._limits.locks:
            return f"it held more than {self._limits.locks} locks on files"
        if own and set(locked) - own:
            return "it held a lock on a file that is not its own, and that others may wait for"
        return "" if self._limits.sockets is None else self._in_network(self._limits.sockets)

    def _in_network(self, most: int) -> str:
        tables = (*TCP, *UDP) if proc_folder.has_connections(self._net) else UDP
        rows = [row for name in tables for row in proc_folder.read_rows(f"{self._net}/{name}")]
        self._queued = sum(map(proc_folder.queued_bytes, rows))
        if len(rows) + len(proc_folder.read_rows(f"{self._net}/unix")) > most:
            return f"there were more than {most} sockets in its network"
        return ""
