"""What rounds leave behind in a process, and what is only noise."""

from __future__ import annotations

from itertools import accumulate

import pytest

from autograder.observe.lifecycle.process_holdings import Usage, kept_each, list_growth, list_kept

FIRST = Usage(10, 20, 100_000)
MIB = 1024


@pytest.mark.parametrize(
    ("grown", "rounds", "left"),
    [
        (Usage(5, 0, 0), 10, ["5 more threads"]),
        (Usage(4, 4, 0), 10, []),
        # Of few rounds one alone is noise: a notebook's own threads come and go.
        (Usage(1, 1, 0), 1, []),
        (Usage(2, 2, 0), 2, ["2 more threads", "2 more open files"]),
        (Usage(0, 0, 3 * MIB), 3, ["3.0 MiB more memory"]),
        (Usage(-1, -1, -1), 3, []),
    ],
)
def test_half_of_the_rounds_must_have_left_something(
    grown: Usage, rounds: int, left: list[str]
) -> None:
    assert list_growth(grown, rounds, memory_kib=rounds * MIB) == left


def test_memory_counts_only_where_it_is_asked_for() -> None:
    assert list_growth(Usage(0, 0, 10**6), 3) == []
    assert list_kept(Usage(0, 0, 10**6)) == []


@pytest.mark.parametrize(
    ("grown", "clean"),
    [
        # Measured with a right driver; starts that fail happen during the last life.
        ([(0, 0, 350), (0, 0, 210), (0, 0, 1820)], True),
        # The same driver on a busy machine: one life alone has warmed up by more than usual.
        ([(0, 0, 1100), (0, 0, 210), (0, 0, 1820)], True),
        ([(0, 0, 210), (0, 0, 1100), (0, 0, 1820)], True),
        ([(0, 0, 1500), (0, 0, 1300), (0, 0, 2800)], False),
        ([(1, 0, 0), (0, 0, 0), (0, 0, 0)], True),
        ([(1, 0, 0), (1, 0, 0), (0, 0, 0)], False),
        ([(0, 1, 0), (0, 0, 0), (0, 1, 0)], False),
    ],
)
def test_what_each_round_leaves_is_kept_and_what_one_leaves_is_not(
    grown: list[tuple[int, int, int]], clean: bool
) -> None:
    usages = accumulate(grown, lambda a, b: Usage(*map(sum, zip(a, b, strict=True))), initial=FIRST)
    assert (list_kept(kept_each([*usages]), MIB) == []) is clean
