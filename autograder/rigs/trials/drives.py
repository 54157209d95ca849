"""Part D, the drive's server: good and bad goals, cancels, jams, a shutdown on the way."""

# mypy: allow-untyped-calls
# rclpy leaves most of its functions untyped.

from __future__ import annotations

from itertools import groupby, pairwise

from action_msgs.msg import GoalStatus

from autograder.bench import StudentError
from autograder.exam import Failed
from autograder.rigs.navigation import Dispatcher, Drives, moves
from autograder.rigs.safety import STRIDE, Robot, RobotRig

PROMPT = 1.0  # s for an answer
STOP = 0.5  # s from the end of a drive to the stop
CANCEL = 0.5  # s from a cancel to the end of the drive
COMMAND = 0.5  # s between two commands to the wheels
ABORT = 1.0  # s from a jam to the end of the drive
TOLERANCE = 0.25  # s: what the task allows, and strides
SLACK = 1.0  # s by which a drive of some seconds may be longer or shorter
BAD = (0, -2, 11)
SPEED, SPEED_TOLERANCE = 1.0, 0.05  # m/s
LONG, LONGEST = 8, 10  # m: what is still under way when something happens

WORDS = {
    GoalStatus.STATUS_SUCCEEDED: "succeeded",
    GoalStatus.STATUS_CANCELED: "canceled",
    GoalStatus.STATUS_ABORTED: "aborted",
}


def arrives(rig: RobotRig) -> None:
    """Bad goals, then one of 2 m and one of 1 m."""
    with rig.robot(Dispatcher.SERVER, Dispatcher) as (robot, dispatcher):
        for order in BAD:
            _rejected(robot, dispatcher, order)
        drive = _driving(robot, dispatcher, 2)
        _ends(robot, drive, "A goal of 2 m", "succeeded", 2.0 + SLACK)
        if dispatcher.now - drive.began < 2.0 - SLACK:
            raise Failed(
                expected="A goal of 2 m takes 2 s, at 1 m/s.",
                actual=f"It was over after {dispatcher.now - drive.began:.1f} s.",
            )
        if drive.result != [1, 2]:
            raise Failed(
                expected="The result of a goal of 2 m is [1, 2].",
                actual=f"The result was {drive.result}.",
            )
        _require_feedback(dispatcher, drive)
        _require_speed(dispatcher)
        _stands(robot, dispatcher, "succeeded")
        drive = _driving(robot, dispatcher, 1)
        _ends(robot, drive, "A goal of 1 m, the next one,", "succeeded", 1.0 + SLACK)
        if drive.result != [1]:
            raise Failed(
                expected="The result of a goal of 1 m is [1], whatever was driven before.",
                actual=f"The result was {drive.result}.",
            )


def _require_feedback(dispatcher: Dispatcher, drive: Drives) -> None:
    """Require that marks are told as they are passed; nothing new may be told in between."""
    told = [marks for marks in drive.feedback if marks]
    if [marks for marks, _repeated in groupby(told)] != [[1], [1, 2]]:
        raise Failed(
            expected="After each metre there is feedback: [1], then [1, 2].",
            actual=f"The feedback was {', then '.join(map(str, drive.feedback)) or 'nothing'}.",
        )
    ahead = dispatcher.now - drive.fed[drive.feedback.index([1])]
    if ahead < SLACK / 2:
        raise Failed(
            expected="The feedback comes on the way: [1] a second before the goal of 2 m ends.",
            actual=f"It came {ahead:.1f} s before the end.",
        )


def _require_speed(dispatcher: Dispatcher) -> None:
    for command in dispatcher.commands:
        x, turn = command.linear.x, command.angular.z
        if moves(command) and not (abs(x - SPEED) <= SPEED_TOLERANCE and turn == 0.0):
            turning = f", turning at {turn:g} rad/s" if turn else ""
            raise Failed(
                expected=f"On the way the robot is told to drive straight on at {SPEED:g} m/s.",
                actual=f"It was told to drive at {x:g} m/s{turning}.",
            )


