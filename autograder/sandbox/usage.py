"""What one process uses, as its folder in /proc tells; nothing, once it has ended.

Read as bytes, since a process gives itself whatever name it likes.
"""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

_PAGE = os.sysconf("SC_PAGE_SIZE")
_TICK = os.sysconf("SC_CLK_TCK")


def cpu_seconds(process: Path) -> float:
    """Return the processor time of a process and of its children that have ended."""
    with suppress(OSError):
        return sum(map(int, _stat(process)[11:15])) / _TICK
    return 0.0


def threads(process: Path) -> dict[Path, bytes]:
    """Return the state of each thread (``R`` if it runs or waits for a processor), by its folder.

    What has no memory and no files any more is left out: the first thread of a process can end
    before others, and the process's own folder then shows nothing of what these hold.
    """
    states = {}
    with suppress(OSError):
        for thread in (process / "task").iterdir():
            with suppress(OSError):
                states[thread] = _stat(thread)[0]
    return {thread: state for thread, state in states.items() if state not in (b"Z", b"X")}


def descriptors(thread: Path) -> int:
    """Return the number of open file descriptors."""
    with suppress(OSError):
        return len(os.listdir(thread / "fd"))  # noqa: PTH208 - the names alone, of many
    return 0


def anonymous(thread: Path) -> int:
    """Return the bytes of memory that belong to no file."""
    with suppress(OSError):
        _, resident, shared = (thread / "statm").read_bytes().split()[:3]
        return (int(resident) - int(shared)) * _PAGE
    return 0


def share(thread: Path) -> int:
    """Return the fair share of the memory that it uses: what is shared counts in parts."""
    with suppress(OSError):
        for line in (thread / "smaps_rollup").read_bytes().splitlines():
            if line.startswith(b"Pss_Anon:"):
                return int(line.split()[1]) * 1024
    return 0


def _stat(task: Path) -> list[bytes]:
    """Return what follows the name, which can hold anything, in a task's ``stat``."""
    return (task / "stat").read_bytes().rpartition(b")")[2].split()
