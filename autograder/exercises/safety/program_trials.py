"""What is done to the four nodes once more in a plain program, in short, and how long it takes.

All that the exam provokes is provoked there: what leaves a callback ends the program. How the nodes
deal with it is no matter here, but for the times. See
`autograder.observe.several_nodes.program_trials`.
"""

from __future__ import annotations

import math

from rclpy.action.server import ServerGoalHandle
from std_msgs.msg import Bool

from autograder.exercises.safety import drive_server, speed_limits
from autograder.exercises.safety.drive_server import DRIVE, DRIVE_SERVER, motions
from autograder.exercises.safety.gripper_client import GRIPPER, GRIPPER_CLIENT, HEARTBEAT, Grip
from autograder.exercises.safety.navigator_client import NAVIGATE, NAVIGATION_CLIENT, Journey
from autograder.exercises.safety.speed_limits import SET_SPEED, SPEED_SERVER
from autograder.observe.examiner.actions import ActionServerEnd, SentGoal
from autograder.observe.examiner.services import Request, ServiceServer
from autograder.observe.several_nodes.heartbeats import longest_silence
from autograder.observe.several_nodes.plain_programs import ObservedProgram
from autograder.observe.several_nodes.program_trials import Bounds, NodeTrials, served

SLOW_S, LATE_S = 0.7, 1.5  # after which a try is answered, in time and too late
BEATS = 2  # after the first, over which they are timed
METRES = 3  # of the drive that is timed: a second more or less is allowed, whatever its length

SLOW, LATE, PAUSE, BEAT = "slow answer", "late answer", "first pause", "heartbeat"
STALL, GOAL, CANCEL = "silence", "goal without answer", "cancel without answer"
WHOLE, COMMANDS, CANCELED, ABORTED = "drive", "commands", "canceled drive", "jammed drive"


def _grips_answered(program: ObservedProgram, gripper: ServiceServer) -> None:
    program.forget(HEARTBEAT)
    program.advance_until(lambda: len(program.end.heard(HEARTBEAT)) > BEATS, 1.5 * BEATS)
    beats_s = [beat.at_s for beat in program.end.heard(HEARTBEAT)]
    if len(beats_s) > 1:
        program.times[BEAT] = (beats_s[-1] - beats_s[0]) / (len(beats_s) - 1)
    program.times[SLOW] = len(_answer_first_try(program, gripper, SLOW_S, 2.0))


def _grips_answered_late(program: ObservedProgram, gripper: ServiceServer) -> None:
    tries = _answer_first_try(program, gripper, LATE_S, 6.0)
    program.times[LATE] = len(tries)
    program.times[PAUSE] = tries[1].at_s - tries[0].at_s if len(tries) > 1 else math.inf


def _answer_first_try(
    program: ObservedProgram, gripper: ServiceServer, after_s: float, most_s: float
) -> list[Request]:
    """Answer the first try of a grip after so many s, and the second one, if there is one."""
    grip = Grip(program, gripper, True)
    program.advance_until(grip.has_begun, 1.0)
    program.advance(after_s)
    grip.tries[0].answer(success=True)
    program.advance_until(grip.has_gone_on, most_s)
    tries = grip.tries
    if len(tries) > 1:
        tries[1].answer(success=True)
        program.advance_until(grip.is_over, 2.0)
    return tries


def _grip_without_gripper(program: ObservedProgram) -> None:
    program.advance_until(Grip(program, None, True).is_over, 8.0)


def _grips_refused(program: ObservedProgram, gripper: ServiceServer) -> None:
    for success in (True, False):
        grip = Grip(program, gripper, success)
        program.advance_until(grip.has_begun, 1.0)
        grip.tries[0].answer(success=success)
        program.advance_until(grip.is_over, 1.0)


def _grip_unanswered(program: ObservedProgram, gripper: ServiceServer) -> None:
    grip = Grip(program, gripper, True)
    program.advance_until(grip.has_gone_on, 3.0)
    grip.tries[1].fail()
    program.advance_until(grip.is_over, 6.0)
    grip.tries[2].answer(success=True)
    program.advance()


