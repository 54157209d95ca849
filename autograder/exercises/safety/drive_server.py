"""Part D, the drive's server: a goal that the examiner sends, its end, and a stop."""

from __future__ import annotations

from itertools import groupby

from geometry_msgs.msg import Twist
from std_msgs.msg import Bool, String
from test_msgs.action import Fibonacci as Drive

from autograder.exercises.safety.speed_limits import is_motion
from autograder.observe import Action, Task, Topic
from autograder.observe.examiner.actions import SentGoal
from autograder.observe.several_nodes.clock_bound_node import ClockBoundNode
from autograder.observe.several_nodes.heartbeats import longest_silence
from autograder.observe.several_nodes.observed_goal import ObservedGoal
from autograder.observe.several_nodes.plain_programs import Clocked

COMMANDS = Topic("cmd_vel", Twist)
FAULTS = Topic("drive/fault", String, value=lambda message: message.data)
JAMMED = Topic("hardware/jammed", Bool)
DRIVE = Action("drive", Drive)
DRIVE_SERVER = Task(
    "NavigationServer", publishes=[COMMANDS, FAULTS], subscribes=[JAMMED], serves=[DRIVE], threads=4
)

PROMPT_S = 1.0  # for an answer
STOP_S = 0.5  # from the end of a drive to the stop
CANCEL_S = 0.5  # from a cancel to the end of the drive
ABORT_S = 1.0  # from wheels that raise, or a shutdown, to the end of the drive
COMMAND_S = 0.5  # between two commands to the wheels
TOLERANCE_S = 0.25  # what the task allows, and strides
SLACK_S = 1.0  # by which a drive of some seconds may be longer or shorter
SPEED_M_S, SPEED_TOLERANCE_M_S = 1.0, 0.05
LONG_M, LONGEST_M = 8, 10  # of a drive that is still under way when something happens
AFTERWARDS_M = 2  # of a goal that comes after shutdown(), and s in which it would drive


def motions(node: Clocked) -> list[bool]:
    """Return of each command to the wheels so far whether it was more than a stop."""
    return [is_motion(command) for command in node.end.values(COMMANDS)]


def send_goal(node: ClockBoundNode, metres: int, occasion: str = "") -> ObservedGoal:
    """Send a goal, and forget what was before; ``occasion`` says what that was, if it matters."""
    node.forget(COMMANDS, FAULTS)
    return ObservedGoal(node, DRIVE, f"A goal of {metres} m {occasion}".rstrip(), order=metres)


def start_drive(node: ClockBoundNode, metres: int, occasion: str = "") -> ObservedGoal:
    """Send a goal, and require that it is accepted, and that the robot moves."""
    goal = send_goal(node, metres, occasion)
    goal.require_accepted(PROMPT_S)
    node.require_that(
        node.advance_until(lambda: any(motions(node)), PROMPT_S),
        f"With a{goal.what[1:]} the robot drives: cmd_vel is not zero.",
        "The goal was accepted, and the wheels were never told to drive.",
    )
    return goal


def require_rejection(node: ClockBoundNode, metres: int) -> None:
    """Require that a goal is rejected before anything moves."""
    goal = send_goal(node, metres)
    goal.require_rejected(PROMPT_S)
    node.rest()
    node.require_that(
        not any(motions(node)),
        f"{goal.what} is rejected before anything moves.",
        "The wheels were told to drive.",
    )


def require_stop(node: ClockBoundNode) -> None:
    """Require that the last command is a stop, and stays the last."""
    node.advance(STOP_S + TOLERANCE_S)
    moved = motions(node)
    node.require_that(
        moved[-1:] == [False],
        f"Within {STOP_S:g} s after the end of a drive, however it ended, the last Twist on "
        "cmd_vel is zero.",
        "The last one told the robot to drive." if moved else "No Twist came at all.",
    )


