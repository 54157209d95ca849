"""Checks of the chapters' small tasks: a sentence at once, whatever stands in the cell."""

from __future__ import annotations

import math
from typing import Any

import pytest
from nav_msgs.msg import Odometry
from std_msgs.msg import String

from course import Session
from course.lessons import building_blocks as check
from course.lessons.checkpoint import Checkpoint, keep_looking, say_not_yet, say_yes
from course.lessons.spiral import turning_of

CASES = ["vital signs", "a lab result", "a surgery"]


def test_a_checkpoint_reads_as_a_sentence_and_is_no_html_of_a_learners() -> None:
    assert repr(say_yes("it drives.")) == "Yes: it drives."
    assert repr(say_not_yet("it stands.")) == "Not yet: it stands."
    assert "&lt;b&gt;" in say_not_yet("you said '<b>'.")._repr_html_()


def test_looking_ends_when_it_has_happened() -> None:
    looks: list[int] = []

    def look() -> Checkpoint:
        looks.append(0)
        return say_yes("now.") if len(looks) == 3 else say_not_yet("later.")

    with Session() as session:
        assert keep_looking(session, look, timeout=30.0).passed
        assert not keep_looking(session, lambda: say_not_yet("never."), timeout=0.1).passed


@pytest.mark.parametrize(
    ("guess", "passed", "part"),
    [(..., False, "no guess yet"), (7, True, "7 boxes"), (8, False, "8"), ("x", False, "'x'")],
)
def test_a_guess_is_compared(guess: Any, passed: bool, part: str) -> None:
    found = check.guess_holds(guess, 7, "boxes")
    assert found.passed is passed
    assert part in found.sentence
    assert passed or "7" not in found.sentence  # the answer is not given away


@pytest.mark.parametrize(
    ("chosen", "passed"),
    [
        (["topic", "service", "action"], True),
        (["Topic", " service", "ACTION"], True),
        ([..., ..., ...], False),
        (["topic", "topic", "action"], False),
        (["topic", "service", None], False),
    ],
)
def test_patterns_are_compared_one_after_the_other(chosen: list[Any], passed: bool) -> None:
    assert check.hospital_patterns(dict(zip(CASES, chosen, strict=True))).passed is passed


def test_a_distance_that_nobody_publishes_is_said_and_no_error() -> None:
    with Session() as session:
        assert "nothing was heard on /nearest" in check.nearest_is_published(session).sentence
        assert "how_far" in check.how_far_answers(session).sentence


def test_the_latest_five_are_those_and_no_others() -> None:
    def kept(first: int, last: int) -> list[String]:
        return [String(data=str(number)) for number in range(first, last + 1)]

    assert check.latest_five_are_kept(kept(26, 30)).passed
    assert "1 scan." in check.latest_five_are_kept(kept(30, 30)).sentence
    assert not check.latest_five_are_kept(kept(21, 30)).passed


def test_turning_counts_whole_turns() -> None:
    track = []
    for step in range(21):
        message = Odometry()
        yaw = step * 2.2 * math.pi / 20  # a turn and a tenth, in steps that cross half a turn
        message.pose.pose.orientation.z = math.sin(yaw / 2)
        message.pose.pose.orientation.w = math.cos(yaw / 2)
        track.append(message)
    assert turning_of(track) == pytest.approx(2.2 * math.pi)
    assert turning_of([]) == 0.0
