"""What came in a span of time: how many, how evenly, in which order."""

from __future__ import annotations

import math
from contextlib import nullcontext
from typing import Any

import pytest

from autograder.examination.exam import Failed
from autograder.observe import Topic
from autograder.observe.examiner.examiner_end import Heard
from autograder.observe.span import Span, first_gap, rate_of

BEATS = Topic("beats", object)


def span_of(*heard: tuple[float, object], when: str = "", again: Span | None = None) -> Span:
    def go_on(_: float) -> Span:
        return again or span_of(*heard, when=when)

    came = {BEATS.name: [Heard(at_s, value) for at_s, value in heard]}
    return Span(when, 0.0, 5.0, 0.1, came, go_on, lambda: "", lambda *_: True)


def beats(*times: float) -> list[tuple[float, object]]:
    return [(at_s, number) for number, at_s in enumerate(times, 1)]


@pytest.mark.parametrize(
    ("times", "fault"),
    [
        ([1, 2, 3, 4, 5], ""),
        ([1, 2, 3, 4], ""),
        ([0.5, 1, 2, 3, 4, 5], ""),
        ([1, 2, 3], "number"),
        ([], "number"),
        ([0.5, 1, 1.5, 2, 2.5, 3, 3.5], "number"),
        ([5.0, 5.0, 5.0, 5.0, 5.0], "burst"),
    ],
)
def test_a_rate_is_a_number_of_messages_that_come_one_by_one(
    times: list[float], fault: str
) -> None:
    assert rate_of(times, 5.0, 0.1, hz=1.0, leeway=0.1).fault == fault


@pytest.mark.parametrize(
    ("came", "wanted", "how", "is_right"),
    [
        ([1.5, 2.5], [1.5, 2.5], {}, True),
        ([2.5, 1.5], [1.5, 2.5], {}, False),
        ([2.5, 1.5], [1.5, 2.5], {"ordered": False}, True),
        ([15.47], [15.48], {}, False),
        ([15.47], [15.48], {"tolerance": 0.01}, True),
        ([15.46], [15.48], {"tolerance": 0.01}, False),
        ([15.47, 15.47], [15.48], {"tolerance": 0.01}, False),
        ([1.1, 1.0], [1.1, 1.2], {"tolerance": 0.1, "ordered": False}, True),
        ([math.nan], [1.0], {"tolerance": 0.1}, False),
    ],
)
def test_values_are_those_that_are_wanted(
    came: list[float], wanted: list[float], how: dict[str, Any], is_right: bool
) -> None:
    with nullcontext() if is_right else pytest.raises(Failed, match="comes on /beats"):
        span_of(*((1.0, value) for value in came)).require_values(BEATS, wanted, **how)


def test_of_a_fast_rate_a_part_may_be_missing() -> None:
    times = [number / 20 for number in range(1, 91)]
    assert rate_of(times, 5.0, 0.1, hz=20.0, leeway=0.1).is_right
    assert not rate_of(times[:80], 5.0, 0.1, hz=20.0, leeway=0.1).is_right


@pytest.mark.parametrize(
    ("values", "gap"),
    [([], None), ([7], None), ([1, 2, 3], None), ([1, 3], (1, 3)), ([4, 4], (4, 4))],
)
def test_a_gap_is_between_the_first_two_that_do_not_follow(
    values: list[int], gap: tuple[int, int] | None
) -> None:
    assert first_gap(values) == gap


def test_a_rate_that_is_not_right_is_taken_again_more_slowly() -> None:
    slowly = span_of(*beats(1, 2, 3, 4, 5))
    span_of(*beats(1, 2), again=slowly).require_rate(BEATS, hz=1.0)


@pytest.mark.parametrize(
    ("hz", "needed"),
    [
        (1.0, "After a pause, a message a second comes on /beats."),
        (4.0, "After a pause, 4 messages a second come on /beats."),
        (0.2, "After a pause, a message every 5 s comes on /beats."),
    ],
)
def test_a_wrong_rate_is_a_sentence_of_the_task(hz: float, needed: str) -> None:
    many = beats(*[number / 10 for number in range(1, 51)])
    with pytest.raises(Failed) as failed:
        span_of(*many, when="After a pause").require_rate(BEATS, hz=hz)
    assert failed.value.expected == needed
    assert failed.value.actual == "In 5 s of the node's time 50 messages came."


def test_silence_is_no_message_at_all() -> None:
    span_of().require_silence(BEATS)
    with pytest.raises(Failed, match="1 message came"):
        span_of((1.0, 1)).require_silence(BEATS)


def test_at_most_so_many() -> None:
    span_of(*beats(1, 2)).require_at_most(BEATS, 2)
    with pytest.raises(Failed, match="3 messages came"):
        span_of(*beats(1, 2, 3)).require_at_most(BEATS, 2)


@pytest.mark.parametrize(
    ("values", "first", "said"),
    [
        ([1, 2, 4], None, "After 2 came 4."),
        ([2, 3], 1, "2 came."),
        ([], 1, "Nothing came."),
        (["one"], None, "no whole number"),
    ],
)
def test_a_count_has_no_gap_and_begins_where_it_is_to_begin(
    values: list[object], first: int | None, said: str
) -> None:
    heard = [(float(number), value) for number, value in enumerate(values)]
    with pytest.raises(Failed) as failed:
        span_of(*heard).require_count(BEATS, first=first)
    assert said in failed.value.actual
    span_of((1.0, 7), (2.0, 8)).require_count(BEATS, first=7)
