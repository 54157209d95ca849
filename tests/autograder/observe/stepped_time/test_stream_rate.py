"""Bounds of a rate: what they prove, and what is known of messages that were lost."""

from __future__ import annotations

import math

import pytest

from autograder.examination.exam import Failed
from autograder.observe import Topic
from autograder.observe.examiner.merged_subscriptions import Publication
from autograder.observe.stepped_time.stream_rate import StreamRate, are_numbered, count_published

PICTURES = Topic("camera", object)


def published(*numbers: int) -> list[Publication]:
    return [Publication(at, number, None) for at, number in enumerate(numbers)]


@pytest.mark.parametrize(
    ("fewest", "most", "fault"),
    [
        (10, 10, ""),
        (8, 9, ""),
        (11, 14, ""),
        (5, 5, "5"),
        (11.5, 12, "11.5 to 12"),
        (0, math.inf, ""),
    ],
)
def test_only_what_no_number_lost_can_explain_is_wrong(
    fewest: float, most: float, fault: str
) -> None:
    rate = StreamRate(fewest, most)
    assert rate.fault((9.0, 11.0)) == fault
    if fault:
        with pytest.raises(Failed, match=f"They came at {fault} a second"):
            rate.require(PICTURES, (9.0, 11.0))
    else:
        rate.require(PICTURES, (9.0, 11.0))


def test_a_rate_is_proved_by_the_tighter_of_its_bounds() -> None:
    assert StreamRate(9.5, 10.5).is_proved((9.0, 11.0))
    assert not StreamRate(8.0, 12.0).is_proved((9.0, 11.0))
    assert StreamRate(8.0, 12.0, slowest_hz=9.2, fastest_hz=10.8).is_proved((9.0, 11.0))


@pytest.mark.parametrize(
    ("numbers", "numbered", "count"),
    [
        ((1, 2, 3), True, 3),
        ((4, 9), True, 6),
        ((0, 0), False, 2),
        ((5, 5), False, 2),
        ((7, 3), False, 2),
    ],
)
def test_the_writers_numbers_tell_of_what_was_lost(
    numbers: tuple[int, ...], numbered: bool, count: int
) -> None:
    assert are_numbered(published(*numbers)) is numbered
    assert count_published(published(*numbers)) == count


def test_nothing_was_published_where_nothing_was_heard() -> None:
    assert count_published([]) == 0