def canceled(rig: RobotRig) -> None:
    """The longest drive, which is canceled when a metre has just begun, and another one."""
    with rig.robot(Dispatcher.SERVER, Dispatcher) as (robot, dispatcher):
        drive = _driving(robot, dispatcher, LONGEST)
        # Who looks for a cancel at each mark only has then most of a metre before the next look.
        robot.run(lambda: any(drive.feedback), 1.0 + SLACK)
        robot.spend(STRIDE)
        dispatcher.cancel(drive)
        robot.run(lambda: drive.canceling is not None, CANCEL)
        if not drive.canceling:
            raise Failed(
                expected="A request to cancel is accepted.",
                actual="It was refused."
                if drive.canceling is False
                else f"It was not answered.{robot.complaint()}",
            )
        _ends(robot, drive, "A canceled goal", "canceled", CANCEL)
        _stands(robot, dispatcher, "been canceled")
        drive = _driving(robot, dispatcher, 1, "after a canceled one")
        _ends(robot, drive, "The goal after a canceled one", "succeeded", 1.0 + SLACK)


def aborted(rig: RobotRig) -> None:
    """The wheels jam on the way, are jammed for the next goal too, and come loose."""
    with rig.robot(Dispatcher.SERVER, Dispatcher) as (robot, dispatcher):
        drive = _driving(robot, dispatcher, LONG)
        robot.spend(1.5)
        jammed = dispatcher.now
        dispatcher.jam(True)
        _ends(robot, drive, "A goal whose wheels jam", "aborted", ABORT)
        _stands(robot, dispatcher, "been aborted")
        _require_reason(robot, dispatcher, "The goal")
        _require_commands(dispatcher, jammed)
        _jammed_from_the_start(robot, dispatcher)
        dispatcher.jam(False)
        robot.rest()
        drive = _driving(robot, dispatcher, 1, "after the jam, with free wheels,")
        _ends(robot, drive, "A goal of 1 m after the jam", "succeeded", 1.0 + SLACK)
        _stands(robot, dispatcher, "succeeded")
        robot.require_no_errors()


def _jammed_from_the_start(robot: Robot, dispatcher: Dispatcher) -> None:
    """Send a goal while the wheels are jammed: the first command raises, not one on the way."""
    what = "A goal whose wheels are jammed from the start"
    drive = _accepted(robot, dispatcher, 1, "while the wheels are jammed")
    _ends(robot, drive, what, "aborted", ABORT)
    robot.spend(STOP)
    _require_reason(robot, dispatcher, what)


def _require_reason(robot: Robot, dispatcher: Dispatcher, what: str) -> None:
    """Require that whoever looks at drive/fault learns why the goal was aborted."""
    if not any(fault.strip() for fault in dispatcher.faults):
        raise Failed(
            expected="The reason is published on drive/fault, in words.",
            actual=f"{what} was aborted, and nothing came on drive/fault.{robot.complaint()}",
        )


def _require_commands(dispatcher: Dispatcher, jammed: float) -> None:
    """Require commands so often that a jam is noticed: until the wheels jammed, that is."""
    times = [at for at in dispatcher.told if at <= jammed]
    silence = max(after - before for before, after in pairwise([*times, jammed]))
    if silence > COMMAND + TOLERANCE:
        raise Failed(
            expected=f"On the way the wheels get a command at least every {COMMAND:g} s: they "
            "notice a jam only then.",
            actual=f"For {silence:.1f} s nothing came on cmd_vel.",
        )


