"""Part C, the navigator's client: goals that end, stall, cannot be stopped, or get lost."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise

from rclpy.action.server import ServerGoalHandle

from autograder.examination.exam import Failed
from autograder.exercises.safety import plain_program_times
from autograder.exercises.safety.counterpart import following_phrase
from autograder.exercises.safety.navigation import NavigatorUser, services_of
from autograder.exercises.safety.node_under_test import COARSE, STRIDE, Robot
from autograder.exercises.safety.rig import RobotRig, run_server

NAVIGATOR = {"services": services_of("navigate")}

PROMPT = 1.0  # s for an outcome that is clear; a node may look for it by a timer
SILENCE = 2.0  # s without feedback after which a drive is canceled
ANSWER = 1.0  # s that an answer may take
BREATH = 1.5  # s between the feedbacks of a navigator that is slow, not dead
ALLOWED = 0.2  # s more or less that do no harm
TOLERANCE = ALLOWED + STRIDE  # s: what the task allows, and a node that looks by a timer
AFTER = 2.5  # s in which a second outcome would show
METRES = (3, 2, 7)  # of a drive whose length does not matter: the usual ones, and bounds
FAR = (40, 20, 90)  # m
# Marks in the feedbacks of a slow drive, which takes longer than anyone would wait for the whole.
# Once it stands still in between: the same feedback again is a sign of life, too.
BREATHS = (1, 2, 3, 3, 4, 5, 6, 7)
HESITATION = 0.7  # s that an answer takes which is slow, but in time whatever the tolerance
APART = 0.5  # s from one goal to another, whose answer takes so long that the first's 1 s is over


@contextmanager
def _run_client(rig: RobotRig, navigator: bool = True) -> Iterator[tuple[Robot, NavigatorUser]]:
    with rig.run_robot(NavigatorUser.CLIENT, NavigatorUser) as (robot, user):
        if navigator:
            with run_server(rig, robot, user.make_navigator, NAVIGATOR):
                yield robot, user
        else:
            robot.wait_for_discovery(NAVIGATOR, there=False)
            with robot.watch_wall_waits():
                yield robot, user


def _draw_metres(robot: Robot, more: int = 0) -> int:
    """Return the length of a drive in m; ones with ``more`` differ, lest one be remembered."""
    return robot.draws.whole("metres of a drive", *METRES) + more


def _draw_far_metres(robot: Robot) -> int:
    return robot.draws.whole("metres of a long drive", *FAR)


def _require_accepted(
    robot: Robot, user: NavigatorUser, metres: int = 0, *, ponders: bool = False
) -> None:
    """Ask for a drive, and wait until its goal has been accepted; see `NavigatorUser.request`."""
    user.request(metres or _draw_metres(robot), ponders=ponders)
    _require_goal(robot, user)
    if not robot.run(lambda: user.goals, PROMPT):
        raise RuntimeError("the examiner's navigator did not accept a goal")


def _require_goal(robot: Robot, user: NavigatorUser) -> None:
    robot.run(lambda: user.orders, PROMPT)
    metres = user.metres
    if user.orders[:1] != [metres]:
        order = f"a goal with order={user.orders[0]}" if user.orders else "no goal"
        raise Failed(
            expected=f"After navigate/request {metres}{following_phrase(user.before)}, a goal with "
            f"order={metres} is sent.",
            actual=f"The request was published, and the navigator got {order}."
            + robot.error_note(),
        )


def _require_outcome(
    robot: Robot, user: NavigatorUser, when: str, word: str, limit: float = PROMPT
) -> None:
    """Require one outcome, and a stop unless it is good."""
    robot.run(lambda: user.outcomes, limit)
    if user.outcomes != [word]:
        words = ", then ".join(f"“{said}”" for said in user.outcomes)
        raise Failed(
            expected=f"{when}, navigate/outcome says “{word}”, once.",
            actual=(f"It said {words}." if words else f"Within {limit:.3g} s it said nothing.")
            + robot.error_note(),
        )
    if word == "arrived":
        return
    robot.run(lambda: user.speeds, PROMPT)
    if not user.speeds or user.speeds[-1]:
        last = (
            "the last command was to drive" if user.speeds else f"nothing came within {PROMPT:g} s"
        )
        raise Failed(
            expected=f"With “{word}” the robot is stopped: a zero Twist on cmd_vel.",
            actual=f"It said “{word}”, but on cmd_vel {last}.",
        )


def _require_once(robot: Robot, user: NavigatorUser, when: str, word: str) -> None:
    """Require that the outcome stays the only one, past any timer of the goal's."""
    robot.spend_time(AFTER, COARSE)
    _require_outcome(robot, user, when, word)


