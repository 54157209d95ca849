"""Part D, the drive's server when its node is shut down: on the way, and with nothing to do."""

from __future__ import annotations

import time

from autograder.examination.check_context import StudentError, SubjectGone
from autograder.examination.exam import Failed
from autograder.exercises.safety import drive_goal
from autograder.exercises.safety.navigation import Dispatcher
from autograder.exercises.safety.node_under_test import Robot
from autograder.exercises.safety.rig import RobotRig

AT_ONCE = 1.0  # s of wall time that shutdown() may take where it does not wait; 0.01 s as a rule
RETURNS = 5.0  # s of wall time after which it waits for what does not come
EXPECTED = "shutdown() does not wait: it tells the loop, and returns at once."
AFTERWARDS = 2  # m of a goal that comes after shutdown(), and s in which it would drive, at most
LOOKS = 3  # calls of it, if need be, of which the fastest counts: any may be held up by the machine


def examine_shutdown(rig: RobotRig) -> None:
    """The node is about to be taken down, on the way, and then while nothing is under way."""
    took = [_shutdown_on_the_way(rig)]
    while took[-1] > AT_ONCE and len(took) < LOOKS:
        rig.renew_node()
        took.append(_shutdown_on_the_way(rig))
    if min(took) > AT_ONCE:
        raise Failed(
            expected=EXPECTED,
            actual=f"Called {len(took)} times, it took {min(took):.1f} s or more each time, by the "
            "wall clock.",
        )
    rig.renew_node()
    with rig.run_robot(Dispatcher.SERVER, Dispatcher) as (robot, dispatcher):
        _shut_down(rig, "while no goal is under way")
        robot.run(lambda: dispatcher.speeds, drive_goal.STOP)
        if dispatcher.speeds[-1:] != [False]:
            raise Failed(
                expected="shutdown() stops the wheels, also while no goal is under way: a zero "
                "Twist on cmd_vel.",
                actual="Nothing came on cmd_vel.",
            )
        robot.require_no_errors()
        _goal_afterwards(robot, dispatcher, "")
    rig.require_shutdown_unasked()


def _goal_afterwards(robot: Robot, dispatcher: Dispatcher, last: str) -> None:
    """Send a goal to a node that is about to be taken down: whatever it answers, nothing moves.

    ``last`` says what became of the goal before, as the end of a sentence.
    """
    drive = dispatcher.send(AFTERWARDS)

    def over() -> bool:
        rejected = drive.handle is not None and not drive.handle.accepted
        return rejected or drive.status is not None or any(dispatcher.speeds)

    robot.run(over, AFTERWARDS)
    if any(dispatcher.speeds):
        raise Failed(
            expected="After shutdown() the wheels are told nothing any more but to stop, whoever "
            "sends a goal then.",
            actual=f"A goal of {AFTERWARDS} m that came after shutdown(){last} drove the robot.",
        )


def _shutdown_on_the_way(rig: RobotRig) -> float:
    """Shut the node down in the middle of a drive; return how long the call took, in s."""
    with rig.run_robot(Dispatcher.SERVER, Dispatcher) as (robot, dispatcher):
        drive = drive_goal.start_drive(robot, dispatcher, drive_goal.LONG)
        robot.spend_time(0.5)
        took = _shut_down(rig, "in the middle of a drive")
        robot.wait_for_rest()
        if dispatcher.speeds[-1]:
            raise Failed(
                expected="shutdown() stops the robot at once.",
                actual="After the call the last Twist on cmd_vel told the robot to drive.",
            )
        before = len(dispatcher.speeds)
        drive_goal.require_end(
            robot, drive, "A goal under way at shutdown()", "aborted", drive_goal.ABORT
        )
        drive_goal.require_stop(robot, dispatcher, "been aborted")
        if any(dispatcher.speeds[before:]):
            raise Failed(
                expected="After shutdown() the wheels are told nothing any more but to stop.",
                actual="The goal was aborted, but before that the wheels were told to drive again.",
            )
        robot.require_no_errors()
        _goal_afterwards(robot, dispatcher, ", when the one under way had been aborted,")
    return took


def _shut_down(rig: RobotRig, when: str) -> float:
    began = time.monotonic()
    try:
        rig.bench.subject.call(Dispatcher.SERVER, "shutdown", timeout=RETURNS)
    except StudentError as error:
        raise Failed(
            expected=f"{Dispatcher.SERVER} has a method shutdown() that does not raise {when}.",
            actual=error.feedback_text,
        ) from None
    except SubjectGone as gone:
        if not rig.bench.subject.hangs:
            raise
        raise Failed(
            expected=EXPECTED,
            actual=f"Called {when}, it had not returned {RETURNS:.0f} s later. The node's "
            "clock stands still during the call: does it wait for that, or for a callback?",
        ) from gone
    return time.monotonic() - began
