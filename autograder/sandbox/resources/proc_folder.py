"""What one process uses, as its folder in /proc tells; nothing, once it has ended.

Read as bytes, since a process gives itself whatever name it likes; and by plain system calls, since
it is read ten times a second for each submission that runs, and `pathlib` takes far longer.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass

_TICK = os.sysconf("SC_CLK_TCK")
_ENDED = (b"Z", b"X")
_TCP = re.compile(rb"^TCP: inuse (\d+) .*\btw (\d+)", re.MULTILINE)
_TCP6 = re.compile(rb"^TCP6: inuse (\d+)", re.MULTILINE)


@dataclass(frozen=True)
class ProcFolder:
    """A process that has not ended.

    Attributes:
        folder: its folder in /proc.
        alive: that of a thread which has not ended: the first thread of a process can end before
            others, and the process's own folder then shows nothing of what these hold.
        own: processor time in s.
        cpu: with that of its children that have ended, and that somebody has waited for.
    """

    folder: str
    alive: str
    own: float
    cpu: float

    def count_busy_threads(self) -> int:
        """Return how many of its threads run or wait for a processor."""
        return sum(state == b"R" for _, state in _list_threads(self.folder))


def read_process(folder: str) -> ProcFolder | None:
    """Return the process whose folder in /proc this is; None if there is nothing left of it."""
    with suppress(OSError):
        state, *numbers = _read_stat(folder)
        own, cpu = (sum(map(int, numbers[10:last])) / _TICK for last in (12, 14))
        if state not in _ENDED:
            return ProcFolder(folder, folder, own, cpu)
        for thread, of_thread in _list_threads(folder):
            if of_thread not in _ENDED:
                return ProcFolder(folder, thread, own, cpu)
    return None


def _list_threads(folder: str) -> Iterator[tuple[str, bytes]]:
    with suppress(OSError):
        for name in os.listdir(f"{folder}/task"):  # noqa: PTH208 - the names alone, of many
            thread = f"{folder}/task/{name}"
            with suppress(OSError):
                yield thread, _read_stat(thread)[0]


def count_descriptors(process: ProcFolder) -> int:
    """Return the number of open file descriptors."""
    with suppress(OSError):
        return len(os.listdir(f"{process.alive}/fd"))  # noqa: PTH208
    return 0


def measure_memory(process: ProcFolder) -> tuple[int, int]:
    """Return the bytes of memory that belong to no file, and those of the tables of its addresses.

    The latter are not in what it holds otherwise.
    """
    with suppress(OSError, IndexError):
        status = read_content(f"{process.alive}/status")
        anonymous, tables = (
            int(status.partition(name)[2].split(maxsplit=1)[0]) * 1024
            for name in (b"\nRssAnon:", b"\nVmPTE:")
        )
        return anonymous, tables
    return 0, 0


def read_rows(table: str) -> list[bytes]:
    """Return the rows of a table in /proc/PID/net, without its heading."""
    with suppress(OSError):
        return read_content(table).splitlines()[1:]
    return []


def locked_devices(table: str) -> list[tuple[int, int]]:
    """Return the device of each file that a process in a namespace has locked, one a lock.

    Those without an owner, which a sandbox cannot have, are shown in every namespace.
    """
    found = []
    with suppress(OSError):
        for row in read_content(table).splitlines():
            with suppress(ValueError, IndexError):
                # 1: POSIX  ADVISORY  WRITE 7 00:4f:5 0 EOF; who waits for one has a -> behind 1:
                owner, place = row.replace(b" -> ", b" ").split()[4:6]
                major, minor, _ = place.split(b":")
                if int(owner) > 0:
                    found.append((int(major, 16), int(minor, 16)))
    return found


def has_connections(net: str) -> bool:
    """Whether there are TCP sockets, listening or closing ones too, in a network's folder in /proc.

    To write down those of one network, the kernel looks through the machine's, for milliseconds;
    how many there are it knows. Where it does not say, there may be some.
    """
    with suppress(OSError):
        counts = (
            _TCP.search(read_content(f"{net}/sockstat")),
            _TCP6.search(read_content(f"{net}/sockstat6")),
        )
        return any(found is None or any(map(int, found.groups())) for found in counts)
    return True


def queued_bytes(row: bytes) -> int:
    """Return the bytes that wait in an internet socket, by its row in /proc/net."""
    with suppress(IndexError, ValueError):
        out, _, into = row.split()[4].partition(b":")
        return int(out, 16) + int(into, 16)
    return 0


def memory_share(process: ProcFolder) -> int:
    """Return the fair share of the memory that it uses: what is shared counts in parts."""
    with suppress(OSError):
        for line in read_content(f"{process.alive}/smaps_rollup").splitlines():
            if line.startswith(b"Pss_Anon:"):
                return int(line.split()[1]) * 1024
    return 0


def read_content(path: str) -> bytes:
    """Return what stands in a file of /proc.

    Raises:
        OSError: it is not there, or not any more.
    """
    file, parts = os.open(path, os.O_RDONLY), []
    try:
        while part := os.read(file, 1 << 16):
            parts.append(part)
    finally:
        os.close(file)
    return b"".join(parts)


def _read_stat(task: str) -> list[bytes]:
    """Return what follows the name, which can hold anything, in a task's ``stat``."""
    return read_content(f"{task}/stat").rpartition(b")")[2].split()
