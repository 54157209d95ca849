"""A heart is judged by its silences, and a student is asked what may have stopped it."""

from __future__ import annotations

import pytest

from autograder.observe.several_nodes.heartbeats import (
    ON_THE_WALL_CLOCK,
    STOPPED,
    guess_cause,
    longest_silence,
)


@pytest.mark.parametrize(
    ("times_s", "silence_s"),
    [
        ([], 4.0),
        ([1.0, 2.0, 3.0], 1.0),
        ([0.5], 3.5),
        ([-1.0, 2.0, 9.0], 2.0),
        ([0.0, 4.0], 4.0),
    ],
)
def test_the_longest_silence_may_be_at_either_end(times_s: list[float], silence_s: float) -> None:
    assert longest_silence(times_s, 0.0, 4.0) == silence_s


@pytest.mark.parametrize(
    ("beats", "watched_s", "cause"),
    [
        (3, None, ""),  # more than half of them: it is only slow
        (2, None, STOPPED),
        (0, 0.1, ON_THE_WALL_CLOCK),
        (2, 0.1, ""),  # more than the wall clock would have brought
    ],
)
def test_a_cause_is_guessed_where_there_is_hardly_a_beat(
    beats: int, watched_s: float | None, cause: str
) -> None:
    assert guess_cause(beats, wanted=4.0, period_s=0.5, watched_s=watched_s) == cause