def _set_limits(program: ObservedProgram, *requests: speed_limits.Parameters) -> None:
    client = program.end.client_of(str(SET_SPEED), SET_SPEED.type)
    for parameters in requests:
        messages = speed_limits.as_messages(parameters)
        answer = client.call_async(SET_SPEED.type.Request(parameters=messages))
        program.advance_until(answer.done, 0.5)


def _limits_that_are_bad(program: ObservedProgram) -> None:
    good = [("linear", 0.3), ("angular", 0.6)]
    bad = [*good, ("linear", math.nan), ("angular", math.inf), ("linear", -0.5), ("angular", 7.0)]
    _set_limits(program, *([limit] for limit in bad), [("linear", "fast")], [("warp", 0.5)], [])
    _set_limits(program, good)


def _limits_for_jammed_wheels(program: ObservedProgram) -> None:
    _set_limits(program, [("linear", 0.3), ("angular", math.nan)])
    for jammed, value in ((True, 0.9), (False, 0.4)):
        _jam(program, jammed)
        _set_limits(program, [("linear", value)])


def _jam(program: ObservedProgram, jammed: bool) -> None:
    program.end.publisher(drive_server.JAMMED).publish(Bool(data=jammed))
    program.advance()


def _goals_that_are_lost(program: ObservedProgram, navigator: ActionServerEnd) -> None:
    asked_s = program.now_s
    journey = Journey(program, navigator, 3, holds_cancel=True)
    program.advance_until(lambda: navigator.cancels_at_s, 5.0)
    program.times[STALL] = navigator.cancels_at_s[0] - asked_s
    program.advance_until(journey.is_over, 3.0)
    program.times[CANCEL] = program.now_s - navigator.cancels_at_s[0]
    navigator.decide()
    program.advance()
    navigator.end_goal(ServerGoalHandle.canceled)
    program.advance()
    asked_s = program.now_s
    journey = Journey(program, navigator, 3, holds_goal=True)
    program.advance_until(journey.is_over, 3.0)
    program.times[GOAL] = program.now_s - asked_s
    navigator.decide()
    program.advance()
    program.advance_until(Journey(program, navigator, 3, cancels=False).is_over, 5.0)


def _goal_without_navigator(program: ObservedProgram) -> None:
    program.advance_until(Journey(program, None, 3).is_over, 3.0)


def _goals_that_end(program: ObservedProgram, navigator: ActionServerEnd) -> None:
    for how in (ServerGoalHandle.succeed, ServerGoalHandle.abort):
        journey = Journey(program, navigator, 3)
        program.advance_until(lambda: navigator.goals, 1.0)
        navigator.send_feedback(sequence=[1])
        program.advance()
        navigator.end_goal(how)
        program.advance_until(journey.is_over, 1.0)
    program.advance_until(Journey(program, navigator, 3, accepts=False).is_over, 1.0)


def _goal_that_stalls(program: ObservedProgram, navigator: ActionServerEnd) -> None:
    journey = Journey(program, navigator, 3)
    program.advance_until(lambda: navigator.cancels_at_s, 4.0)
    navigator.end_goal(ServerGoalHandle.canceled)
    program.advance_until(journey.is_over, 1.0)


def _start_drive(program: ObservedProgram, metres: int) -> SentGoal:
    program.forget(drive_server.COMMANDS)
    goal = program.end.action_client(DRIVE).send(order=metres)
    program.advance_until(lambda: any(motions(program)), 1.0)
    return goal


def _time_until_end(program: ObservedProgram, goal: SentGoal, most_s: float) -> float:
    began_s = program.now_s
    program.advance_until(lambda: goal.end, most_s)
    return program.now_s - began_s


def _drives_that_arrive(program: ObservedProgram) -> None:
    asked_s = program.now_s
    goal = _start_drive(program, METRES)
    _time_until_end(program, goal, 3.0 * METRES)
    program.times[WHOLE] = program.now_s - asked_s
    told_s = [command.at_s for command in program.end.heard(drive_server.COMMANDS)]
    program.times[COMMANDS] = longest_silence(told_s, told_s[0], program.now_s)


