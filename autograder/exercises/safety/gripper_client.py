"""Part A, the gripper's client: answers, refusals, silence, no gripper."""

from __future__ import annotations

import time
from contextlib import suppress

from autograder.examination.exam import Failed
from autograder.exercises.safety import heartbeat, plain_program_times
from autograder.exercises.safety.grip_request import (
    ALLOWED,
    DEADLINE,
    LONGEST,
    PROMPT,
    TOLERANCE,
    describe_outcomes,
    request_grip,
    require_data,
    require_once,
    require_outcome,
    run_client,
)
from autograder.exercises.safety.gripper import GripUser
from autograder.exercises.safety.node_under_test import COARSE, STRIDE, Robot, WallWait
from autograder.exercises.safety.rig import RobotRig

SLOW = 0.7  # s that an answer takes which is slow, but in time whatever the tolerance
APART = 0.5  # s from one try to another's, whose answer takes so long that the first's 1 s is over
ANSWER = 1.0  # s after which a try without an answer has failed
FIRST_GAP = 1.5  # s between the first two tries: 1 s without an answer, 0.5 s of pause
GROWTH = 0.5  # s by which the second pause is longer, at least
IDLE = 2.0  # s in which a node that has not been asked for anything shows its heartbeat
HELD_S = 1.0  # s of wall time for which the node's clock stands still in the first pause
BACK = 1.8  # s after a request in which the gripper comes back: a third try is still to come
GIVEN_UP = "After three tries without an answer"
SECOND = " That was at the second request in a row that got no answer; at the first all was right."
LEFT = (
    f" The try for the request before, {APART:g} s earlier, had been answered at once: is its "
    "time-out called off then?"
)
SHORTEST = 4.5 - 5 * ALLOWED - STRIDE  # s: three tries and two pauses, each as short as may be


def carried_out(rig: RobotRig) -> None:
    """The gripper answers, at once and within the time of a try."""
    with run_client(rig) as (robot, user):
        close = robot.draws.flag("the grip that is carried out")
        _carries_out(robot, user, close, 0.0)
        require_once(robot, user, _carries_out(robot, user, not close, SLOW))
    rig.require_times_unasked(GripUser.CLIENT, plain_program_times.SLOW)


def _carries_out(robot: Robot, user: GripUser, close: bool, delay: float, aside: str = "") -> str:
    """Answer a first try with success after ``delay`` s, and require that it counts.

    ``aside`` is a sentence to add if the gripper was called again. Returns what happened in words,
    as the beginning of a sentence.
    """
    request_grip(robot, user, close)
    robot.spend_time(delay)
    if not user.outcomes:
        user.tries[0].reply(True)
    robot.run(lambda: user.outcomes or len(user.tries) > 1, PROMPT)
    if len(user.tries) > 1:
        raise Failed(
            expected=f"An answer after {delay:g} s is in time: one try is enough.",
            actual=f"The gripper was called {len(user.tries)} times.{aside}",
        )
    when = f"When the gripper answered success=True after {delay:g} s"
    require_outcome(robot, user, when, "done")
    return when


def examine_refusals(rig: RobotRig) -> None:
    """The gripper answers that it will not: to the first try, and to the second."""
    with run_client(rig) as (robot, user):
        for grip in range(robot.draws.whole("grips before a refusal", 0, 0, 2)):
            _carries_out(robot, user, robot.draws.flag(f"grip {grip} before a refusal"), 0.0)
        close = robot.draws.flag("the grip that is refused")
        request_grip(robot, user, close)
        _require_refusal(robot, user, "When the gripper answered success=False")
        request_grip(robot, user, not close)
        with suppress(WallWait):
            robot.run(lambda: len(user.tries) > 1 or user.outcomes, LONGEST, COARSE)
        tries_again = len(user.tries) > 1
        if tries_again:
            when = "When the gripper answered not the first try, but the second with success=False"
            _require_refusal(robot, user, when)
        robot.require_no_errors("refused")
    if not tries_again:  # that is another check's, and what is still under way must not be
        rig.begin_anew()


