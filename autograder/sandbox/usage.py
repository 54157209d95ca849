"""What one process uses, as its folder in /proc tells; nothing, once it has ended.

Read as bytes, since a process gives itself whatever name it likes.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

_PAGE = os.sysconf("SC_PAGE_SIZE")
_TICK = os.sysconf("SC_CLK_TCK")
_ENDED = (b"Z", b"X")


@dataclass(frozen=True)
class Process:
    """A process that has not ended.

    Attributes:
        folder: its folder in /proc.
        alive: that of a thread which has not ended: the first thread of a process can end before
            others, and the process's own folder then shows nothing of what these hold.
        own: processor time in s.
        cpu: with that of its children that have ended, and that somebody has waited for.
    """

    folder: Path
    alive: Path
    own: float
    cpu: float

    def busy(self) -> int:
        """Return how many of its threads run or wait for a processor."""
        return sum(state == b"R" for _, state in _threads(self.folder))


def process(folder: Path) -> Process | None:
    """Return the process whose folder in /proc this is; None if there is nothing left of it."""
    with suppress(OSError):
        state, *numbers = _stat(folder)
        own, cpu = (sum(map(int, numbers[10:last])) / _TICK for last in (12, 14))
        if state not in _ENDED:
            return Process(folder, folder, own, cpu)
        for thread, of_thread in _threads(folder):
            if of_thread not in _ENDED:
                return Process(folder, thread, own, cpu)
    return None


def _threads(folder: Path) -> Iterator[tuple[Path, bytes]]:
    with suppress(OSError):
        for thread in (folder / "task").iterdir():
            with suppress(OSError):
                yield thread, _stat(thread)[0]


def descriptors(process: Process) -> int:
    """Return the number of open file descriptors."""
    with suppress(OSError):
        return len(os.listdir(process.alive / "fd"))  # noqa: PTH208 - the names alone, of many
    return 0


def anonymous(process: Process) -> int:
    """Return the bytes of memory that belong to no file."""
    with suppress(OSError):
        _, resident, shared = (process.alive / "statm").read_bytes().split()[:3]
        return (int(resident) - int(shared)) * _PAGE
    return 0


def page_tables(process: Process) -> int:
    """Return the bytes of the tables of its addresses, which is not in what it holds otherwise."""
    with suppress(OSError, IndexError):
        status = (process.alive / "status").read_bytes()
        return int(status.partition(b"\nVmPTE:")[2].split(maxsplit=1)[0]) * 1024
    return 0


def rows(table: Path) -> list[bytes]:
    """Return the rows of a table in /proc/PID/net, without its heading."""
    with suppress(OSError):
        return table.read_bytes().splitlines()[1:]
    return []


def locked_devices(table: Path) -> list[tuple[int, int]]:
    """Return the device of each file that a process in a namespace has locked, one a lock.

    Those without an owner, which a sandbox cannot have, are shown in every namespace.
    """
    found = []
    with suppress(OSError):
        for row in table.read_bytes().splitlines():
            with suppress(ValueError, IndexError):
                # 1: POSIX  ADVISORY  WRITE 7 00:4f:5 0 EOF; who waits for one has a -> behind 1:
                owner, place = row.replace(b" -> ", b" ").split()[4:6]
                major, minor, _ = place.split(b":")
                if int(owner) > 0:
                    found.append((int(major, 16), int(minor, 16)))
    return found


def queued(row: bytes) -> int:
    """Return the bytes that wait in an internet socket, by its row in /proc/net."""
    with suppress(IndexError, ValueError):
        out, _, into = row.split()[4].partition(b":")
        return int(out, 16) + int(into, 16)
    return 0


def share(process: Process) -> int:
    """Return the fair share of the memory that it uses: what is shared counts in parts."""
    with suppress(OSError):
        for line in (process.alive / "smaps_rollup").read_bytes().splitlines():
            if line.startswith(b"Pss_Anon:"):
                return int(line.split()[1]) * 1024
    return 0


def _stat(task: Path) -> list[bytes]:
    """Return what follows the name, which can hold anything, in a task's ``stat``."""
    return (task / "stat").read_bytes().rpartition(b")")[2].split()
