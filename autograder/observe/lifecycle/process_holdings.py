"""What the student's processes hold, seen from outside: threads, open files and memory."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise
from statistics import median_low

from autograder.observe.phrases import as_phrase
from autograder.processes.outside.asking import Outside
from autograder.processes.outside.process_usage import Usage

__all__ = ["ProcessHoldings", "Usage", "kept_each", "list_growth", "list_kept"]


class ProcessHoldings:
    """The subject, looked at from outside, with all processes that it has started."""

    def __init__(self, outside: Outside) -> None:
        """Look through ``outside``."""
        self._outside = outside

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
        """Return what it holds now: numbers of threads and files, and resident memory in KiB."""
        return Usage(*self._outside.ask("usage"))

    def file_positions(self, name: str) -> list[int]:
        """Return the file positions of its descriptors of a file that has been unlinked."""
        return list(self._outside.ask("positions", file=name))

    def other_processes(self) -> list[str]:
        """Return the names of the processes that it has started."""
        return list(self._outside.ask("others"))

    def others_note(self) -> str:
        """Return a sentence on the processes that the notebook has started, if there are any."""
        if not (names := self.other_processes()):
            return ""
        were = "A process that it had started was" if len(names) == 1 else "Processes were"
        return f" {were} left: {as_phrase(names)}."


def list_growth(grown: Usage, rounds: int, memory_kib: int = 0) -> list[str]:
    """Return what so many rounds have left behind, a phrase each.

    Half of the rounds count, and not one alone: a notebook's own threads come and go.

    Args:
        grown: what the process has grown by.
        rounds: how many there were.
        memory_kib: KiB from which on memory counts; with 0 it does not.

    Example:
        >>> list_growth(Usage(threads=10, files=4, memory=5_000), rounds=10, memory_kib=1_000)
        ['10 more threads', '4.9 MiB more memory']
    """
    fewest = max(2, rounds / 2)
    found = [
        f"{number} more {what}"
        for what, number in (("threads", grown.threads), ("open files", grown.files))
        if number >= fewest
    ]
    if memory_kib and grown.memory >= memory_kib:
        found.append(f"{grown.memory / 1024:.1f} MiB more memory")
    return found


def kept_each(usages: Sequence[Usage]) -> Usage:
    """Return what each round leaves behind, from what was held after each of them.

    That is the median, as something else may come or go once. For memory it is the minimum: a first
    round also warms up, by more on a busy machine.

    Example:
        >>> kept_each([Usage(9, 9, 0), Usage(10, 10, 900), Usage(11, 10, 990), Usage(12, 10, 999)])
        Usage(threads=1, files=0, memory=9)
    """
    grown = [after.growth_since(before) for before, after in pairwise(usages)]
    threads, files, memory = zip(*grown, strict=True)
    return Usage(median_low(threads), median_low(files), min(memory))


def list_kept(kept: Usage, memory_kib: int = 0) -> list[str]:
    """Return what one round has left behind, a phrase each.

    Args:
        kept: what the process has kept of it.
        memory_kib: KiB from which on memory counts; with 0 it does not.

    Example:
        >>> list_kept(Usage(threads=1, files=0, memory=5_000), memory_kib=1_024)
        ['a thread', '4 MiB of memory']
    """
    left = ["a thread"] if kept.threads > 0 else []
    left += ["an open file"] if kept.files > 0 else []
    if memory_kib and kept.memory >= memory_kib:
        left.append(f"{kept.memory // 1024} MiB of memory")
    return left