def _drives_that_are_canceled(program: ObservedProgram) -> None:
    program.end.action_client(DRIVE).send(order=0)
    program.advance()
    goal = _start_drive(program, 2 * METRES)
    program.end.action_client(DRIVE).cancel(goal)
    program.times[CANCELED] = _time_until_end(program, goal, 2.0)


def _drives_with_jammed_wheels(program: ObservedProgram) -> None:
    goal = _start_drive(program, 2 * METRES)
    jammed_s = program.now_s
    _jam(program, True)
    _time_until_end(program, goal, 4.0)
    program.times[ABORTED] = program.now_s - jammed_s
    _jam(program, False)
    _time_until_end(program, _start_drive(program, 1), 3.0)


TRIALS = (
    NodeTrials(
        GRIPPER_CLIENT,
        timed={
            "answered": served(_grips_answered, ServiceServer, GRIPPER),
            "stale": served(_grips_answered_late, ServiceServer, GRIPPER),
        },
        untimed={
            "absent": _grip_without_gripper,
            "refused": served(_grips_refused, ServiceServer, GRIPPER),
            "unanswered": served(_grip_unanswered, ServiceServer, GRIPPER),
        },
        bounds={
            SLOW: Bounds(
                f"An answer after {SLOW_S:g} s is in time: one try is enough.", 1, 1,
                "the gripper was called {:.0f} times",
            ),
            LATE: Bounds(
                f"A try has 1 s. The answer to the first try comes {LATE_S:g} s after it, and is "
                "ignored.", 2, math.inf, "it was taken for a present answer",
            ),
            PAUSE: Bounds(
                "The second try comes 1.5 s after the first, or later.", 1.05, math.inf,
                "it came {:.2g} s after the first",
            ),
            BEAT: Bounds(
                "There is a heartbeat every 0.5 s.", 0.27, 0.85, "there was one every {:.2g} s"
            ),
        },
    ),
    NodeTrials(
        SPEED_SERVER, untimed={"bad": _limits_that_are_bad, "atomic": _limits_for_jammed_wheels}
    ),
    NodeTrials(
        NAVIGATION_CLIENT,
        timed={"lost": served(_goals_that_are_lost, ActionServerEnd, NAVIGATE)},
        untimed={
            "absent": _goal_without_navigator,
            "ended": served(_goals_that_end, ActionServerEnd, NAVIGATE),
            "stalled": served(_goal_that_stalls, ActionServerEnd, NAVIGATE),
        },
        bounds={
            STALL: Bounds(
                "The goal is canceled 2 s after its acceptance, with no feedback since then.",
                1.5, 3.0, "the request to cancel came after {:.1f} s",
            ),
            GOAL: Bounds(
                "When the navigator has not answered the goal for 1 s, the outcome is “lost”.",
                0.7, 1.6, "it came after {:.1f} s",
            ),
            CANCEL: Bounds(
                "When the navigator has not answered the request to cancel for 1 s, the outcome is "
                "“lost”.", 0.7, 1.6, "it came after {:.1f} s",
            ),
        },
    ),
    NodeTrials(
        DRIVE_SERVER,
        timed={
            "arrived": _drives_that_arrive, "canceled": _drives_that_are_canceled,
            "aborted": _drives_with_jammed_wheels,
        },
        bounds={
            WHOLE: Bounds(
                f"A goal of {METRES} m takes {METRES} s, at 1 m/s.", METRES - 1.1, METRES + 1.8,
                "it took {:.1f} s",
            ),
            COMMANDS: Bounds(
                "On the way the wheels get a command at least every 0.5 s.", 0.0, 0.9,
                "for {:.1f} s nothing came on cmd_vel",
            ),
            CANCELED: Bounds(
                "A canceled goal is over within 0.5 s.", 0.0, 0.9, "it took {:.1f} s"
            ),
            ABORTED: Bounds(
                "A goal whose wheels jam is over 1 s after the next command, which comes within "
                "0.5 s.", 0.0, 1.9, "it took {:.1f} s",
            ),
        },
    ),
)  # fmt: skip