def shutdown(rig: RobotRig) -> None:
    """The node is about to be taken down, on the way, and then while nothing is under way."""
    with rig.robot(Dispatcher.SERVER, Dispatcher) as (robot, dispatcher):
        drive = _driving(robot, dispatcher, LONG)
        robot.spend(0.5)
        _shut_down(rig, "in the middle of a drive")
        robot.rest()
        if dispatcher.speeds[-1]:
            raise Failed(
                expected="shutdown() stops the robot at once.",
                actual="After the call the last Twist on cmd_vel told the robot to drive.",
            )
        _ends(robot, drive, "A goal under way at shutdown()", "aborted", ABORT)
        _stands(robot, dispatcher, "been aborted")
    rig.renew()
    with rig.robot(Dispatcher.SERVER, Dispatcher):
        _shut_down(rig, "while no goal is under way")


def _shut_down(rig: RobotRig, when: str) -> None:
    try:
        rig.bench.subject.call(Dispatcher.SERVER, "shutdown")
    except StudentError as error:
        raise Failed(
            expected=f"{Dispatcher.SERVER} has a method shutdown() that does not raise {when}.",
            actual=error.told,
        ) from None


def _accepted(robot: Robot, dispatcher: Dispatcher, metres: int, occasion: str = "") -> Drives:
    """Send a goal, and wait until it is accepted.

    ``occasion`` says what went before it, if that matters.
    """
    drive = dispatcher.send(metres)
    drive.began = dispatcher.now
    robot.run(lambda: drive.handle is not None, PROMPT)
    if drive.handle is None or not drive.handle.accepted:
        raise Failed(
            expected=f"A {_goal(metres, occasion)} is accepted.",
            actual=f"It was not answered.{robot.complaint()}"
            if drive.handle is None
            else "It was rejected.",
        )
    return drive


def _goal(metres: int, occasion: str) -> str:
    return f"goal of {metres} m {occasion}".rstrip()


def _driving(robot: Robot, dispatcher: Dispatcher, metres: int, occasion: str = "") -> Drives:
    """Send a goal, and wait until it is accepted and the robot moves."""
    drive = _accepted(robot, dispatcher, metres, occasion)
    if not robot.run(lambda: any(dispatcher.speeds), PROMPT):
        raise Failed(
            expected=f"With a {_goal(metres, occasion)} the robot drives: cmd_vel is not zero.",
            actual=f"The goal was accepted, and the wheels were never told to drive."
            f"{robot.complaint()}",
        )
    return drive


def _rejected(robot: Robot, dispatcher: Dispatcher, order: int) -> None:
    drive = dispatcher.send(order)
    robot.run(lambda: drive.handle is not None, PROMPT)
    if drive.handle is None or drive.handle.accepted:
        raise Failed(
            expected=f"A goal of {order} m is rejected.",
            actual=f"It was not answered.{robot.complaint()}"
            if drive.handle is None
            else "It was accepted.",
        )
    robot.rest()
    if any(dispatcher.speeds):
        raise Failed(
            expected=f"A goal of {order} m is rejected before anything moves.",
            actual="The wheels were told to drive.",
        )


def _ends(robot: Robot, drive: Drives, what: str, how: str, limit: float) -> None:
    if not robot.run(lambda: drive.status is not None, limit + TOLERANCE):
        raise Failed(
            expected=f"{what} is over, and {how}, within {limit:g} s.",
            actual=f"After that time there was no result.{robot.complaint()}",
        )
    assert drive.status is not None
    if WORDS.get(drive.status) != how:
        raise Failed(
            expected=f"{what} ends as {how}.",
            actual=f"It ended as {WORDS.get(drive.status, 'unknown')}.{robot.complaint()}",
        )


def _stands(robot: Robot, dispatcher: Dispatcher, how: str) -> None:
    """Require that the last command is a stop, and stays the last."""
    robot.spend(STOP)
    if not dispatcher.speeds or dispatcher.speeds[-1]:
        raise Failed(
            expected=f"Within {STOP:g} s after the drive has {how}, the last Twist on cmd_vel is "
            "zero.",
            actual="The last one told the robot to drive.",
        )
