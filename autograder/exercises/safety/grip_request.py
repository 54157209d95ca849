"""One request for a grip: the gripper is asked for it, and there is one outcome."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from autograder.examination.exam import Failed
from autograder.exercises.safety.counterpart import following_phrase
from autograder.exercises.safety.gripper import GripUser
from autograder.exercises.safety.node_under_test import COARSE, STRIDE, Robot
from autograder.exercises.safety.rig import RobotRig, run_server

GRIPPER = {"services": ["gripper/set"]}

PROMPT = 1.0  # s for an outcome that is clear; a node may look for it by a timer
LONGEST = 10.0  # s from a request to its outcome
ALLOWED = 0.2  # s more or less that do no harm
TOLERANCE = ALLOWED + STRIDE / 2  # s: what the task allows, and what the examiner's strides blur
DEADLINE = LONGEST + TOLERANCE + STRIDE  # s after which no outcome is due any more
AFTER = 1.5  # s in which a second outcome would show


@contextmanager
def run_client(rig: RobotRig, gripper: bool = True) -> Iterator[tuple[Robot, GripUser]]:
    """Give the client and its user, with a ``gripper`` or without, for the length of the block."""
    with rig.run_robot(GripUser.CLIENT, GripUser) as (robot, user):
        if gripper:
            with run_server(rig, robot, user.make_gripper, GRIPPER):
                yield robot, user
        else:
            robot.wait_for_discovery(GRIPPER, there=False)
            with robot.watch_wall_waits():
                yield robot, user


def request_grip(robot: Robot, user: GripUser, close: bool) -> None:
    """Ask for a grip, and wait until the gripper is asked for it."""
    user.request(close)
    if not robot.run(lambda: user.tries, PROMPT):
        raise Failed(
            expected=f"After grip/request {str(close).lower()}{following_phrase(user.before)}, "
            "gripper/set is called.",
            actual=f"Within {PROMPT:g} s the gripper was not called. {describe_outcomes(user)}"
            f"{robot.error_note()}",
        )
    require_data(user, close)


def require_data(user: GripUser, close: bool) -> None:
    """Require that every try so far asks for what was requested."""
    for number, attempt in enumerate(user.tries, 1):
        if attempt.close is not close:
            which = f" in try {number}" if number > 1 else ""
            raise Failed(
                expected=f"The gripper is called with data={str(close).lower()}, as requested.",
                actual=f"It was called with data={str(attempt.close).lower()}{which}.",
            )


def require_outcome(
    robot: Robot, user: GripUser, when: str, word: str, limit: float = PROMPT
) -> None:
    """Require one outcome, and a held arm unless it is good."""
    robot.run(lambda: user.outcomes, limit)
    if user.outcomes != [word]:
        raise Failed(
            expected=f"{when}, grip/outcome says “{word}”, once.",
            actual=describe_outcomes(user, f"Within {limit:.3g} s it") + robot.error_note(),
        )
    if word != "done" and not robot.run(lambda: user.holds, PROMPT):
        raise Failed(
            expected=f"With “{word}” the arm is told to hold still, on arm/hold.",
            actual=f"It said “{word}”, and within {PROMPT:g} s nothing came on arm/hold.",
        )


def require_once(robot: Robot, user: GripUser, when: str) -> None:
    """Require that the outcome stays the only one."""
    robot.spend_time(AFTER, COARSE)
    if len(user.outcomes) != 1:
        raise Failed(
            expected=f"{when}, there is exactly one outcome.", actual=describe_outcomes(user)
        )


def describe_outcomes(user: GripUser, who: str = "It") -> str:
    """Return which outcomes there were, as a sentence; ``who`` begins one that says: none."""
    words = ", then ".join(f"“{word}”" for word in user.outcomes)
    return f"It said {words}." if words else f"{who} said nothing."
