"""Part A, the gripper's client: answers, refusals, silence, late answers, no gripper."""

# mypy: allow-untyped-calls
# rclpy leaves most of its functions untyped.

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from autograder.exam import Failed
from autograder.rigs.gripper import GripUser
from autograder.rigs.safety import COARSE, STRIDE, Robot, RobotRig, following, serving
from autograder.rigs.trials import heart

GRIPPER = {"services": ["gripper/set"]}

PROMPT = 1.0  # s for an outcome that is clear; a node may look for it by a timer
SLOW = 0.7  # s that an answer takes which is slow, but in time whatever the tolerance
LONGEST = 10.0  # s from a request to its outcome
FIRST_GAP = 1.5  # s between the first two tries: 1 s without an answer, 0.5 s of pause
GROWTH = 0.5  # s by which the second pause is longer, at least
TOLERANCE = 0.25  # s: what the task allows, and what the examiner's strides blur
DEADLINE = LONGEST + TOLERANCE + STRIDE  # s after which no outcome is due any more
AFTER = 1.5  # s in which a second outcome would show
IDLE = 2.0  # s in which a node that has not been asked for anything shows its heartbeat
LATE = 1.4  # s after a try at which its answer is late, whatever the tolerance
SHORTEST = 2.25  # s: less than two tries take, so that their number is left to another check


@contextmanager
def _user(rig: RobotRig, gripper: bool = True) -> Iterator[tuple[Robot, GripUser]]:
    with rig.robot(GripUser.CLIENT, GripUser) as (robot, user):
        if gripper:
            with serving(rig, robot, user.gripper, GRIPPER):
                yield robot, user
        else:
            robot.sees(GRIPPER, there=False)
            with robot.unserved():
                yield robot, user


def _tried(robot: Robot, user: GripUser, close: bool) -> None:
    """Ask for a grip, and wait until the gripper is asked for it."""
    user.request(close)
    if not robot.run(lambda: user.tries, PROMPT):
        raise Failed(
            expected=f"After grip/request {str(close).lower()}{following(user.before)}, "
            "gripper/set is called.",
            actual=f"The gripper was never called. {_said(user)}{robot.complaint()}",
        )
    if user.tries[0].close is not close:
        asked = str(user.tries[0].close).lower()
        raise Failed(
            expected=f"The gripper is called with data={str(close).lower()}, as requested.",
            actual=f"It was called with data={asked}.",
        )


def _outcome(robot: Robot, user: GripUser, when: str, word: str, limit: float = PROMPT) -> None:
    """Require one outcome, and a held arm unless it is good."""
    robot.run(lambda: user.outcomes, limit)
    if user.outcomes != [word]:
        raise Failed(
            expected=f"{when}, grip/outcome says “{word}”, once.",
            actual=_said(user) + robot.complaint(),
        )
    if word != "done" and not robot.run(lambda: user.holds, PROMPT):
        raise Failed(
            expected=f"With “{word}” the arm is told to hold still, on arm/hold.",
            actual=f"It said “{word}”, and nothing came on arm/hold.",
        )


def _once(robot: Robot, user: GripUser, when: str) -> None:
    """Require that the outcome stays the only one."""
    robot.spend(AFTER, COARSE)
    if len(user.outcomes) != 1:
        raise Failed(expected=f"{when}, there is exactly one outcome.", actual=_said(user))


def _said(user: GripUser) -> str:
    words = ", then ".join(f"“{word}”" for word in user.outcomes)
    return f"It said {words}." if words else "It said nothing."


def carried_out(rig: RobotRig) -> None:
    """The gripper answers, at once and within the time of a try."""
    with _user(rig) as (robot, user):
        for close, delay in ((True, 0.0), (False, SLOW)):
            _tried(robot, user, close)
            robot.spend(delay)
            if not user.outcomes:
                user.tries[0].reply(True)
            robot.run(lambda: user.outcomes or len(user.tries) > 1, PROMPT)
            if len(user.tries) > 1:
                raise Failed(
                    expected=f"An answer after {delay:g} s is in time: one try is enough.",
                    actual=f"The gripper was called {len(user.tries)} times.",
                )
            when = f"When the gripper answered success=True after {delay:g} s"
            _outcome(robot, user, when, "done")
        _once(robot, user, when)


def refused(rig: RobotRig) -> None:
    """The gripper answers that it will not."""
    with _user(rig) as (robot, user):
        _tried(robot, user, True)
        user.tries[0].reply(False)
        when = "When the gripper answered success=False"
        _outcome(robot, user, when, "refused")
        _once(robot, user, when)
        if len(user.tries) > 1:
            raise Failed(
                expected="A refusal is an answer: the gripper is not asked again.",
                actual=f"The gripper was called {len(user.tries)} times.",
            )
        robot.require_no_errors()


