"""A goal that the examiner sends to the drive's server: accepted, driven, ended, and a stop."""

from __future__ import annotations

from action_msgs.msg import GoalStatus

from autograder.examination.exam import Failed
from autograder.exercises.safety.navigation import Dispatcher, Drives
from autograder.exercises.safety.node_under_test import Robot
from autograder.observe.phrases import end_phrase

PROMPT = 1.0  # s for an answer
STOP = 0.5  # s from the end of a drive to the stop
ABORT = 1.0  # s from wheels that raise, or a shutdown, to the end of the drive
TOLERANCE = 0.25  # s: what the task allows, and strides
LONG, LONGEST = 8, 10  # m: what is still under way when something happens

WORDS = {
    GoalStatus.STATUS_SUCCEEDED: "succeeded",
    GoalStatus.STATUS_CANCELED: "canceled",
    GoalStatus.STATUS_ABORTED: "aborted",
}


def send_goal(robot: Robot, dispatcher: Dispatcher, metres: int, occasion: str = "") -> Drives:
    """Send a goal, and wait until it is accepted.

    ``occasion`` says what went before it, if that matters.
    """
    drive = dispatcher.send(metres)
    drive.began = dispatcher.now
    robot.run(lambda: drive.handle is not None, PROMPT)
    if drive.handle is None or not drive.handle.accepted:
        raise Failed(
            expected=f"A {_goal_phrase(metres, occasion)} is accepted.",
            actual=f"It was not answered.{robot.error_note()}"
            if drive.handle is None
            else "It was rejected.",
        )
    return drive


def _goal_phrase(metres: int, occasion: str) -> str:
    return f"goal of {metres} m {occasion}".rstrip()


def start_drive(robot: Robot, dispatcher: Dispatcher, metres: int, occasion: str = "") -> Drives:
    """Send a goal, and wait until it is accepted and the robot moves."""
    drive = send_goal(robot, dispatcher, metres, occasion)
    if not robot.run(lambda: any(dispatcher.speeds), PROMPT):
        raise Failed(
            expected=f"With a {_goal_phrase(metres, occasion)} the robot drives: cmd_vel is not "
            "zero.",
            actual=f"The goal was accepted, and the wheels were never told to drive."
            f"{robot.error_note()}",
        )
    return drive


def require_end(robot: Robot, drive: Drives, what: str, how: str, limit: float) -> None:
    """Require that a drive is over within ``limit`` s, and how it ended."""
    if not robot.run(lambda: drive.status is not None, limit + TOLERANCE):
        raise Failed(
            expected=f"{what} is over, and {how}, within {limit:g} s.",
            actual=f"After that time there was no result.{robot.error_note()}",
        )
    assert drive.status is not None
    if WORDS.get(drive.status) != how:
        raise Failed(
            expected=f"{what} ends as {how}.",
            actual=f"It {end_phrase(WORDS.get(drive.status, 'unknown'))}.{robot.error_note()}",
        )


def require_stop(robot: Robot, dispatcher: Dispatcher, how: str) -> None:
    """Require that the last command is a stop, and stays the last."""
    robot.spend_time(STOP + TOLERANCE)
    if not dispatcher.speeds or dispatcher.speeds[-1]:
        raise Failed(
            expected=f"Within {STOP:g} s after the drive has {how}, the last Twist on cmd_vel is "
            "zero.",
            actual="The last one told the robot to drive."
            if dispatcher.speeds
            else "No Twist came at all.",
        )
