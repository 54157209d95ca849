"""What processes hold, as anybody on the machine sees it: threads, open files and memory.

Linux keeps these under ``/proc/<pid>`` (proc(5)): ``task``, ``fd``, ``fdinfo`` and ``statm``. They
are counted over all processes: what one that was started on the side holds is held as well.
"""

from __future__ import annotations

import os
import resource
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from autograder.processes.outside.holding import DDS_THREADS
from autograder.processes.process_folders import Processes

MOST_NAMES = 20
"""Processes whose names are told."""
_PAGE = resource.getpagesize()


class Usage(NamedTuple):
    """What processes hold: numbers of threads and open files, and resident memory in KiB."""

    threads: int
    files: int
    memory: int

    def growth_since(self, since: Usage) -> Usage:
        """Return by how much it has grown since an earlier look."""
        return Usage(*(now - before for now, before in zip(self, since, strict=True)))


def measure_usage(processes: Processes) -> Usage:
    """Return what they hold now."""
    threads = files = pages = 0
    for folder in processes.list_folders():
        with suppress(OSError):
            threads += len(os.listdir(f"{folder}/task"))  # noqa: PTH208 - the names alone, of many
            files += len(os.listdir(f"{folder}/fd"))  # noqa: PTH208
            pages += int(Path(folder, "statm").read_bytes().split()[1])
    return Usage(threads, files, pages * _PAGE // 1024)


def thread_ids(process: str) -> list[int]:
    """Return the kernel's numbers of the threads of one process, by its folder.

    One that has ended has none, also while it is still there for its parent.
    """
    with suppress(OSError):
        threads = [int(name) for name in os.listdir(f"{process}/task")]  # noqa: PTH208
        state = Path(process, "stat").read_bytes().rpartition(b") ")[2][:1]
        return threads if len(threads) > 1 or state not in b"ZX" else []
    return []


def count_naps(processes: Processes, threads: Iterable[int]) -> dict[int, int]:
    """Return how often each of these threads, if it is there, has gone to sleep of itself.

    So which of them works: one that waits for ever goes to sleep just once. Those of DDS are left
    out, as they wake up for what others announce, whatever the program does.
    """
    found, folders = {}, processes.list_folders()
    for thread in threads:
        for folder in folders:
            with suppress(OSError, IndexError):
                status = Path(folder, "task", str(thread), "status").read_bytes()
                if not status.startswith(b"Name:\t" + DDS_THREADS):
                    count = status.partition(b"\nvoluntary_ctxt_switches:")[2]
                    found[thread] = int(count.split()[0])
    return found


def file_positions(processes: Processes, name: str) -> list[int]:
    """Return the file positions of their descriptors of a file that has been unlinked.

    Only the last part of the path is compared: the rest depends on the mount namespace.
    """
    found = []
    for folder in processes.list_folders():
        descriptors: list[Path] = []
        with suppress(OSError):
            descriptors = list(Path(folder, "fd").iterdir())
        for descriptor in descriptors:
            with suppress(OSError, IndexError):  # it may be closed while we look
                if descriptor.readlink().name == f"{name} (deleted)":
                    info = Path(folder, "fdinfo", descriptor.name).read_bytes()
                    found.append(int(info.split()[1]))  # "pos:  <number>" comes first
    return found


def process_names(processes: Processes, but: int) -> list[str]:
    """Return what they are called, all but one: a process gives itself whatever name it likes."""
    found = []
    for folder in processes.list_folders():
        with suppress(OSError):
            if folder != processes.folder_of(but):
                name = Path(folder, "comm").read_bytes().decode(errors="replace").rstrip("\n")
                found.append(name if name.isprintable() else repr(name))
    return found[:MOST_NAMES]
