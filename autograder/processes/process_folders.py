"""The processes that are looked at: all of a sandbox's process namespace, or just one."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Protocol


class Processes(Protocol):
    """Some processes, each known by its folder in a /proc."""

    def list_folders(self) -> list[str]:
        """Return the folders of those that are there."""

    def folder_of(self, pid: int) -> str:
        """Return the folder of one, by the number that it has for itself."""


class SingleProcess:
    """One process of this machine; its children do not count."""

    def __init__(self, pid: int) -> None:
        """Look at the process ``pid``."""
        self._folder = f"/proc/{pid}"

    def list_folders(self) -> list[str]:
        """Return its folder."""
        return [self._folder]

    def folder_of(self, pid: int) -> str:
        """Return the folder of the process, whatever number it is asked for by."""
        return self._folder


class Sandboxed:
    """All processes of a sandbox: of the process namespace that its first process is in.

    They are looked at in the sandbox's own /proc, which has none but these. It is held open, so
    that another sandbox whose processes get the same numbers is never taken for it.
    """

    def __init__(self, init: int, ours: Collection[int] = ()) -> None:
        """Look at the namespace whose first process is ``init``, as seen from here.

        ``ours`` are processes that hold the sandbox, by their numbers in it; they do not count.

        Raises:
            OSError: it has ended.
        """
        self.init = init
        self._proc = os.open(f"/proc/{init}/root/proc", os.O_RDONLY | os.O_DIRECTORY)
        self._ours = {1, *ours}

    def __del__(self) -> None:
        """Let go of its /proc."""
        if hasattr(self, "_proc"):
            os.close(self._proc)

    def inner_pids(self) -> list[int]:
        """Return the numbers in the sandbox of all that count."""
        names = os.listdir(self._proc)  # noqa: PTH208 - the names alone, and very often
        return [n for name in names if name.isdecimal() and (n := int(name)) not in self._ours]

    def list_folders(self) -> list[str]:
        """Return the folders of all that count."""
        return [self.folder_of(number) for number in self.inner_pids()]

    def folder_of(self, pid: int) -> str:
        """Return the folder of one, by the number that it has in the sandbox."""
        return f"/proc/self/fd/{self._proc}/{pid}"

    def outer_pids(self) -> list[int]:
        """Return the numbers here of all that count: what a signal or a tracer needs."""
        counting = set(self.inner_pids())
        return [pid for pid in namespace_pids(self.init) if number_inside(pid) in counting]


def namespace_pids(pid: int) -> Iterator[int]:
    """Yield the processes, by their numbers here, that are in the process namespace of ``pid``."""
    with suppress(OSError):
        namespace = os.stat(f"/proc/{pid}/ns/pid").st_ino  # noqa: PTH116 - pathlib takes longer
        for name in os.listdir("/proc"):  # noqa: PTH208
            with suppress(OSError):
                if name.isdecimal() and os.stat(f"/proc/{name}/ns/pid").st_ino == namespace:  # noqa: PTH116
                    yield int(name)


def number_inside(pid: int) -> int:
    """Return the number that a process has in its own process namespace; 0 if it has ended."""
    with suppress(OSError, IndexError, ValueError):
        status = Path(f"/proc/{pid}/status").read_bytes()
        return int(status.partition(b"\nNSpid:")[2].partition(b"\n")[0].split()[-1])
    return 0
