"""Whether a thread still waits by the wall clock, or has woken in between."""

from __future__ import annotations

import pytest

from autograder.observe.several_nodes.wall_waits import Sleep, describe_waits, is_same_sleep

BEFORE = Sleep(thread=7, until=100.0, to_the_end=False)


@pytest.mark.parametrize(
    ("later", "is_same"),
    [
        ([], False),
        ([Sleep(7, 100.01, False)], True),
        ([Sleep(7, 100.1, False)], False),  # it has woken, and naps again
        ([Sleep(8, 100.0, False)], False),
    ],
)
def test_a_sleep_is_known_by_its_thread_and_its_end(later: list[Sleep], is_same: bool) -> None:
    assert is_same_sleep(BEFORE, later) is is_same


def test_nothing_is_said_of_no_wait() -> None:
    assert describe_waits([]) == ""
