"""Deadlines that are fair on a busy machine: what other programs take of the time does not count.

The kernel counts for how long each thread was ready to run and did not (proc(5): `schedstat`). Of a
process its first thread counts, which runs a notebook's cells and answers an examiner. Time asleep
does not count: a program that sleeps for too long is found after the same time on any machine. Time
in which its own threads and processes had the processor does not count either.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Protocol

from autograder.processes.process_folders import Processes, SingleProcess

_MAX_STRETCH = 2  # times its length by which a deadline can be put off
_TICK = os.sysconf("SC_CLK_TCK")


class RunDelay(Protocol):
    """Tells for how long others have kept a program from running."""

    def mark(self) -> float:
        """Return what stands for this moment."""

    def delay_since(self, mark: float) -> float:
        """Return for how many s it was kept since a moment, not below 0."""


class SeenDelay:
    """That of processes which can be looked at from here."""

    def __init__(
        self, processes: Processes, pid: int, spent: Callable[[], float] = lambda: 0.0
    ) -> None:
        """Look at the first thread of ``pid``, a number as the process itself has it.

        ``spent`` returns what a watcher has counted: how long they all have computed, in s, with
        those that have ended and that nobody has waited for. The kernel forgets these.
        """
        self._processes, self._main, self._spent = processes, processes.folder_of(pid), spent

    def mark(self) -> float:
        """Return for how many s it was kept up to now, less what its others have computed."""
        try:
            worked, kept = run_times(self._main)
        except (OSError, ValueError):  # it has ended, or the kernel does not count
            return 0.0
        computed = max(self._spent(), sum(map(_processor_seconds, self._processes.list_folders())))
        return kept - max(0.0, computed - worked)

    def delay_since(self, mark: float) -> float:
        """Return for how many s it was kept since `mark` was asked."""
        return max(0.0, self.mark() - mark)


def of_process(pid: int) -> SeenDelay:
    """Return the delay of one process of this machine."""
    return SeenDelay(SingleProcess(pid), pid)


def _processor_seconds(process: str) -> float:
    """Return the processor time of a process, and of its children that have ended, in s."""
    with suppress(OSError):
        file = os.open(f"{process}/stat", os.O_RDONLY)
        try:
            text = os.read(file, 1024)
        finally:
            os.close(file)
        return sum(map(int, text.rpartition(b")")[2].split()[11:15])) / _TICK
    return 0.0


def run_times(folder: str) -> tuple[float, float]:
    """Return for how many s a thread has computed, and was ready and got no processor.

    Args:
        folder: the thread's in proc(5), or a process's, for its first thread.

    Raises:
        OSError: it has ended.
        ValueError: the kernel does not say.
    """
    file = os.open(f"{folder}/schedstat", os.O_RDONLY)  # asked often, and pathlib takes far longer
    try:
        worked, kept, _ = map(int, os.read(file, 64).split())
    finally:
        os.close(file)
    return worked / 1e9, kept / 1e9


class FairDeadline:
    """A point in time that is put off, up to a limit, while others keep a program from running."""

    def __init__(self, timeout: float, delay: RunDelay) -> None:
        """Set it `timeout` s from now, of the program's own; it is three times as far at most."""
        self._delay, self._timeout = delay, timeout
        self._begun, self._mark = time.monotonic(), delay.mark()

    @property
    def seconds_left(self) -> float:
        """Seconds left, not below 0."""
        left = self._timeout - (time.monotonic() - self._begun)
        if left <= 0:
            left += min(self._delay.delay_since(self._mark), _MAX_STRETCH * self._timeout)
        return max(0.0, left)
