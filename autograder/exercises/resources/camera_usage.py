"""The subject's processes as seen from outside: their threads, open files and memory."""

from __future__ import annotations

from collections.abc import Iterable

from autograder.processes.outside.asking import Outside
from autograder.processes.outside.process_usage import Usage

__all__ = ["Process", "Usage"]


class Process:
    """The subject, looked at from outside, with all processes that it has started."""

    def __init__(self, outside: Outside) -> None:
        """Look through ``outside``."""
        self._outside = outside

    def count_threads(self) -> int:
        """Return how many threads its own process has."""
        return len(self.thread_ids())

    def thread_ids(self) -> set[int]:
        """Return the kernel's numbers of its own process's threads."""
        return set(self._outside.ask("threads"))

    def count_naps(self, threads: Iterable[int]) -> dict[int, int]:
        """Return how often each of these threads, if it is there, has gone to sleep of itself."""
        return dict(self._outside.ask("naps", threads=[*threads]))

    def wake_times(self, threads: Iterable[int] | None = None) -> list[float]:
        """Return after how many s threads that sleep for a time wake up: all, or of these."""
        threads = self.thread_ids() if threads is None else threads
        return [float(left) for _, left, _ in self._outside.ask("sleepers", threads=[*threads])]

    def read_usage(self) -> Usage:
        """Return what it holds now."""
        return Usage(*self._outside.ask("usage"))

    def file_positions(self, name: str) -> list[int]:
        """Return the file positions of its descriptors of a file that has been unlinked."""
        return list(self._outside.ask("positions", file=name))

    def other_processes(self) -> list[str]:
        """Return the names of the processes that it has started."""
        return list(self._outside.ask("others"))
