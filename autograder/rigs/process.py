"""The subject's process as anybody on the machine sees it: its threads, open files and memory.

Linux keeps these under ``/proc/<pid>`` (proc(5)): ``task``, ``fd``, ``fdinfo`` and ``statm``.
"""

from __future__ import annotations

import resource
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Usage:
    """What a process holds: numbers of threads and open files, and resident memory in KiB."""

    threads: int
    files: int
    memory: int

    def grown(self, since: Usage) -> Usage:
        """Return by how much it has grown since an earlier look."""
        return Usage(
            self.threads - since.threads, self.files - since.files, self.memory - since.memory
        )


class Process:
    """A process, looked at from outside."""

    def __init__(self, pid: int) -> None:
        """Look at the process ``pid``."""
        self._proc = Path("/proc") / str(pid)

    def threads(self) -> int:
        """Return how many threads it has."""
        return len(self.thread_ids())

    def thread_ids(self) -> set[int]:
        """Return the kernel's numbers of its threads."""
        return {int(task.name) for task in (self._proc / "task").iterdir()}

    def naps(self, threads: Iterable[int]) -> dict[int, int]:
        """Return how often each of these threads, if it is there, has gone to sleep of itself.

        So which of them works: one that waits for ever goes to sleep just once.
        """
        found = {}
        for thread in threads:
            with suppress(FileNotFoundError, ProcessLookupError):
                status = (self._proc / "task" / str(thread) / "status").read_text("ascii")
                found[thread] = int(status.partition("\nvoluntary_ctxt_switches:")[2].split()[0])
        return found

    def usage(self) -> Usage:
        """Return what it holds now."""
        pages = int((self._proc / "statm").read_text(encoding="ascii").split()[1])
        files = sum(1 for _ in (self._proc / "fd").iterdir())
        return Usage(self.threads(), files, pages * resource.getpagesize() // 1024)

    def positions(self, name: str) -> list[int]:
        """Return the file positions of its descriptors of a file that has been unlinked.

        Only the last part of the path is compared: the rest depends on the mount namespace.
        """
        found = []
        for descriptor in (self._proc / "fd").iterdir():
            # It may be closed while we look.
            with suppress(FileNotFoundError, ProcessLookupError):
                if descriptor.readlink().name == f"{name} (deleted)":
                    info = (self._proc / "fdinfo" / descriptor.name).read_text("ascii")
                    found.append(int(info.split()[1]))  # "pos:  <number>" comes first
        return found