def unanswered(rig: RobotRig) -> None:
    """The gripper takes every request and answers none."""
    with _user(rig) as (robot, user):
        _tried(robot, user, True)
        if not robot.run(lambda: user.outcomes, DEADLINE):
            raise Failed(
                expected=f"A gripper that never answers is given up within {LONGEST:g} s.",
                actual=f"After {DEADLINE:.1f} s of simulated time there {_tries(len(user.tries))} "
                f"and no outcome.{_hint_of_clock(user)}{robot.complaint()}",
            )
        when = "After three tries without an answer"
        times = [attempt.at for attempt in user.tries]
        if len(times) != 3:
            raise Failed(
                expected="A gripper that never answers is tried three times.",
                actual=f"There {_tries(len(times))} before the outcome “{user.outcomes[0]}”.",
            )
        _outcome(robot, user, when, "failed")
        _require_pauses(times[1] - times[0], times[2] - times[1])
        user.tries[2].reply(True)
        _once(robot, user, f"{when}, and a late answer to the third")
        robot.require_no_errors()


def _hint_of_clock(user: GripUser) -> str:
    if len(user.tries) > 1:
        return ""
    return " A time-out on the wall clock does not run in simulated time."


def _tries(count: int) -> str:
    return "was 1 try" if count == 1 else f"were {count} tries"


def _require_pauses(first: float, second: float) -> None:
    if first < FIRST_GAP - TOLERANCE:
        raise Failed(
            expected="The second try comes 1.5 s after the first: 1 s for an answer, 0.5 s pause.",
            actual=f"It came {first:.1f} s after the first.",
        )
    if second - first < GROWTH - TOLERANCE:
        raise Failed(
            expected="The second pause is at least 0.5 s longer than the first one.",
            actual=f"The second try came {first:.1f} s after the first, and the third "
            f"{second:.1f} s after the second.",
        )


def stale(rig: RobotRig) -> None:
    """Answers that come after their try: in the pause, and during a later try or request."""
    with _user(rig) as (robot, user):
        _tried(robot, user, True)
        robot.spend(LATE)
        _require_patience(user)
        user.tries[0].reply(False)
        _ignored(robot, user, f"first try comes {LATE:g} s after it")
        _answered_again(robot, user)
        _once(robot, user, "When the second try was answered, after a late answer to the first")

        _tried(robot, user, False)
        _tried_again(robot, user)
        user.tries[0].reply(False)
        _ignored(robot, user, "first try comes when the second one is under way")
        _answered_again(robot, user)

        _tried(robot, user, True)
        late = user.tries[0]
        _answered_again(robot, user)
        _tried(robot, user, True)
        late.reply(False)
        _ignored(robot, user, "first try for the last request comes when the next one is under way")
        user.tries[0].reply(True)
        when = "When a try was answered with success=True, after a late answer from before"
        _outcome(robot, user, when, "done")


def _require_patience(user: GripUser) -> None:
    if user.outcomes:
        raise Failed(
            expected="After a try without an answer there is a second one.",
            actual=f"After one try it said “{user.outcomes[0]}”.",
        )


def _tried_again(robot: Robot, user: GripUser) -> None:
    """Wait for the second try of the same request."""
    robot.run(lambda: len(user.tries) > 1 or user.outcomes, LONGEST)
    _require_patience(user)
    if len(user.tries) < 2:
        raise Failed(
            expected="After a try without an answer there is a second one.",
            actual=f"There was no second try in {LONGEST:g} s.{robot.complaint()}",
        )


def _answered_again(robot: Robot, user: GripUser) -> None:
    """Let the second try succeed."""
    _tried_again(robot, user)
    user.tries[1].reply(True)
    _outcome(robot, user, "When the second try was answered with success=True", "done")


def _ignored(robot: Robot, user: GripUser, what: str) -> None:
    """Require that an answer that has just been given does not count."""
    robot.spend(2 * STRIDE)
    if user.outcomes:
        raise Failed(
            expected=f"A try has 1 s. The answer to the {what}, and is ignored.",
            actual=f"It was taken for a present answer: it said “{user.outcomes[0]}”.",
        )


def absent(rig: RobotRig) -> None:
    """The gripper dies with a request in its hands and stays away, then comes back."""
    rig.begin_anew()
    with _user(rig) as (robot, user):
        began = user.now
        robot.spend(IDLE)
        heart.beats(user.beats, began, user.now, "Before the first request")
        _tried(robot, user, True)
    with _user(rig, gripper=False) as (robot, user):
        began = user.now
        _gone(robot, user, "When the gripper died in the middle of a call", began)
        user.request(True)
        _gone(robot, user, "When there was no gripper at all", user.now)
    with _user(rig) as (robot, user):
        _tried(robot, user, True)
        user.tries[0].reply(True)
        _outcome(robot, user, "When the gripper had come back and answered success=True", "done")


def _gone(robot: Robot, user: GripUser, when: str, began: float) -> None:
    _outcome(robot, user, when, "failed", DEADLINE)
    lasted = user.now - began
    if lasted < SHORTEST:
        raise Failed(
            expected=f"{when}, three tries have 1 s each, with pauses between: it may come back.",
            actual=f"“failed” came after {lasted:.1f} s.",
        )
    heart.beats(user.beats, began, user.now, when)
