"""Part A, the gripper's client when an answer comes after its try."""

from __future__ import annotations

from autograder.examination.exam import Failed
from autograder.exercises.safety import plain_program_times
from autograder.exercises.safety.grip_request import (
    DEADLINE,
    LONGEST,
    request_grip,
    require_once,
    require_outcome,
    run_client,
)
from autograder.exercises.safety.gripper import GripUser
from autograder.exercises.safety.node_under_test import COARSE, STRIDE, Robot
from autograder.exercises.safety.rig import RobotRig

LATE = 1.3  # s after a try at which its answer is late, whatever the tolerance


def examine_late_answers(rig: RobotRig) -> None:
    """Answers that come after their try: in the pause, and during a later try or request."""
    with run_client(rig) as (robot, user):
        request_grip(robot, user, True)
        robot.spend_time(LATE)
        _require_patience(user)
        user.tries[0].reply(False)
        late_by = f"first try comes {LATE:g} s after it"
        _require_ignored(robot, user, late_by)
        # Who looks at an answer only when the next try is due takes it for one then.
        robot.run(lambda: len(user.tries) > 1 or user.outcomes, LONGEST)
        if user.outcomes[:1] == ["refused"]:
            _require_ignored(robot, user, late_by)
        _answered_again(robot, user)
        require_once(
            robot, user, "When the second try was answered, after a late answer to the first"
        )

        request_grip(robot, user, False)
        _tried_again(robot, user)
        user.tries[0].reply(False)
        _require_ignored(robot, user, "first try comes when the second one is under way")
        _answered_again(robot, user)

        request_grip(robot, user, True)
        late = user.tries[0]
        _answered_again(robot, user)
        request_grip(robot, user, True)
        late.reply(False)
        _require_ignored(
            robot, user, "first try for the last request comes when the next one is under way"
        )
        user.tries[0].reply(True)
        when = "When a try was answered with success=True, after a late answer from before"
        require_outcome(robot, user, when, "done")
        _late_to_the_last(robot, user)
        robot.require_no_errors("stale")
    rig.require_times_unasked(GripUser.CLIENT, plain_program_times.LATE)


def _late_to_the_last(robot: Robot, user: GripUser) -> None:
    """Answer the first try during the second one, and nothing else: three tries have failed."""
    request_grip(robot, user, True)
    _tried_again(robot, user)
    user.tries[0].reply(True)
    robot.run(lambda: user.outcomes, DEADLINE, COARSE)
    if user.outcomes[:1] == ["done"]:  # that anything is said at all is another check's
        raise Failed(
            expected="An answer to the first try that comes during the second one is ignored, also "
            "when no other comes: then “failed” is due.",
            actual="It said “done”.",
        )


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
            actual=f"There was no second try in {LONGEST:g} s.{robot.error_note()}",
        )


def _answered_again(robot: Robot, user: GripUser) -> None:
    """Let the second try succeed."""
    _tried_again(robot, user)
    user.tries[1].reply(True)
    require_outcome(robot, user, "When the second try was answered with success=True", "done")


def _require_ignored(robot: Robot, user: GripUser, what: str) -> None:
    """Require that an answer that has just been given does not count."""
    robot.spend_time(2 * STRIDE)
    if user.outcomes:
        raise Failed(
            expected=f"A try has 1 s. The answer to the {what}, and is ignored.",
            actual=f"It was taken for a present answer: it said “{user.outcomes[0]}”.",
        )
