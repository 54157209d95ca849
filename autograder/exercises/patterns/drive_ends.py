"""A blocked aisle on a drive, and how a drive ends: the robot has arrived, or was called off."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from autograder.examination.exam import Failed
from autograder.exercises.patterns import readings
from autograder.exercises.patterns.drive import Drive
from autograder.exercises.patterns.robot import SPEED_AT_START, Robot
from autograder.observe.findings import in_context
from course.runtime.requests.actions import GoalState

FURTHER = (0.8, 0.9)
"""Parts of the way to which the robot creeps on, for who is content with less than all of it."""
BLOCKED_S, BLOCKED_WALL_S = 1.2, 0.3
"""Seconds of the node's clock, and at last on the wall, for which the robot cannot get on."""
WAITS_S, WAITS_ON_S = 4.0, 15.0
"""Seconds of the node's clock for which it cannot get on after that, and then once more: longer
than a metre takes who reckons by the time, and than the patience of who gives up."""
COARSE_S, COARSER_S = 0.2, 0.5
"""Seconds of the node's clock between two looks of those who wait all that time."""
NEAR_M, HELD_UP_S = 0.1, 0.6
"""Metres before the goal where the robot is held up, twice as far as a place may count as the
station, and for how many seconds of the node's clock."""
UNDER_WAY_S = 2.0
"""Seconds of wall time for a stop that was under way when the result came."""
STOPS_S = 0.5
"""Seconds of the node's clock within which a robot that is called off is told to stop."""
STANDS_S, SELDOM_S = 2.5, 0.25
"""Seconds of the node's clock for which a robot must stand at the end of a drive, and between two
clock messages meanwhile."""


def drive_to_goal(drive: Drive, *, blocked: bool = False) -> None:
    """Let the robot drive to its goal, with a report at each station on the way.

    Args:
        drive: the drive.
        blocked: whether the aisle is blocked for a while after the first station, and for a
            moment just before the goal.
    """
    while drive.station < drive.goal:
        drive.require_driving()
        if blocked and drive.station == drive.goal - 1:
            _hold_before_goal(drive)
        drive.roll_on()
        if drive.station < drive.goal:
            drive.require_report()
        if blocked and drive.station == drive.start + 1:
            _block_aisle(drive)
    _require_stop(drive, GoalState.SUCCEEDED, "At the station named the robot has arrived.")
    drive.require_result()


def _block_aisle(drive: Drive) -> None:
    """Let the aisle be blocked before the next station: feedback stands still, nothing else."""
    drive.leave_station()
    drive.robot.pass_time(BLOCKED_S)
    drive.require_no_further()
    with in_context("The drive holds nobody up.", "In a blocked aisle:"):
        # Twice: a position that is looked up now and then may be right by chance, but then it has
        # just been looked up.
        drive.move_to(drive.station + FURTHER[0])
        level = drive.robot.draws.number("the level in a drive", 0.55, 0.46, 0.65)
        require_others(drive.robot, level)
        drive.move_to(drive.station + FURTHER[1])
        require_position(drive.robot)
    drive.robot.pass_time(WAITS_S, COARSE_S)
    drive.require_no_further()
    drive.robot.pass_time(WAITS_ON_S, COARSER_S)
    _wait_on_the_wall(drive)


def _hold_before_goal(drive: Drive) -> None:
    """Let the robot be held up just before its goal, so that it cannot be there yet."""
    drive.leave_station()
    drive.move_to(drive.goal - NEAR_M)
    drive.robot.pass_time(HELD_UP_S, COARSE_S)
    _wait_on_the_wall(drive)
    drive.require_driving()


def _wait_on_the_wall(drive: Drive) -> None:
    """Give those who look by the wall's clock the time to get ahead of the robot."""
    drive.robot.wait(lambda: drive.is_ahead or drive.sent.is_done, BLOCKED_WALL_S)
    drive.require_no_further()


def require_others(robot: Robot, level: float) -> None:
    """Require that no drive holds up or has ended what worked without one, as a battery ``level``.

    What did not work has failed in a check of its own.
    """
    works = robot.found.works
    require_position(robot)
    if "camera" in works:
        readings.require_film(robot)
    if "battery" in works:
        readings.require_level(robot, level)
    if "parameters" in works:
        robot.max_speed.set(robot.max_speed.last_set or SPEED_AT_START).require_accepted()


def require_position(robot: Robot) -> None:
    """Require that the position can be learnt, if it could without a drive."""
    if robot.found.position_by:
        readings.require_position(robot, robot.found.position_by)


@contextmanager
def require_standing(robot: Robot) -> Iterator[None]:
    """Have the limit changed in the block, while the robot has no goal."""
    robot.speeds.clear()
    yield
    robot.step()
    robot.drain()
    if any(robot.speeds.values):
        raise Failed(
            expected="A new max_speed is for drives: without a goal the robot stands.",
            actual="max_speed was changed while the robot had no goal, and hardware/speed said "
            f"{max(robot.speeds.values, key=abs):g} m/s.",
        )


def call_off(drive: Drive) -> None:
    """Cancel the goal, and require that the robot stops in time and stays where it is."""
    robot = drive.robot
    over_ns = drive.sent.cancel(lambda: robot.speed == 0, STOPS_S)
    _require_stop(
        drive, GoalState.CANCELED, "A drive that is called off ends there, wherever the robot is."
    )
    require_stopped_by(robot, over_ns, STOPS_S)


def require_stopped_by(robot: Robot, moment_ns: int, seconds: float) -> None:
    """Require that the robot had been told to stop by a moment, and nothing since."""
    if robot.speed != 0 or robot.speeds.same_since_ns > moment_ns:
        raise Failed(
            expected=f"A drive that is called off stops the robot within {STOPS_S:g} s.",
            actual=f"{seconds:g} s of the node's time later hardware/speed had not said 0.0 yet.",
        )


def _require_stop(drive: Drive, state: GoalState, needed: str) -> None:
    """Wait for the end of the goal, and for the robot to stand still, and stay so."""
    robot = drive.robot
    drive.sent.require_end(state, needed, lambda: f"with the robot {drive.place_phrase}")
    # Which of two messages comes first is the transport's affair: a stop may be under way.
    is_late = state == GoalState.SUCCEEDED and not robot.wait(lambda: robot.speed == 0, UNDER_WAY_S)
    told = robot.speed
    robot.wait_stepping(lambda: robot.speed == 0)
    robot.step(STANDS_S, SELDOM_S)
    robot.await_discovery()  # whatever was on its way has come in by now
    if robot.speeds.last != 0:
        raise Failed(
            expected=f"{needed} The robot is told to stop: hardware/speed is 0.0.",
            actual=f"The goal ended as {state.name}, but the last speed that the motors were "
            f"told was {robot.speed:g} m/s: the robot drives on.",
        )
    if is_late:
        raise Failed(
            expected=f"{needed} The robot is told to stop first, and then the goal ends.",
            actual=f"The result came while the motors were still told {told:g} m/s; only later "
            "were they told to stop.",
        )
