"""What is done to the four nodes once more in a plain program, in short, and how long it takes.

All that the exam provokes is provoked there: what leaves a callback ends the program. How the nodes
deal with it is no matter here, but for the times. See `autograder.observe.program_trials`.
"""

from __future__ import annotations

import math

from rclpy.action.server import ServerGoalHandle
from std_msgs.msg import Bool

from autograder.exercises.safety import drive_server, speed_limits
from autograder.exercises.safety.drive_server import DRIVE, DRIVE_SERVER, motions, send_goal
from autograder.exercises.safety.gripper_client import GRIPPER, GRIPPER_CLIENT, HEARTBEAT, Grip
from autograder.exercises.safety.navigator_client import NAVIGATE, NAVIGATION_CLIENT, Journey
from autograder.exercises.safety.speed_limits import SET_SPEED, SPEED_SERVER
from autograder.observe.actions import ActionServerEnd, SentGoal
from autograder.observe.plain_programs import COARSE_S, ObservedProgram
from autograder.observe.program_trials import TIMED, Bounds, NodeTrials
from autograder.observe.services import ServiceServer
from autograder.observe.silences import longest_silence

SLOW_S, LATE_S = 0.7, 1.5
"""Seconds after which a try is answered, in time and too late."""
BEATS = 2
"""Heartbeats after the first, over which they are timed."""
METRES = 3
"""Of the drive that is timed: a second more or less is allowed a drive, whatever its length."""

SLOW, LATE, PAUSE, BEAT = "slow answer", "late answer", "first pause", "heartbeat"
STALL, GOAL, CANCEL = "silence", "goal without answer", "cancel without answer"
WHOLE, COMMANDS, CANCELED, ABORTED = "drive", "commands", "canceled drive", "jammed drive"


def _never() -> bool:
    return False


def _time_grips(program: ObservedProgram) -> None:
    with program.served_by(ServiceServer, GRIPPER) as gripper:
        program.forget(HEARTBEAT)
        program.advance_until(lambda: len(program.end.heard(HEARTBEAT)) > BEATS, 1.5 * BEATS)
        beats_s = [beat.at_s for beat in program.end.heard(HEARTBEAT)]
        if len(beats_s) > 1:
            program.times[BEAT] = (beats_s[-1] - beats_s[0]) / (len(beats_s) - 1)
        grip = _answer_first_try(program, gripper, SLOW_S, 2.0)
        program.times[SLOW] = len(grip.tries)
        grip = _answer_first_try(program, gripper, LATE_S, 6.0)
        program.times[LATE] = len(grip.tries)
        program.times[PAUSE] = math.inf
        if len(grip.tries) > 1:
            program.times[PAUSE] = grip.tries[1].at_s - grip.tries[0].at_s


def _answer_first_try(
    program: ObservedProgram, gripper: ServiceServer, after_s: float, most_s: float
) -> Grip:
    """Answer the first try of a grip after so many s, and the second one, if there is one."""
    grip = Grip(program, gripper, True)
    program.advance_until(lambda: grip.tries, 1.0)
    program.advance_until(_never, after_s)
    grip.tries[0].answer(success=True)
    program.advance_until(grip.has_gone_on, most_s)
    tried = grip.tries
    if len(tried) > 1:
        tried[1].answer(success=True)
        program.advance_until(lambda: grip.outcomes, 2.0)
    return grip


def _grip_without_gripper(program: ObservedProgram) -> None:
    grip = Grip(program, None, True)
    program.advance_until(lambda: grip.outcomes, 8.0)


def _grips_refused(program: ObservedProgram) -> None:
    with program.served_by(ServiceServer, GRIPPER) as gripper:
        for success in (True, False):
            grip = Grip(program, gripper, success)
            program.advance_until(lambda tried=grip: tried.tries, 1.0)  # type: ignore[misc]
            grip.tries[0].answer(success=success)
            program.advance_until(lambda said=grip: said.outcomes, 1.0)  # type: ignore[misc]


def _grip_unanswered(program: ObservedProgram) -> None:
    with program.served_by(ServiceServer, GRIPPER) as gripper:
        grip = Grip(program, gripper, True)
        program.advance_until(lambda: len(grip.tries) > 1, 3.0)
        grip.tries[1].fail()
        program.advance_until(lambda: grip.outcomes, 6.0)
        grip.tries[2].answer(success=True)
        program.advance_until(_never, COARSE_S)


def _grip_answered_late(program: ObservedProgram) -> None:
    with program.served_by(ServiceServer, GRIPPER) as gripper:
        grip = Grip(program, gripper, True)
        program.advance_until(lambda: len(grip.tries) > 1, 3.0)
        grip.tries[0].answer(success=True)
        program.advance_until(_never, COARSE_S)
        grip.tries[1].answer(success=True)
        program.advance_until(lambda: grip.outcomes, 1.0)


def _set_limits(program: ObservedProgram, *requests: speed_limits.Parameters) -> None:
    client = program.end.client_of(str(SET_SPEED), SET_SPEED.type)
    for parameters in requests:
        answer = client.call_async(speed_limits.as_message(parameters))
        program.advance_until(answer.done, 0.5)


def _limits_that_are_bad(program: ObservedProgram) -> None:
    good = [("linear", 0.3), ("angular", 0.6)]
    alone = [("linear", math.nan), ("angular", math.inf), ("linear", -0.5), ("angular", 7.0)]
    alone += [("linear", "fast"), ("warp", 0.5)]  # type: ignore[list-item]
    _set_limits(program, good, *[[parameter] for parameter in alone], [], good)