def require_marks(node: ClockBoundNode, sent: SentGoal, metres: int) -> None:
    """Require that marks are told as they are passed; nothing new may be told in between."""
    marks = list(range(1, metres + 1))
    node.require_that(
        list(sent.result.sequence) == marks,
        f"The result of a goal of {metres} m is {marks}.",
        f"The result was {list(sent.result.sequence)}.",
    )
    told = [list(feedback.sequence) for feedback in sent.feedback]
    due = [marks[:count] for count in marks]
    node.require_that(
        [passed for passed, _repeated in groupby(filter(None, told))] == due,
        f"After each metre there is feedback: {', then '.join(map(str, due))}.",
        f"The feedback was {', then '.join(map(str, told)) or 'nothing'}.",
    )
    for passed in due[:-1]:
        ahead_s = node.now_s - sent.feedback_at_s[told.index(passed)]
        before_s = metres - len(passed)
        node.require_that(
            ahead_s >= before_s / 2,
            f"The feedback comes on the way: {passed} {before_s} s before the goal of {metres} m "
            "ends.",
            f"It came {ahead_s:.1f} s before the end.",
        )


def require_speed(node: ClockBoundNode) -> None:
    """Require that the wheels were told to drive straight on, at 1 m/s."""
    for command in node.end.values(COMMANDS):
        x, turn = command.linear.x, command.angular.z
        turning = f", turning at {turn:g} rad/s" if turn else ""
        is_right = abs(x - SPEED_M_S) <= SPEED_TOLERANCE_M_S and turn == 0.0
        node.require_that(
            is_right or not is_motion(command),
            f"On the way the robot is told to drive straight on at {SPEED_M_S:g} m/s.",
            f"It was told to drive at {x:g} m/s{turning}.",
        )


def require_one_metre(node: ClockBoundNode, occasion: str) -> None:
    """Require that a goal of 1 m is served as usual: nothing is left of the drive before it."""
    goal = start_drive(node, 1, occasion)
    goal.require_end("succeeded", 1.0 + SLACK_S, TOLERANCE_S)
    told = [list(message.sequence) for message in (*goal.sent.feedback, goal.sent.result)]
    wrong = [marks for marks in told[:-1] if marks not in ([], [1])]
    node.require_that(
        not wrong and told[-1] == [1],
        f"{goal.what} has the marks [1], in its feedback and in its result.",
        f"The feedback was {wrong[0]}." if wrong else f"The result was {told[-1]}.",
    )
    require_stop(node)


def cancel_drive(node: ClockBoundNode, goal: ObservedGoal, what: str) -> None:
    """Cancel a drive; require that it ends so, and that the robot stands."""
    goal.require_cancel_accepted(CANCEL_S)
    goal.what = what
    goal.require_end("canceled", CANCEL_S, TOLERANCE_S)
    require_stop(node)


def require_abort(node: ClockBoundNode, goal: ObservedGoal, what: str, within_s: float) -> None:
    """Require that a drive is aborted, that the robot stands, and that drive/fault says why."""
    goal.what = what
    goal.require_end("aborted", within_s, TOLERANCE_S)
    faults = node.end.values(FAULTS)
    came = "what came on drive/fault was empty" if faults else "nothing came on drive/fault"
    node.require_that(
        any(fault.strip() for fault in faults),
        "The reason is published on drive/fault, in words.",
        f"{what} was aborted, and {came}.",
    )
    require_stop(node)


def require_commands(node: ClockBoundNode, until_s: float) -> None:
    """Require commands so often that a jam is noticed, from the first one until a time."""
    times_s = [command.at_s for command in node.end.heard(COMMANDS)]
    silence_s = longest_silence(times_s, min(times_s), until_s)
    node.require_that(
        silence_s <= COMMAND_S + TOLERANCE_S,
        f"On the way the wheels get a command at least every {COMMAND_S:g} s: they notice a jam "
        "only then.",
        f"For {silence_s:.1f} s nothing came on cmd_vel.",
    )


def drives_afterwards(node: Clocked) -> bool:
    """Send a goal after shutdown(): whatever is answered, return whether anything moves."""
    node.forget(COMMANDS)
    goal = node.end.action_client(DRIVE).send(order=AFTERWARDS_M)
    node.advance_until(
        lambda: goal.accepted is False or goal.end or any(motions(node)), AFTERWARDS_M
    )
    return any(motions(node))
