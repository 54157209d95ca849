"""What pictures show of real nodes that do something wrong: one mistake for each kind of them."""

from __future__ import annotations

from typing import NamedTuple

import pytest

from autograder import corpus
from autograder.corpus import trials
from autograder.examination.pictures.picture import Picture, Series, Timeline
from autograder.examination.pictures.wording import describe_picture
from tests.machine import needs_sandbox


class Mistake(NamedTuple):
    """A case of a corpus, the check that fails by it, and what its picture must say."""

    exercise: str
    case: str
    check: str
    words: tuple[str, ...]


MISTAKES = [
    Mistake("qos", "wrong-lidar-deep", "lidar_fresh",
            ("acted on, and too old: ", "young enough to be acted on: ")),
    Mistake("qos", "wrong-imu-single", "imu_burst", ("not handed on: 4 (", " handed on: 1 (")),
    Mistake("parameters", "wrong-half-as-often", "beats_count", ("came: ", "due, 1 each second: ")),
    Mistake("patterns", "wrong-camera-slow", "camera_streams", ("came: ", "due, 10 each second")),
    Mistake("patterns", "wrong-navigation-by-time", "navigation_drives",
            ("feedback of the goal: 3 (", "the motors are told: to drive: ")),
    Mistake("safety", "wrong-gripper-constant-pauses", "gripper_retries",
            ("tries: the gripper is called: 2 (0.0, 1.5 s)", "too early, or too often: 1 (3.0 s)")),
    Mistake("safety", "wrong-drive-never-succeeds", "drive_arrives",
            ("the goal: over: aborted: 1 (4.0 s)", "its feedback: 4 (1.0, 2.0, 3.0, 4.0 s)")),
    Mistake("resources", "thread-left", "lives_are_flat", ("threads over lives: ",)),
    Mistake("resources", "picture-each-second", "driver_runs",
            ("came: 1 (1.00 s)", "due, 10 each second: 10 (0.10 to 1.00 s)")),
]  # fmt: skip


def picture_of(mistake: Mistake) -> Picture | None:
    (case,) = (c for c in corpus.load_cases(mistake.exercise) if c.name == mistake.case)
    (trial,) = corpus.run([case], *trials.make_notebooks(mistake.exercise), jobs=1)
    checks = [check for v in trial.outcome.verdicts.values() for check in v.checks]
    assert not [check.name for check in checks if check.passed and check.picture]
    return next(check.picture for check in checks if check.name == mistake.check)


@needs_sandbox
@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda mistake: mistake.case)
def test_a_mistake_is_shown(mistake: Mistake) -> None:
    picture = picture_of(mistake)
    assert picture is not None
    words = describe_picture(picture)
    assert not [part for part in mistake.words if part not in words], words
    if isinstance(picture, Series):
        values = [value for _, value in picture.points]
        assert values == sorted(values)
        assert values[-1] - values[0] >= len(values) - 1
    else:
        assert isinstance(picture, Timeline)
        assert not [span for lane in picture.lanes for span in lane.spans if span[0] > span[1]]