def _require_refusal(robot: Robot, user: GripUser, when: str) -> None:
    """Refuse the try that is under way, and require that it is the last."""
    user.holds = 0  # one that came with the request says nothing about the outcome
    tries = len(user.tries)
    user.tries[-1].reply(False)
    robot.run(lambda: user.outcomes or len(user.tries) > tries, PROMPT)
    _require_no_more(user, tries, when)
    require_outcome(robot, user, when, "refused")
    require_once(robot, user, when)
    _require_no_more(user, tries, when)


def _require_no_more(user: GripUser, tries: int, when: str) -> None:
    """Require that a refusal is the end of it: there were so many tries, and are no more."""
    if len(user.tries) > tries:
        raise Failed(
            expected=f"{when}: a refusal is an answer, so the gripper is not asked again.",
            actual=f"The gripper was called {len(user.tries)} times.",
        )


def examine_silence(rig: RobotRig) -> None:
    """The gripper takes every request and answers none: its callback hangs, and once it raises.

    So it does with the next request, too: the tries and pauses of that one begin anew.
    """
    with run_client(rig) as (robot, user):
        close = robot.draws.flag("the grip without an answer")
        _given_up(robot, user, close, held=True)
        user.tries[2].reply(True)
        require_once(robot, user, f"{GIVEN_UP}, and a late answer to the third")
        try:
            _given_up(robot, user, not close)
        except Failed as failed:
            raise Failed(expected=failed.expected, actual=f"{failed.actual}{SECOND}") from None
        _soon_after(robot, user)
        robot.require_no_errors("unanswered")
    rig.require_times_unasked(GripUser.CLIENT, plain_program_times.PAUSE)


def _soon_after(robot: Robot, user: GripUser) -> None:
    """Have a try answered late, but in time, when the time of one that was answered runs out."""
    _carries_out(robot, user, True, 0.0)
    robot.spend_time(APART)
    _carries_out(robot, user, False, SLOW, LEFT)


def _given_up(robot: Robot, user: GripUser, close: bool, *, held: bool = False) -> None:
    """Ask for a grip, answer no try, and require three of them, their pauses and the outcome.

    ``held``: time stands still for a while when the first try has had its own.
    """
    request_grip(robot, user, close)
    began = user.now

    def goes_on() -> bool:
        return len(user.tries) > 1 or bool(user.outcomes)

    # In half strides: they blur how short the first pause is.
    robot.run(goes_on, ANSWER + STRIDE / 2, STRIDE / 2)
    if held:
        what = f"{ANSWER:g} s after the first try the next one came, or an outcome"
        robot.require_still(goes_on, what, HELD_S)
    robot.run(goes_on, 2 * FIRST_GAP + began - user.now, STRIDE / 2)
    robot.run(goes_on, DEADLINE + began - user.now, COARSE)
    if len(user.tries) > 1:
        user.tries[1].crash()
    robot.run(lambda: len(user.tries) > 2 or user.outcomes, DEADLINE + began - user.now)
    if not user.outcomes:
        user.holds = 0  # one that came with a try says nothing about the outcome
    if not robot.run(lambda: user.outcomes, DEADLINE + began - user.now):
        raise Failed(
            expected=f"A gripper that never answers is given up within {LONGEST:g} s.",
            actual=f"After {DEADLINE:.1f} s of simulated time there {_say_tries(len(user.tries))} "
            f"and no outcome.{_hint_of_clock(user)}{robot.error_note()}",
        )
    said_at = user.now
    times = [attempt.at for attempt in user.tries]
    if len(times) != 3:
        raise Failed(
            expected="A gripper that never answers is tried three times.",
            actual=f"There {_say_tries(len(times))} before the outcome “{user.outcomes[0]}”.",
        )
    require_data(user, close)
    require_outcome(robot, user, GIVEN_UP, "failed")
    _require_pauses(times[1] - times[0], times[2] - times[1])
    _require_clear(said_at - times[2])


