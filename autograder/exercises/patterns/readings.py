"""What the others learn of the robot: its pictures, its position, the level of its battery."""

from __future__ import annotations

import re

from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from autograder.examination.exam import Failed
from autograder.exercises.patterns.robot import CHARGE, Robot
from autograder.exercises.patterns.scenarios import SCENARIOS
from autograder.observe import Topic
from autograder.observe.stepped_time.late_subscription import (
    LateSubscription,
    require_for_late_joiners,
)
from autograder.observe.stepped_time.stream_rate import StreamRate, StreamStretch

PICTURES_HZ, ABOUT_HZ = (9.0, 11.0), (8.0, 12.0)
"""Pictures a second, and as far as a short time tells."""
FILM_S = 1.2
"""Seconds of the node's clock in which pictures are counted where a short time is enough."""
POSITION_AGE_S, LEVEL_AGE_S = 0.5, 1.0
"""Seconds of the node's clock that a position, and a battery level, may be old."""
CLOSE_M, LEVEL_MARGIN = 0.051, 1e-3
ODOMETRY = Topic(SCENARIOS["position"].topic, Float64, value=lambda message: message.data)
NUMBER = r"-?\d+(?:\.\d+)?(?:[eE][-+]?\d{1,2})?"
MAX_NUMBERS = 12
"""In an answer that says where the robot is: a date and a time, say, and a pose."""
MAX_ANSWER_CHARS, MAX_SHOWN_CHARS = 1000, 200


def measure_pictures(robot: Robot) -> StreamRate | None:
    """Let time pass; return at which rate pictures came, or None if none comes any more."""
    stretch = StreamStretch(robot, robot.pictures)
    stretch.run(FILM_S, sum(PICTURES_HZ) / 2)
    return stretch.measure()


def require_film(robot: Robot) -> None:
    """Require that pictures come at about the right rate."""
    rate = measure_pictures(robot)
    if rate is None:
        raise Failed(
            expected=SCENARIOS["camera"].needed, actual=f"No picture came{robot.error_note()}."
        )
    rate.require(robot.pictures.topic, ABOUT_HZ)


def require_content(robot: Robot) -> None:
    """Require that the last message on the camera's topic holds a picture."""
    width, height, step, size = robot.pictures.last
    if not width or not size or size != height * step:
        raise Failed(
            expected="A message on robot/camera holds a picture: its height times its step bytes.",
            actual=f"It has {size} bytes, a width of {width}, a height of {height} and a step of "
            f"{step}.",
        )


def require_position(robot: Robot, pattern: str, slack: float = 1.0) -> None:
    """Require that the position that was reported last can be learnt in time.

    The hardware says no more of it: a callback may take its time over each report.

    Args:
        robot: the robot.
        pattern: "service" or "topic".
        slack: times the age that it may have.
    """
    learn = ask_position if pattern == "service" else _overhear
    answer, is_right = "", False

    def is_settled() -> bool:
        nonlocal answer, is_right
        answer, numbers = learn(robot)
        is_right = any(abs(number - robot.position) < CLOSE_M for number in numbers)
        return is_right or answer == "nobody answered"

    robot.wait_stepping(is_settled, slack * POSITION_AGE_S)
    if not is_right:
        raise Failed(
            expected=SCENARIOS["position"].needed,
            actual=f"With the robot at {robot.position:g} m, {answer}{robot.error_note()}.",
        )


def listen_to_position(robot: Robot) -> None:
    """Listen to the position's topic from now on, as somebody does who has just joined."""
    robot.overheard = LateSubscription(robot.node, ODOMETRY)
    robot.await_discovery()


def _overhear(robot: Robot) -> tuple[str, list[float]]:
    if robot.overheard is None:
        listen_to_position(robot)
    newest = robot.overheard.last if robot.overheard else None
    if newest is None:
        return "no message came in time", []
    return f"the newest message was {newest:g}", [newest]


def ask_position(robot: Robot) -> tuple[str, list[float]]:
    """Return what the service answers, as a clause, and the numbers in it."""
    answer = robot.call(Trigger, f"/{ODOMETRY.name}", Trigger.Request())
    if answer is None:
        return "nobody answered", []
    found = re.findall(NUMBER, answer.message[:MAX_ANSWER_CHARS]) if answer.success else []
    if len(found) > MAX_NUMBERS:
        return f"the answer holds {len(found)} numbers: nobody knows which one is the position", []
    said = f"success={answer.success}, message={answer.message[:MAX_SHOWN_CHARS]!r}"
    return f"the answer was {said}", [float(number) for number in found]


def require_level(robot: Robot, level: float, slack: float = 1.0) -> None:
    """Have the hardware report a battery level, and require that a listener hears it."""
    age_s = slack * LEVEL_AGE_S
    robot.report(CHARGE, level)
    if not robot.wait_stepping(
        lambda: abs((robot.levels.last or 0.0) - level) < LEVEL_MARGIN, age_s
    ):
        last = robot.levels.last
        said = "nothing was heard" if last is None else f"the last percentage was {last:.4g}"
        raise Failed(
            expected=SCENARIOS["battery"].needed,
            actual=f"{age_s:g} s after the level had become {level:g}, {said}{robot.error_note()}.",
        )


def require_late_level(robot: Robot, level: float, slack: float = 1.0) -> str:
    """Require that a late joiner learns a battery ``level``; return how."""
    robot.report(CHARGE, level)
    return require_for_late_joiners(
        robot, robot.levels, lambda told: abs(told - level) < LEVEL_MARGIN, slack * LEVEL_AGE_S
    )
