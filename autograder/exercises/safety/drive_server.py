"""Part D, the drive's server: good and bad goals, cancels, jams."""

from __future__ import annotations

from itertools import groupby, pairwise

from autograder.examination.exam import Failed
from autograder.exercises.safety import drive_goal, plain_program_times
from autograder.exercises.safety.navigation import Dispatcher, Drives, is_motion
from autograder.exercises.safety.node_under_test import STRIDE, Robot
from autograder.exercises.safety.rig import RobotRig

CANCEL = 0.5  # s from a cancel to the end of the drive
EARLY = 0.3  # s of a drive before its first mark
THIRD = 2.9  # s of a drive up to most of its third metre
COMMAND = 0.5  # s between two commands to the wheels
SLACK = 1.0  # s by which a drive of some seconds may be longer or shorter
BACKWARDS, TOO_FAR = (-2, -9, -1), (11, 11, 99)  # m: the usual ones, and bounds
SPEED, SPEED_TOLERANCE = 1.0, 0.05  # m/s
METRES = (4, 3, 5)  # of the drive that is watched to its end: the usual ones, and bounds


def examine_arrival(rig: RobotRig) -> None:
    """Bad goals, then one of some metres and one of 1 m."""
    with rig.run_robot(Dispatcher.SERVER, Dispatcher) as (robot, dispatcher):
        draw = robot.draws.whole
        metres = draw("metres of the drive", *METRES)
        bad = (0, draw("a goal behind", *BACKWARDS), draw("a goal too far away", *TOO_FAR))
        for order in robot.draws.shuffled("bad goals", bad):
            _require_rejection(robot, dispatcher, order)
        drive = drive_goal.start_drive(robot, dispatcher, metres)
        drive_goal.require_end(robot, drive, f"A goal of {metres} m", "succeeded", metres + SLACK)
        if dispatcher.now - drive.began < metres - SLACK:
            raise Failed(
                expected=f"A goal of {metres} m takes {metres} s, at 1 m/s.",
                actual=f"It was over after {dispatcher.now - drive.began:.1f} s.",
            )
        marks = list(range(1, metres + 1))
        if drive.result != marks:
            raise Failed(
                expected=f"The result of a goal of {metres} m is {marks}.",
                actual=f"The result was {drive.result}.",
            )
        _require_feedback(dispatcher, drive, marks)
        _require_speed(dispatcher)
        drive_goal.require_stop(robot, dispatcher, "succeeded")
        _one_metre(robot, dispatcher, "after a longer one")
    rig.require_times_unasked(Dispatcher.SERVER, plain_program_times.DRIVE)


def _one_metre(robot: Robot, dispatcher: Dispatcher, occasion: str) -> None:
    """Require that a goal of 1 m is served as usual: nothing is left of the drive before it."""
    drive = drive_goal.start_drive(robot, dispatcher, 1, occasion)
    what = f"A goal of 1 m {occasion}"
    drive_goal.require_end(robot, drive, what, "succeeded", 1.0 + SLACK)
    told = next((passed for passed in drive.feedback if passed not in ([], [1])), None)
    if told is not None or drive.result != [1]:
        raise Failed(
            expected=f"{what} has the marks [1], in its feedback and in its result.",
            actual=f"The result was {drive.result}."
            if told is None
            else f"The feedback was {told}.",
        )
    drive_goal.require_stop(robot, dispatcher, "succeeded")


def _require_rejection(robot: Robot, dispatcher: Dispatcher, order: int) -> None:
    drive = dispatcher.send(order)
    robot.run(lambda: drive.handle is not None, drive_goal.PROMPT)
    if drive.handle is None or drive.handle.accepted:
        raise Failed(
            expected=f"A goal of {order} m is rejected.",
            actual=f"It was not answered.{robot.error_note()}"
            if drive.handle is None
            else "It was accepted.",
        )
    robot.wait_for_rest()
    if any(dispatcher.speeds):
        raise Failed(
            expected=f"A goal of {order} m is rejected before anything moves.",
            actual="The wheels were told to drive.",
        )


def _require_feedback(dispatcher: Dispatcher, drive: Drives, marks: list[int]) -> None:
    """Require that marks are told as they are passed; nothing new may be told in between."""
    told = [passed for passed in drive.feedback if passed]
    due = [marks[:count] for count in marks]
    if [passed for passed, _repeated in groupby(told)] != due:
        raise Failed(
            expected=f"After each metre there is feedback: {', then '.join(map(str, due))}.",
            actual=f"The feedback was {', then '.join(map(str, drive.feedback)) or 'nothing'}.",
        )
    for passed in due[:-1]:
        ahead = dispatcher.now - drive.fed[drive.feedback.index(passed)]
        before = len(marks) - len(passed)
        if ahead < before / 2:
            raise Failed(
                expected=f"The feedback comes on the way: {passed} {before} s before the goal of "
                f"{len(marks)} m ends.",
                actual=f"It came {ahead:.1f} s before the end.",
            )


