"""What a driver's lives in a plain program have left behind, and what is only noise."""

from __future__ import annotations

from itertools import accumulate

import pytest

from autograder.exercises.resources.ctrl_c import Lives
from autograder.processes.outside.process_usage import Usage

FIRST = Usage(10, 20, 100_000)


def lives(*grown: tuple[int, int, int]) -> Lives:
    """Return lives after each of which the program held so many threads, files and KiB more."""
    usages = accumulate(grown, lambda a, b: Usage(*map(sum, zip(a, b, strict=True))), initial=FIRST)
    return Lives(usages=tuple(usages))


@pytest.mark.parametrize(
    ("seen", "clean"),
    [
        # Measured with a right driver; failed starts happen during the last life.
        (lives((0, 0, 350), (0, 0, 210), (0, 0, 1820)), True),
        # The same driver on a busy machine: one life alone has warmed up by more than usual.
        (lives((0, 0, 1100), (0, 0, 210), (0, 0, 1820)), True),
        (lives((0, 0, 210), (0, 0, 1100), (0, 0, 1820)), True),
        (lives((0, 0, 1500), (0, 0, 1300), (0, 0, 2800)), False),
        (lives((1, 0, 0), (0, 0, 0), (0, 0, 0)), True),
        (lives((1, 0, 0), (1, 0, 0), (0, 0, 0)), False),
        (lives((0, 1, 0), (0, 0, 0), (0, 1, 0)), False),
    ],
)
def test_what_each_life_leaves_is_a_leak_and_what_one_leaves_is_none(
    seen: Lives, clean: bool
) -> None:
    assert seen.is_clean is clean
