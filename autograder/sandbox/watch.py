"""Watches all processes of one sandbox from outside, and ends them when they use too much."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from autograder.sandbox.limits import MIB, Limits

PERIOD = 0.1
"""Seconds between two looks: memory can grow by some 100 MB in that time."""
CROWDED = 20
"""Looks that may find too many busy, one after the other; one that does not takes one back."""
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
        self._used, self._crowded = 0.0, 0
        self.reason = ""
        self._thread = threading.Thread(target=self._run, name="sandbox watch", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Watch no more."""
        self._over.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._over.wait(PERIOD):
            try:
                self.reason = self._excess()
            except OSError:  # it is ending, or not complete yet
                continue
            except Exception as error:  # noqa: BLE001 - nothing may run there unwatched
                self.reason = f"it could not be watched any more ({type(error).__name__}: {error})"
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
        states = [state for process in processes if (state := _state(process)) is not None]
        used = sum(state.cpu for state in states)
        if used > self._limits.cpu:
            return f"it used more than {self._limits.cpu} s of processor time"
        if self._is_crowded(states, used):
            return f"it kept more than {self._limits.busy} processes and threads busy"
        # Cheap first: this counts what forked processes share once for each of them.
        if sum(map(_anonymous, processes)) > self._limits.memory and (
            sum(map(_share, processes)) > self._limits.memory
        ):
            return f"it held more than {self._limits.memory // MIB} MB of memory"
        return ""

    def _is_crowded(self, states: list[_State], used: float) -> bool:
        """Whether it has long wanted more processors than others can spare beside it."""
        grew, self._used = used - self._used, used
        idle = grew < PERIOD / 2  # the usual case, in which nothing need be counted
        crowd = not idle and sum(state.busy() for state in states) > self._limits.busy
        self._crowded = self._crowded + 1 if crowd else max(0, self._crowded - 1)
        return self._crowded > CROWDED


@dataclass(frozen=True)
class _State:
    """What the kernel says of a process: ``cpu`` is in s, that of its ended children included."""

    process: Path
    runs: bool
    cpu: float
    threads: int

    def busy(self) -> int:
        """Return how many of its threads want a processor now."""
        if self.threads == 1:
            return int(self.runs)
        return sum(_fields(thread)[:1] == [b"R"] for thread in self._threads())

    def _threads(self) -> Iterator[Path]:
        with suppress(OSError):
            yield from (self.process / "task").iterdir()


def _state(process: Path) -> _State | None:
    fields = _fields(process)
    if not fields:
        return None
    cpu = sum(map(int, fields[11:15])) / _TICK
    return _State(process, fields[0] == b"R", cpu, int(fields[17]))


def _fields(process: Path) -> list[bytes]:
    """Return what stands behind the name in a ``stat``: the name may be any bytes at all."""
    with suppress(OSError):
        return (process / "stat").read_bytes().rpartition(b")")[2].split()
    return []


def _anonymous(process: Path) -> int:
    with suppress(OSError):
        _, resident, shared = (process / "statm").read_bytes().split()[:3]
        return (int(resident) - int(shared)) * _PAGE
    return 0


def _share(process: Path) -> int:
    """Return a process's fair share of the memory it uses: what is shared counts in parts."""
    with suppress(OSError):
        for line in (process / "smaps_rollup").read_bytes().splitlines():
            if line.startswith(b"Pss_Anon:"):
                return int(line.split()[1]) * 1024
    return 0
