"""Watches all processes of one sandbox from outside, and ends them when they use too much."""

from __future__ import annotations

import os
import signal
import threading
import time
from contextlib import suppress
from pathlib import Path

from autograder.sandbox.limits import MIB, Limits

PERIOD = 0.1
"""Seconds between two looks: memory can grow by some 100 MB in that time."""
_PAGE = os.sysconf("SC_PAGE_SIZE")
_TICK = os.sysconf("SC_CLK_TCK")


class Watch:
    """Adds up memory and processor time of a process namespace; kills its first process.

    A sandbox that is not complete yet has the machine's own files, its process list among them.
    """

    def __init__(self, init: int, handle: int, limits: Limits) -> None:
        """Watch the namespace whose process 1 is ``init``, as seen from here, with a pidfd."""
        self._handle = handle
        self._proc = Path(f"/proc/{init}/root/proc")  # the sandbox's own view: only its processes
        self._limits = limits
        self._started = time.monotonic()
        self._over = threading.Event()
        self.reason = ""
        self._thread = threading.Thread(target=self._run, name="sandbox watch", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Watch no more."""
        self._over.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._over.wait(PERIOD):
            with suppress(OSError):
                self.reason = self._excess()
            if self.reason:
                with suppress(ProcessLookupError):
                    signal.pidfd_send_signal(self._handle, signal.SIGKILL)
                return

    def _excess(self) -> str:
        """Return what is used too much of, as a phrase, or an empty string."""
        if time.monotonic() - self._started > self._limits.wall:
            return f"it ran for more than {self._limits.wall} s"
        if (self._proc / "self").exists():
            return ""  # whoever is here has no number in there; so this is still the machine's own
        processes = [entry for entry in self._proc.iterdir() if entry.name.isdecimal()]
        if len(processes) > self._limits.processes:
            return f"it started more than {self._limits.processes} processes"
        if sum(map(_cpu_seconds, processes)) > self._limits.cpu:
            return f"it used more than {self._limits.cpu} s of processor time"
        # Cheap first: this counts what forked processes share once for each of them.
        if sum(map(_anonymous, processes)) > self._limits.memory and (
            sum(map(_share, processes)) > self._limits.memory
        ):
            return f"it held more than {self._limits.memory // MIB} MB of memory"
        return ""


def _cpu_seconds(process: Path) -> float:
    """Return the processor time of a process and of its children that have ended."""
    with suppress(OSError):
        fields = (process / "stat").read_text().rpartition(")")[2].split()
        return sum(map(int, fields[11:15])) / _TICK
    return 0.0


def _anonymous(process: Path) -> int:
    with suppress(OSError):
        _, resident, shared = (process / "statm").read_text().split()[:3]
        return (int(resident) - int(shared)) * _PAGE
    return 0


def _share(process: Path) -> int:
    """Return a process's fair share of the memory it uses: what is shared counts in parts."""
    with suppress(OSError):
        for line in (process / "smaps_rollup").read_text().splitlines():
            if line.startswith("Pss_Anon:"):
                return int(line.split()[1]) * 1024
    return 0
