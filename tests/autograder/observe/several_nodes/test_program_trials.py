"""What trials in plain programs have shown: which ends one, and what takes too long there."""

from __future__ import annotations

import math
from typing import Any

import pytest

from autograder.examination.exam import Failed, NotExaminable
from autograder.observe import Task
from autograder.observe.several_nodes.program_trials import (
    Bounds,
    NodeTrials,
    Played,
    ProgramTrials,
    Times,
)

NODE = "Talker"
ALL = frozenset({NODE, "Other"})
PAUSE = Bounds("There is a pause of 1 s.", 0.6, 1.8, "it took {:.1f} s")


def never(_: object) -> None:
    raise AssertionError("no program is run here")


TABLE = (
    NodeTrials(
        Task(NODE), timed={"paused": never}, untimed={"asked": never, "left": never},
        bounds={"pause": PAUSE},
    ),
    NodeTrials(Task("Other"), untimed={"asked": never}),
)  # fmt: skip


class Programs(ProgramTrials):
    """Trials whose programs have been played: the next outcome comes with each."""

    def __init__(self, *outcomes: Played | None) -> None:
        bench: Any = type("Bench", (), {"programs": object()})()
        super().__init__(bench, None, TABLE)  # type: ignore[arg-type]
        self.outcomes, self.played = list(outcomes), list[list[str]]()

    def _play(self, table: Any, stride_s: float = 0.1, **_: Any) -> Played | None:
        self.played.append([name for trials in table for name in trials.names])
        return self.outcomes.pop(0)


def ended(trial: str = "", node: str = NODE, **took: float) -> Played:
    return Played((node, trial) if trial else None, ALL, Times(took))


def test_one_program_is_enough_where_nothing_ends_it() -> None:
    trials = Programs(ended(pause=1.0))
    for name in ("paused", "asked", "left"):
        trials.require_survival(NODE, name)
    trials.require_times(NODE, "pause")
    assert len(trials.played) == 1


def test_a_trial_that_ends_two_programs_is_the_one_that_fails() -> None:
    trials = Programs(ended("asked"), ended("asked"), ended())
    with pytest.raises(Failed, match="that ended"):
        trials.require_survival(NODE, "asked")
    for name in ("paused", "left"):
        trials.require_survival(NODE, name)
    assert trials.played[1:] == [["paused", "asked", "left"], ["left"]]


def test_what_ended_one_program_and_no_other_is_a_race_of_rclpy() -> None:
    trials = Programs(ended("asked"), ended())
    trials.require_survival(NODE, "asked")


def test_a_node_that_raises_does_not_fail_the_others() -> None:
    trials = Programs(ended("asked"), ended())
    trials.require_survival("Other", "asked")


def test_nothing_is_known_of_a_node_that_no_program_has() -> None:
    trials = Programs(None, None)
    with pytest.raises(NotExaminable, match="not found out"):
        trials.require_survival(NODE, "asked")


@pytest.mark.parametrize(("took", "is_far_off"), [(1.0, False), (0.5, True), (math.inf, True)])
def test_a_time_has_bounds(took: float, is_far_off: bool) -> None:
    assert Times({"pause": took}).is_far_off("pause", PAUSE) is is_far_off


def test_what_is_out_of_bounds_is_timed_again_in_finer_strides() -> None:
    Programs(ended(pause=2.0), ended(pause=1.1)).require_times(NODE, "pause")
    with pytest.raises(Failed, match=r"it took 2\.1 s"):
        Programs(ended(pause=2.0), ended(pause=2.1)).require_times(NODE, "pause")


def test_what_could_not_be_timed_fails_nobody() -> None:
    with pytest.raises(NotExaminable, match="could not be timed"):
        Programs(ended(), ended()).require_times(NODE, "pause")
