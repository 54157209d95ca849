"""What no drive may hold up or end: pictures, the position, the battery level, a new speed limit.

Each counts only if it worked without a drive; what did not has failed in a check of its own.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

from autograder.examination.exam import Failed
from autograder.exercises.patterns import camera_stream, interface_patterns, odometry
from autograder.exercises.patterns.discovery import hear_out
from autograder.exercises.patterns.rig import RobotRig
from autograder.observe.phrases import with_reason

FILMED = (8.0, 12.0)
"""Pictures a second, as far as such a short time tells."""
LEVEL, LATER = (0.55, 0.46, 0.65), (0.35, 0.25, 0.45)
"""Battery levels in a drive and after one: the usual ones, and from what to what they are drawn."""
LEVEL_AGE = 1.0  # s
HOLDS_UP = "the drive holds nobody up."


def require_pictures(rig: RobotRig, stretch: camera_stream.Stretch, where: str) -> None:
    """Fail if the pictures came at another rate in a ``stretch`` of a drive.

    ``where`` says when that was, as the beginning of a sentence.
    """
    if not rig.films:
        return
    rates = stretch.measure_rates()
    wrong = "" if rates is None else camera_stream.rate_fault(rates, FILMED)
    if wrong or rates is None:
        came = f"they came at {wrong} a second" if wrong else "no picture came"
        raise Failed(
            expected="While the robot drives, pictures come as they did before, 10 a second: "
            f"{HOLDS_UP}",
            actual=f"{where}, {came}{rig.error_note()}.",
        )


def require_position(rig: RobotRig, position: float, where: str) -> None:
    """Fail if whoever wants to know a ``position`` that has just been reported does not get it."""
    if rig.asker is None:
        return
    if answer := odometry.position_fault(rig, rig.asker, position):
        raise Failed(
            expected="While the robot drives, whoever wants to know the position gets it, at most "
            f"{odometry.AGE:g} s old: {HOLDS_UP}",
            actual=f"{where}, at {position:g} m, {answer}",
        )


def require_battery(rig: RobotRig, where: str) -> None:
    """Fail if a new level does not reach who listens."""
    if not rig.broadcasts:
        return
    level = rig.draws.number("the level in a drive", *LEVEL)
    rig.report("charge", level)
    if not rig.wait_stepping(lambda: rig.told_level(level), LEVEL_AGE):
        raise Failed(
            expected="While the robot drives, too, whoever listens to robot/battery knows a new "
            f"level within {LEVEL_AGE:g} s: {HOLDS_UP}",
            actual=f"{where}, the level became {level:g}, and {LEVEL_AGE:g} s later "
            f"{last_level(rig)}{rig.error_note()}.",
        )


def require_parameters(rig: RobotRig, where: str) -> None:
    """Fail if a good speed limit, the one that holds already, is not taken."""
    if rig.limit is None:
        return
    expected = "While the robot drives, too, max_speed takes any value from 0.1 to 1.0; it may "
    expected += "count from the next goal on."
    try:
        taken, reason = interface_patterns.set_speed_limit(rig, rig.limit)
    except Failed as failed:
        raise Failed(expected=expected, actual=f"{where}. {failed.actual}") from None
    if not taken:
        raise Failed(
            expected=expected,
            actual=f"{where}, {rig.limit:g} m/s was refused, {with_reason(reason)}.",
        )


@contextmanager
def require_standing(rig: RobotRig) -> Iterator[None]:
    """Have the speed limit changed while nobody has sent a goal; fail if the robot drives off."""
    rig.node.speeds.clear()
    yield
    rig.step()
    hear_out(rig)
    if any(rig.node.speeds):
        raise Failed(
            expected="A new max_speed is for drives: without a goal the robot stands.",
            actual="max_speed was changed while the robot had no goal, and hardware/speed said "
            f"{max(rig.node.speeds, key=abs):g} m/s.",
        )


def require_the_same_after(rig: RobotRig, position: float, before: str) -> None:
    """Fail if pictures, position or battery level do not come any more after the drive ``before``.

    Or if a new speed limit has the robot drive on. That these four were right without a drive may
    have been found in an earlier part of the exam.
    """
    limit = rig.limit if rig.obeyed is None else rig.obeyed  # the one that holds
    if limit is not None:
        with require_standing(rig):
            interface_patterns.set_speed_limit(rig, limit)
    expected = f"After {before} pictures, position and battery level come as they did before."
    if rig.memory.get("films") and not camera_stream.wait_for_picture(rig, time.time_ns()):
        raise Failed(expected=expected, actual=f"No picture came any more{rig.error_note()}.")
    if pattern := rig.memory.get("position"):
        asker = rig.asker or odometry.asker_by(rig, pattern)
        if answer := odometry.position_fault(rig, asker, position):
            raise Failed(expected=expected, actual=f"With the robot at {position:g} m, {answer}")
    if rig.memory.get("broadcasts"):
        level = rig.draws.number("the level after a drive", *LATER)
        rig.report("charge", level)
        if not rig.wait_stepping(lambda: rig.told_level(level), LEVEL_AGE):
            raise Failed(
                expected=expected,
                actual=f"The level became {level:g}, and {LEVEL_AGE:g} s later "
                f"{last_level(rig)}{rig.error_note()}.",
            )


def last_level(rig: RobotRig) -> str:
    """Return which battery level was heard last, as a phrase."""
    levels = rig.node.levels
    return f"the last percentage was {levels[-1]:.4g}" if levels else "nothing was heard"
