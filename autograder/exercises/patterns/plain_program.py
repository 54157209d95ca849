"""What is seen of the robot once more in a plain program, and how much more slack it has there."""

from __future__ import annotations

from collections.abc import Iterable

from autograder.examination.exam import NotExaminable
from autograder.exercises.patterns import readings
from autograder.exercises.patterns.drive import Drive
from autograder.exercises.patterns.drive_ends import STOPS_S, require_stopped_by
from autograder.exercises.patterns.interface_patterns import await_patterns, find_usable
from autograder.exercises.patterns.robot import NODE, POSITION, THREADS, Findings, Robot
from autograder.observe.programs.stepped_trials import NOT_SEEN, SteppedTrials, as_not_examinable
from autograder.observe.stepped_time.stream_rate import await_publication

MORE, LESS = 1.4, 0.7
"""Times what the task says from which on a time is too long, or a rate too high, or too low."""
STANDS_S, COARSER_S = 15.0, 0.5
"""Seconds of the program's clock for which the aisle is blocked, and between two moments of it."""
FAR = 50  # stations to drive; the drive is called off


class ProgramRobot(Robot):
    """The robot in a plain program; ``drive`` is the one that is under way."""

    drive: Drive | None = None


def _see_film(robot: Robot) -> None:
    is_on = await_publication(robot, robot.pictures, 0)
    rate = readings.measure_pictures(robot) if is_on else None
    if rate is None or not rate.is_numbered:
        raise NotExaminable(NOT_SEEN)
    least, most = readings.PICTURES_HZ
    rate.require(robot.pictures.topic, (LESS * least, MORE * most))


def _see_position(robot: Robot) -> None:
    pattern = find_usable(robot, "position")
    robot.report(POSITION, robot.draws.number("the first position in a program", 0.1, 0.1, 0.2))
    if pattern == "service" and not readings.ask_position(robot)[1]:
        raise NotExaminable(NOT_SEEN)
    robot.report(POSITION, robot.draws.number("the position in a program", 0.4, 0.3, 0.6))
    readings.require_position(robot, pattern, MORE)


def _see_level(robot: Robot) -> None:
    level = robot.draws.number("the level in a program", 0.45, 0.3, 0.5)
    readings.require_level(robot, level, MORE)


def _see_late_level(robot: Robot) -> None:
    level = robot.draws.number("the last level in a program", 0.25, 0.1, 0.29)
    readings.require_late_level(robot, level, MORE)


def _drive_under_way(robot: ProgramRobot) -> Drive:
    # One for both trials: a stop of an earlier drive that comes late would be taken for this one's.
    if robot.drive is None or robot.drive.sent.is_done:
        with as_not_examinable():
            robot.report(POSITION, max(1.0, robot.position))
            robot.drive = Drive(robot, int(robot.position) + FAR)
            robot.drive.require_driving()
            robot.drive.leave_station()
    return robot.drive


def _see_blocked_aisle(robot: ProgramRobot) -> None:
    drive = _drive_under_way(robot)
    robot.pass_time(STANDS_S, COARSER_S)
    drive.require_no_further()


def _see_stop(robot: ProgramRobot) -> None:
    drive = _drive_under_way(robot)
    with as_not_examinable():
        over_ns = drive.sent.cancel(lambda: robot.speed == 0, MORE * STOPS_S, looking_s=0.0)
    require_stopped_by(robot, over_ns, MORE * STOPS_S)


def _await_interface(robot: ProgramRobot, names: Iterable[str]) -> list[str]:
    """Wait for what can be used; return the trials of it, whose first word says what it is."""
    robot.found = Findings()
    await_patterns(robot)
    return [name for name in names if find_usable(robot, name.split()[0])]


TRIALS = SteppedTrials(
    NODE,
    THREADS,
    ProgramRobot,
    {
        "camera": _see_film,
        "position": _see_position,
        "battery": _see_level,
        "battery late": _see_late_level,
        "navigation blocked": _see_blocked_aisle,
        "navigation called off": _see_stop,
    },
    _await_interface,
)
