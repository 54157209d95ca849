"""Which counts of messages are a rate: in steps of simulated time, and by the machine's clock."""

from __future__ import annotations

import pytest

from autograder.observe.lifecycle.stepped_rate import StepCount
from autograder.observe.programs.wall_rate import Take


@pytest.mark.parametrize(
    ("came", "wanted", "most", "hz", "right"),
    [
        (10, 10, 1, 10.0, True),
        (9, 10, 1, 10.0, True),
        (8, 10, 1, 10.0, False),
        (27, 30, 3, 30.0, True),
        (26, 30, 3, 30.0, False),
        (10, 10, 3, 10.0, True),
        (10, 10, 4, 10.0, False),
        (10, 9, 1, 1.5, True),
        (12, 9, 1, 1.5, False),
    ],
)
def test_as_many_may_be_under_way_as_come_in_a_tenth_of_a_second(
    came: int, wanted: int, most: int, hz: float, right: bool
) -> None:
    assert StepCount(came, wanted, most, hz).is_right is right


def test_a_take_that_was_held_up_says_nothing() -> None:
    slow = Take(came=6, seconds=2.0, held_up_s=0.0)
    assert not slow.is_about(10.0)
    assert not slow.was_held_up
    assert Take(came=6, seconds=2.0, held_up_s=0.5).was_held_up
    assert not Take(came=2, seconds=2.0, held_up_s=0.5).was_held_up


def test_too_many_are_not_slow() -> None:
    fast = Take(came=20, seconds=1.0, held_up_s=0.0)
    assert not fast.is_about(10.0)
    assert fast.is_not_slow(10.0)