def examine_ends(rig: RobotRig) -> None:
    """Goals that succeed, are rejected, are aborted; nothing of them is left behind."""
    with _run_client(rig) as (robot, user):
        for ends in robot.draws.shuffled(
            "ends of goals", (_goal_succeeds, _is_rejected, _is_aborted)
        ):
            ends(robot, user)
        robot.require_no_errors("ended")


def _goal_succeeds(robot: Robot, user: NavigatorUser) -> None:
    _require_accepted(robot, user)
    user.send_feedback(1)
    user.end_goal(ServerGoalHandle.succeed)
    _require_end(robot, user, "When the goal succeeded", "arrived")


def _is_rejected(robot: Robot, user: NavigatorUser) -> None:
    user.request(_draw_far_metres(robot), accepts=False, hesitates=True)
    _require_goal(robot, user)
    user.speeds.clear()  # what came with the request is no answer to the rejection
    user.decide()
    _require_end(robot, user, "When the navigator rejected the goal", "rejected")


def _is_aborted(robot: Robot, user: NavigatorUser) -> None:
    _require_accepted(robot, user, _draw_metres(robot, -1))
    user.send_feedback(1)
    robot.wait_for_rest()
    user.speeds.clear()  # what came with the acceptance is no answer to the abort
    user.end_goal(ServerGoalHandle.abort)
    _require_end(robot, user, "When the navigator aborted the goal", "aborted")


def _require_end(robot: Robot, user: NavigatorUser, when: str, word: str) -> None:
    """Require an outcome at once, and none after it: a timer of the goal's may still run."""
    _require_outcome(robot, user, when, word)
    _require_once(robot, user, f"{when}, and for {AFTER:g} s after that", word)


def examine_stalls(rig: RobotRig) -> None:
    """A slow drive that goes on, then one whose feedback ceases."""
    with _run_client(rig) as (robot, user):
        _slowly_drives(robot, user)
        user.end_goal(ServerGoalHandle.succeed)
        _require_outcome(robot, user, "When a slow drive succeeded", "arrived")

        _require_accepted(robot, user)
        robot.spend_time(1.0)
        user.send_feedback(1)
        _require_cancel(robot, user, "the last feedback")
        when = f"When feedback ceased for {SILENCE:g} s, and the cancel was accepted"
        _require_outcome(robot, user, when, "stalled")
        user.end_goal(ServerGoalHandle.canceled)
        _require_once(robot, user, when, "stalled")
        robot.require_no_errors("stalled")
    rig.require_times_unasked(NavigatorUser.CLIENT, plain_program_times.STALL)


def _slowly_drives(robot: Robot, user: NavigatorUser) -> None:
    """Ask for a drive, and give it feedback so often that it must be left alone."""
    _require_accepted(robot, user, BREATHS[-1] + 1)
    for before, passed in pairwise((-1, 0, *BREATHS)):
        if passed:
            user.send_feedback(passed)
        robot.spend_time(BREATH, COARSE)
        if user.cancels or user.outcomes:
            did = "It was canceled" if user.cancels else f"It said “{user.outcomes[0]}”"
            same = " The last feedback had the same marks as the one before: it counts, too."
            raise Failed(
                expected=f"A drive with feedback every {BREATH:g} s is left alone.",
                actual=f"{did}.{same if passed == before else ''}",
            )


def _require_cancel(robot: Robot, user: NavigatorUser, event: str = "its acceptance") -> None:
    """Wait in silence until the goal is canceled, neither too early nor too late.

    ``event`` is what has just happened, and begins the silence.
    """
    robot.wait_for_rest()
    user.speeds.clear()  # what came before the silence does not answer it
    since = user.now
    robot.run(lambda: user.cancels, SILENCE + TOLERANCE)
    expected = f"The goal is canceled {SILENCE:g} s after {event}, with no feedback since then."
    if not user.cancels:
        said = f" It said “{user.outcomes[0]}”." if user.outcomes else ""
        raise Failed(
            expected=expected,
            actual=f"{SILENCE + TOLERANCE:g} s after {event} no request to cancel had come.{said}",
        )
    waited = user.cancels[0] - since
    if waited < SILENCE - TOLERANCE:
        raise Failed(
            expected=expected,
            actual=f"The request to cancel came {waited:.1f} s after {event}."
            if waited >= 0.0
            else "The request to cancel came while feedback was still coming, "
            f"{-waited:.1f} s before {event}.",
        )


