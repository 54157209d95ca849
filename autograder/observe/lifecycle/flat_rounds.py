"""Whether many rounds of one thing leave a process as it was: its threads, files and memory.

One round proves little: a thread may still be ending, a library fills its caches, a notebook has
threads of its own. What grows with each of many rounds is a leak.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

from autograder.examination.exam import Failed
from autograder.observe.findings import with_picture
from autograder.observe.lifecycle.growth_picture import growth_picture
from autograder.observe.lifecycle.node_lives import NodeLives
from autograder.observe.lifecycle.observer import ENDED_S
from autograder.observe.lifecycle.process_holdings import Usage, list_growth
from autograder.observe.patience import SETTLE_S
from autograder.observe.phrases import as_phrase

NOISE_KIB = 640
"""KiB that few rounds may differ by: an allocator takes memory by the piece."""
FIRST_TIME = " They came after as many others: what a first time costs does not count."

LIVES_S = 2.0
"""Seconds of wall time for all lives, if more than the fewest are to be made."""
FEWEST_LIVES = 6
"""Lives at least: a node may need a second to start."""
POOLED_LIVES = 24
"""Lives after which a participant of DDS that stays, as that of a node which a cell has made, keeps
no more of others that have come and gone: Fast DDS keeps 200 KiB each for the next one, of 15."""


def require_flat(
    lives: NodeLives,
    before: Usage,
    rounds: int,
    *,
    what: str,
    expected: str,
    kib_each: int = 0,
    again: Callable[[], object] | None = None,
    repeats: int = 1,
    along: Sequence[Usage] = (),
) -> None:
    """Require that rounds which are over have left no threads and no files behind, nor memory.

    Args:
        lives: of the subject that they were in.
        before: what its process held before them.
        rounds: how many there were.
        what: what a round is, in the plural: "starts that failed".
        expected: what is needed, as a sentence.
        kib_each: KiB a round from which on memory counts; with 0 it does not.
        again: makes as many more; then only what each time leaves behind counts.
        repeats: how often ``again`` is called at most.
        along: what its process held before the rounds and after each, for a picture; ``again`` may
            add to it.

    Raises:
        Failed: something was left each time.

    Example::

        before = lives.process.read_usage()
        toggle_ten_times()
        require_flat(lives, before, 10, what="toggles", expected="Toggles leave nothing behind.")
    """
    process, threads = lives.process, set[int]()

    def left() -> list[str]:
        memory_kib = max(NOISE_KIB, rounds * kib_each) if kib_each else 0
        return list_growth(process.read_usage().growth_since(before), rounds, memory_kib)

    for repeat in range(1 + repeats if again else 1):
        if repeat and again:
            before, threads = process.read_usage(), process.thread_ids()
            again()
        lives.subject.collect()
        if lives.wait_for_end(lambda: not left()):
            return
        # A thread that looks every few seconds whether it is to end is too slow, and no leak.
        wakes = process.wake_times(threads) if threads else []
        if wakes and lives.wait(lambda: not left(), min(SETTLE_S, max(wakes) + ENDED_S)):
            return
    grown = as_phrase(left())
    with with_picture(lambda: growth_picture(along, what, grown)):
        raise Failed(
            expected=expected,
            actual=f"After {rounds} {what} the process had {grown} than before."
            f"{FIRST_TIME if again else ''}{process.others_note()}",
        )


def require_flat_lives(
    lives: NodeLives, live: Callable[[], object], most: int, kib_each: int
) -> None:
    """Require that so many lives of a node leave no thread, file or memory behind.

    What grows in both halves of them is a leak. Where a life takes long, there are as many as fit
    into `LIVES_S`; of so few that DDS still fills its pools, what grows in all of `POOLED_LIVES`.

    Args:
        lives: of the subject.
        live: makes the node, has it work, and ends it.
        most: lives at most.
        kib_each: KiB of memory that a life may keep.

    Raises:
        Failed: they leave something.
    """

    def run_half() -> None:
        for _ in range(half):
            live()
            along.append(lives.process.read_usage())

    began = time.monotonic()
    live()
    fit = int(LIVES_S / (time.monotonic() - began))
    half = max(FEWEST_LIVES, min(most, fit)) // 2
    lives.subject.collect()
    before = lives.process.read_usage()
    along = [before]
    run_half()
    require_flat(
        lives, before, half, what="lives", kib_each=kib_each, again=run_half,
        repeats=max(1, POOLED_LIVES // half - 1), along=along,
        expected=f"{2 * half} lives leave no thread and no file behind, and less than {kib_each} "
        "KiB a life.",
    )  # fmt: skip