def _jam(program: ObservedProgram, jammed: bool) -> None:
    program.end.publisher(drive_server.JAMMED).publish(Bool(data=jammed))


def _limits_for_jammed_wheels(program: ObservedProgram) -> None:
    _set_limits(program, [("linear", 0.3), ("angular", math.nan)])
    for jammed, value in ((True, 0.9), (False, 0.4)):
        _jam(program, jammed)
        program.advance_until(_never, COARSE_S)
        _set_limits(program, [("linear", value)])


def _time_losses(program: ObservedProgram) -> None:
    with program.served_by(ActionServerEnd, NAVIGATE) as navigator:
        asked_s = program.now_s
        journey = Journey(program, navigator, 3, holds_cancel=True)
        program.advance_until(lambda: navigator.cancels_at_s, 5.0)
        program.times[STALL] = navigator.cancels_at_s[0] - asked_s
        program.advance_until(lambda: journey.outcomes, 3.0)
        program.times[CANCEL] = program.now_s - navigator.cancels_at_s[0]
        navigator.decide()
        program.advance_until(_never, 0.1)
        navigator.end_goal(ServerGoalHandle.canceled)
        program.advance_until(_never, 0.1)
        asked_s = program.now_s
        journey = Journey(program, navigator, 3, holds_goal=True)
        program.advance_until(lambda: journey.outcomes, 3.0)
        program.times[GOAL] = program.now_s - asked_s
        navigator.decide()
        program.advance_until(_never, 0.1)


def _goals_that_are_lost(program: ObservedProgram) -> None:
    absent = Journey(program, None, 3)
    program.advance_until(lambda: absent.outcomes, 3.0)
    with program.served_by(ActionServerEnd, NAVIGATE) as navigator:
        refused = Journey(program, navigator, 3, cancels=False)
        program.advance_until(lambda: refused.outcomes, 5.0)
        late = Journey(program, navigator, 3, holds_goal=True)
        program.advance_until(lambda: late.outcomes, 2.5)
        navigator.decide()
        program.advance_until(_never, COARSE_S)


def _goals_that_end(program: ObservedProgram) -> None:
    with program.served_by(ActionServerEnd, NAVIGATE) as navigator:
        for how in (ServerGoalHandle.succeed, ServerGoalHandle.abort):
            journey = Journey(program, navigator, 3)
            program.advance_until(lambda: navigator.goals, 1.0)
            navigator.send_feedback(sequence=[1])
            program.advance_until(_never, COARSE_S)
            navigator.end_goal(how)
            program.advance_until(lambda said=journey: said.outcomes, 1.0)  # type: ignore[misc]
        rejected = Journey(program, navigator, 3, accepts=False)
        program.advance_until(lambda: rejected.outcomes, 1.0)


def _goal_that_stalls(program: ObservedProgram) -> None:
    with program.served_by(ActionServerEnd, NAVIGATE) as navigator:
        journey = Journey(program, navigator, 3)
        program.advance_until(lambda: navigator.cancels_at_s, 4.0)
        navigator.end_goal(ServerGoalHandle.canceled)
        program.advance_until(lambda: journey.outcomes, 1.0)


def _start_drive(program: ObservedProgram, metres: int) -> SentGoal:
    goal = send_goal(program, metres)
    program.advance_until(lambda: any(motions(program)), 1.0)
    return goal


def _time_drives(program: ObservedProgram) -> None:
    def time_until_end(name: str, goal: SentGoal, most_s: float) -> None:
        began_s = program.now_s
        program.advance_until(lambda: goal.end, most_s)
        program.times[name] = program.now_s - began_s

    time_until_end(WHOLE, send_goal(program, METRES), 3.0 * METRES)
    told_s = [command.at_s for command in program.end.heard(drive_server.COMMANDS)]
    program.times[COMMANDS] = longest_silence(told_s, told_s[0], program.now_s)
    goal = _start_drive(program, 2 * METRES)
    program.end.action_client(DRIVE).cancel(goal)
    time_until_end(CANCELED, goal, 2.0)
    goal = _start_drive(program, 2 * METRES)
    _jam(program, True)
    time_until_end(ABORTED, goal, 4.0)
    _jam(program, False)
    program.advance_until(_never, 0.1)


def _drives_that_are_canceled(program: ObservedProgram) -> None:
    rejected = send_goal(program, 0)
    program.advance_until(lambda: rejected.accepted is not None, 0.5)
    goal = _start_drive(program, 5)
    program.end.action_client(DRIVE).cancel(goal)
    program.advance_until(lambda: goal.end, 1.0)


def _drives_with_jammed_wheels(program: ObservedProgram) -> None:
    goal = _start_drive(program, 3)
    _jam(program, True)
    program.advance_until(lambda: goal.end, 2.0)
    _jam(program, False)
    program.advance_until(_never, COARSE_S)
    again = send_goal(program, 1)
    program.advance_until(lambda: again.end, 3.0)


TRIALS = (
    NodeTrials(
        GRIPPER_CLIENT,
        {
            TIMED: _time_grips, "absent": _grip_without_gripper, "refused": _grips_refused,
            "unanswered": _grip_unanswered, "stale": _grip_answered_late,
        },
        {
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
        SPEED_SERVER, {"bad": _limits_that_are_bad, "atomic": _limits_for_jammed_wheels}
    ),
    NodeTrials(
        NAVIGATION_CLIENT,
        {
            TIMED: _time_losses, "lost": _goals_that_are_lost, "ended": _goals_that_end,
            "stalled": _goal_that_stalls,
        },
        {
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
        {
            TIMED: _time_drives, "canceled": _drives_that_are_canceled,
            "aborted": _drives_with_jammed_wheels,
        },
        {
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
