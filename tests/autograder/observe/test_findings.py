"""What is shown beside a finding never decides on it."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from autograder.examination.exam import Failed
from autograder.examination.pictures.picture import Picture, Series, Timeline
from autograder.examination.pictures.wording import describe_picture
from autograder.observe.findings import (
    handled_picture,
    in_context,
    rate_picture,
    with_picture,
)

FLAT = Series("Threads", "lives", "threads", ((0, 1), (1, 1)))


Draw = Callable[[], Picture | None]


def impossible() -> Picture:
    raise ZeroDivisionError


def too_large() -> Picture:
    return Series("x" * 1000, "lives", "threads", ((0, 1), (1, 1)))


def fail(inner: Draw, outer: Draw) -> None:
    with with_picture(outer), in_context("Then.", "There:"), with_picture(inner):
        raise Failed(expected="One.", actual="Two.")


def failure(inner: Draw, outer: Draw) -> Failed:
    with pytest.raises(Failed) as failed:
        fail(inner, outer)
    assert (failed.value.expected, failed.value.actual) == ("Then. One.", "There: Two.")
    return failed.value


def test_the_innermost_picture_is_shown() -> None:
    assert failure(lambda: FLAT, too_large).picture == FLAT
    assert failure(lambda: None, lambda: FLAT).picture == FLAT


def test_a_picture_that_cannot_be_made_costs_no_more_than_itself() -> None:
    assert failure(too_large, impossible).picture is None


def test_nothing_is_drawn_where_nothing_fails() -> None:
    with with_picture(too_large):
        pass


def test_a_rate_is_shown_beside_what_was_due() -> None:
    picture = rate_picture("Ticks", [0.2, 0.4, 0.6], hz=10.0, seconds=0.6)
    assert describe_picture(picture) == (
        "Ticks. came: 3 (0.20, 0.40, 0.60 s). due, 10 each second: 6 (0.10 to 0.60 s)."
    )


def test_of_a_flood_a_part_is_shown() -> None:
    picture = rate_picture("Ticks", [n / 1000 for n in range(100_000)], hz=100.0, seconds=60.0)
    assert picture.seconds < 1.0
    assert rate_picture("Ticks", [], hz=0.01, seconds=100.0).seconds == 100.0


def shown(handled: list[int], oldest_s: float) -> Timeline:
    times_s = {number: number / 10 for number in range(5)}
    return handled_picture("A pause", "scans", handled, times_s, (oldest_s, 0.5))


def test_of_what_waited_it_is_shown_what_was_handled_and_what_was_too_old() -> None:
    assert describe_picture(shown([0, 3, 4, 7], 0.3)) == (
        "A pause. scans: acted on, and too old: 1 (0.00 s); not acted on: 2 (0.10, 0.20 s); "
        "acted on: 2 (0.30, 0.40 s). young enough to be acted on: 0.30 to 0.50 s."
    )
    assert len(shown([4], 0.0).lanes) == 1