def _require_speed(dispatcher: Dispatcher) -> None:
    for command in dispatcher.commands:
        x, turn = command.linear.x, command.angular.z
        if is_motion(command) and not (abs(x - SPEED) <= SPEED_TOLERANCE and turn == 0.0):
            turning = f", turning at {turn:g} rad/s" if turn else ""
            raise Failed(
                expected=f"On the way the robot is told to drive straight on at {SPEED:g} m/s.",
                actual=f"It was told to drive at {x:g} m/s{turning}.",
            )


def examine_cancels(rig: RobotRig) -> None:
    """Drives that are canceled when a metre has just begun, and before the first mark."""
    with rig.run_robot(Dispatcher.SERVER, Dispatcher) as (robot, dispatcher):
        drive = drive_goal.start_drive(robot, dispatcher, drive_goal.LONGEST)
        # Who looks for a cancel at each mark only has then most of a metre before the next look.
        robot.run(lambda: any(drive.feedback), 1.0 + SLACK)
        robot.spend_time(STRIDE)
        _cancel_drive(robot, dispatcher, drive, "A canceled goal")
        drive = drive_goal.start_drive(robot, dispatcher, 1, "after a canceled one")
        robot.spend_time(EARLY)
        _cancel_drive(robot, dispatcher, drive, "A goal that is canceled before the first mark")
        _one_metre(robot, dispatcher, "after two canceled ones")
        robot.require_no_errors("canceled")
    rig.require_times_unasked(Dispatcher.SERVER, plain_program_times.CANCELED)


def _cancel_drive(robot: Robot, dispatcher: Dispatcher, drive: Drives, what: str) -> None:
    """Cancel a drive; require that it ends so, and that the robot stands."""
    dispatcher.cancel(drive)
    robot.run(lambda: drive.canceling is not None, CANCEL)
    if not drive.canceling:
        raise Failed(
            expected="A request to cancel is accepted.",
            actual="It was refused."
            if drive.canceling is False
            else f"It was not answered.{robot.error_note()}",
        )
    drive_goal.require_end(robot, drive, what, "canceled", CANCEL)
    drive_goal.require_stop(robot, dispatcher, "been canceled")


def examine_jams(rig: RobotRig) -> None:
    """The wheels jam on the way, are jammed for the next goal too, and come loose."""
    with rig.run_robot(Dispatcher.SERVER, Dispatcher) as (robot, dispatcher):
        drive = drive_goal.start_drive(robot, dispatcher, drive_goal.LONG)
        robot.spend_time(THIRD)  # so long that a node is seen to go on as it began
        jammed = dispatcher.now
        dispatcher.jam_wheels(True)
        # They raise at the next command.
        drive_goal.require_end(
            robot, drive, "A goal whose wheels jam", "aborted", COMMAND + drive_goal.ABORT
        )
        drive_goal.require_stop(robot, dispatcher, "been aborted")
        _require_reason(robot, dispatcher, "The goal")
        _require_commands(dispatcher, jammed)
        _jammed_from_the_start(robot, dispatcher)
        dispatcher.jam_wheels(False)
        robot.wait_for_rest()
        _one_metre(robot, dispatcher, "after the jam, with free wheels,")
        robot.require_no_errors("aborted")
    rig.require_times_unasked(
        Dispatcher.SERVER, plain_program_times.ABORTED, plain_program_times.COMMANDS
    )


def _jammed_from_the_start(robot: Robot, dispatcher: Dispatcher) -> None:
    """Send a goal while the wheels are jammed: the first command raises, not one on the way."""
    what = "A goal whose wheels are jammed from the start"
    drive = drive_goal.send_goal(robot, dispatcher, 1, "while the wheels are jammed")
    drive_goal.require_end(robot, drive, what, "aborted", drive_goal.ABORT)
    _require_reason(robot, dispatcher, what)
    drive_goal.require_stop(robot, dispatcher, "been aborted, jammed from the start")


def _require_reason(robot: Robot, dispatcher: Dispatcher, what: str) -> None:
    """Require that whoever looks at drive/fault learns why the goal was aborted."""
    if not any(fault.strip() for fault in dispatcher.faults):
        came = "what came on drive/fault was empty"
        if not dispatcher.faults:
            came = "nothing came on drive/fault"
        raise Failed(
            expected="The reason is published on drive/fault, in words.",
            actual=f"{what} was aborted, and {came}.{robot.error_note()}",
        )


def _require_commands(dispatcher: Dispatcher, jammed: float) -> None:
    """Require commands so often that a jam is noticed: until the wheels jammed, that is."""
    times = [at for at in dispatcher.told if at <= jammed]
    silence = max(after - before for before, after in pairwise([*times, jammed]))
    if silence > COMMAND + drive_goal.TOLERANCE:
        raise Failed(
            expected=f"On the way the wheels get a command at least every {COMMAND:g} s: they "
            "notice a jam only then.",
            actual=f"For {silence:.1f} s nothing came on cmd_vel.",
        )