def _slowly_refused(robot: Robot, user: NavigatorUser) -> None:
    """Ask for a drive that is accepted late, but in time, and its cancel refused the same way."""
    user.request(_draw_far_metres(robot), obeys=False, hesitates=True, ponders=True)
    _require_goal(robot, user)
    _answers_slowly(robot, user, "the goal")
    robot.run(lambda: user.goals, PROMPT)
    _require_cancel(robot, user)
    _answers_slowly(robot, user, "the request to cancel")


def _answers_slowly(robot: Robot, user: NavigatorUser, what: str, aside: str = "") -> None:
    """Let an answer come late, but in time; ``aside`` is a sentence to add if it was given up."""
    robot.spend_time(HESITATION)
    if user.outcomes:
        raise Failed(
            expected=f"An answer to {what} after {HESITATION:g} s is in time.",
            actual=f"Before that it said “{user.outcomes[0]}”.{aside}",
        )
    user.decide()


def _too_late(robot: Robot, user: NavigatorUser) -> None:
    """Ask for a drive whose goal is accepted, and reached, when it has been given up."""
    user.request(_draw_metres(robot), hesitates=True)
    _require_goal(robot, user)
    user.speeds.clear()  # what came with the request does not answer the silence
    when = f"When the navigator did not answer the goal for {ANSWER:g} s"
    _require_outcome(robot, user, when, "lost", ANSWER + TOLERANCE + STRIDE)
    user.decide()
    if robot.run(lambda: user.goals, PROMPT):
        user.send_feedback(1)
        user.end_goal(ServerGoalHandle.succeed)
    _require_once(robot, user, f"{when}, then accepted it and arrived", "lost")


def _cancel_too_late(robot: Robot, user: NavigatorUser) -> None:
    """Ask for a drive whose cancel is accepted when it has been given up."""
    _require_accepted(robot, user, _draw_metres(robot, 1), ponders=True)
    _require_cancel(robot, user)
    when = f"When the navigator did not answer the request to cancel for {ANSWER:g} s"
    _require_outcome(robot, user, when, "lost", ANSWER + TOLERANCE + STRIDE)
    user.decide()
    robot.wait_for_rest()
    user.end_goal(ServerGoalHandle.canceled)
    _require_once(robot, user, f"{when}, then accepted it", "lost")


def examine_losses(rig: RobotRig) -> None:
    """A navigator that refuses to cancel, one that is slow or dies on the way, and none at all."""
    with _run_client(rig) as (robot, user):
        _slowly_refused(robot, user)
        when = "When the navigator refused to cancel"
        _require_outcome(robot, user, when, "runaway")
        user.send_feedback(2)
        user.end_goal(ServerGoalHandle.succeed)
        _require_once(robot, user, f"{when}, and reported success later", "runaway")
        _too_late(robot, user)
        _cancel_too_late(robot, user)
        _require_accepted(robot, user)
    with _run_client(rig, navigator=False) as (robot, user):
        when = "When the navigator died on the way"
        limit = SILENCE + ANSWER + 2 * ALLOWED + STRIDE
        _require_outcome(robot, user, when, "lost", limit)
        _require_once(robot, user, when, "lost")
        user.request(_draw_metres(robot))
        when = "When there was no navigator"
        _require_outcome(robot, user, when, "lost", ANSWER + TOLERANCE + STRIDE)
    with _run_client(rig) as (robot, user):
        _require_accepted(robot, user)
        user.end_goal(ServerGoalHandle.succeed)
        _require_outcome(
            robot, user, "When the navigator had come back, and the goal succeeded", "arrived"
        )
        _soon_after(robot, user)
        robot.require_no_errors("lost")
    rig.require_times_unasked(
        NavigatorUser.CLIENT, plain_program_times.GOAL, plain_program_times.CANCEL
    )


def _soon_after(robot: Robot, user: NavigatorUser) -> None:
    """Ask for a drive that is accepted late, but in time, while a time-out of the last may run."""
    robot.spend_time(APART)
    user.request(_draw_metres(robot, -1), hesitates=True)
    _require_goal(robot, user)
    aside = (
        f" The goal before was sent {APART:g} s before this one, and answered at once: is its "
        "time-out called off?"
    )
    _answers_slowly(robot, user, "the goal", aside)
    robot.run(lambda: user.goals, PROMPT)
    user.end_goal(ServerGoalHandle.succeed)
    _require_outcome(
        robot, user, "When the goal was accepted late, but in time, and succeeded", "arrived"
    )