def _hint_of_clock(user: GripUser) -> str:
    if len(user.tries) > 1:
        return ""
    return " A time-out on the wall clock does not run in simulated time."


def _say_tries(count: int) -> str:
    return "was 1 try" if count == 1 else f"were {count} tries"


def _require_pauses(first: float, second: float) -> None:
    if first < FIRST_GAP - 2 * ALLOWED - STRIDE / 4:  # a try and a pause: two times, each allowed
        raise Failed(
            expected="The second try comes 1.5 s after the first, or later: 1 s for an answer, and "
            f"0.5 s of pause. Each may be {ALLOWED:g} s shorter.",
            actual=f"It came {first:.1f} s after the first.",
        )
    if second - first < GROWTH - TOLERANCE:
        raise Failed(
            expected="The second pause is at least 0.5 s longer than the first one; "
            f"{ALLOWED:g} s less do no harm.",
            actual=f"The second try came {first:.1f} s after the first, and the third "
            f"{second:.1f} s after the second.",
        )


def _require_clear(waited: float) -> None:
    """Fail if the outcome came long after the third try had failed, when it was clear."""
    if waited > ANSWER + PROMPT + TOLERANCE:
        raise Failed(
            expected=f"When the third try has had no answer for {ANSWER:g} s, the outcome is "
            "clear, and comes at once.",
            actual=f"It came {waited:.1f} s after the third try.",
        )


def examine_absence(rig: RobotRig) -> None:
    """The gripper dies with a request in its hands, stays away, and comes back during another."""
    rig.begin_anew()
    with run_client(rig) as (robot, user):
        began = user.now
        began_on_the_wall = time.monotonic()
        robot.spend_time(IDLE)
        watched = time.monotonic() - began_on_the_wall
        heartbeat.require_beats(user.beats, began, user.now, "Before the first request", watched)
        request_grip(robot, user, True)
    with run_client(rig, gripper=False) as (robot, user):
        began = user.now
        _require_failure(robot, user, "When the gripper died in the middle of a call", began)
        user.request(True)
        _require_failure(robot, user, "When there was no gripper at all", user.now)
        user.request(False)
        robot.spend_time(BACK)
    with run_client(rig) as (robot, user):
        _come_back(robot, user)
        request_grip(robot, user, True)
        user.tries[0].reply(True)
        require_outcome(
            robot, user, "When the gripper had come back and answered success=True", "done"
        )
        _refused_alive(robot, user)
        robot.require_no_errors("absent")
    rig.require_times_unasked(GripUser.CLIENT, plain_program_times.BEAT)


def _come_back(robot: Robot, user: GripUser) -> None:
    """Require that a gripper is tried that was not there when the grip was asked for."""
    when = f"When the gripper was not there, and came back {BACK:g} s after the request"
    if not robot.run(lambda: user.tries, DEADLINE - BACK):
        raise Failed(
            expected=f"{when}, it is called: the third try comes 3.5 s after the request or later.",
            actual=f"It was never called. {describe_outcomes(user)}{robot.error_note()}",
        )
    require_data(user, False)
    user.tries[-1].reply(True)
    require_outcome(robot, user, f"{when} and answered success=True", "done")


def _refused_alive(robot: Robot, user: GripUser) -> None:
    """Have a grip refused, and let the heart beat on; what is said is another check's."""
    request_grip(robot, user, True)
    user.tries[0].reply(False)
    began = user.now
    robot.spend_time(2 * heartbeat.BEAT)
    heartbeat.require_beats(user.beats, began, user.now, "After a refusal")


def _require_failure(robot: Robot, user: GripUser, when: str, began: float) -> None:
    require_outcome(robot, user, when, "failed", DEADLINE)
    lasted = user.now - began
    if lasted < SHORTEST:
        raise Failed(
            expected=f"{when}, three tries take 3 s, and the pauses 1.5 s: it may come back.",
            actual=f"“failed” came after {lasted:.1f} s.",
        )
    heartbeat.require_beats(user.beats, began, user.now, when)
