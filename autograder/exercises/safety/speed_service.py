"""Part B, the server of speed limits: good requests, nonsense, jammed wheels."""

from __future__ import annotations

import math
from typing import Any

from rcl_interfaces.msg import Parameter

from autograder.examination.draws import Draws
from autograder.examination.exam import Failed
from autograder.exercises.safety.gripper import (
    Operator,
    array_parameter,
    bool_parameter,
    done_condition,
    double_parameter,
    integer_parameter,
    string_parameter,
    untyped_parameter,
)
from autograder.exercises.safety.navigation import is_motion
from autograder.exercises.safety.node_under_test import COARSE, Robot
from autograder.exercises.safety.rig import RobotRig
from autograder.observe.phrases import with_reason

PATIENCE = 1.0  # s for an answer; a service callback may await something
LATER = 1.5  # s in which a request that was refused might be made up for
SAME = 1e-6  # limits that differ by less are equal


def _bad_requests(draws: Draws) -> list[tuple[str, list[Parameter]]]:
    """Return requests of which something is wrong, and what that is in words."""
    below = draws.number("a limit below 0", -0.1, -0.9, -0.01)
    above = draws.number("a linear limit that is too high", 1.5, 1.05, 3.0)
    turning = draws.number("an angular limit that is too high", 2.5, 2.01, 4.0)
    linear = draws.number("the good half of a request", 0.2, 0.05, 0.95)
    angular = draws.number("the other good half", 0.5, 0.05, 1.95)
    return [
        ("linear = NaN", [double_parameter("linear", math.nan)]),
        ("angular = NaN", [double_parameter("angular", math.nan)]),
        ("linear = infinity", [double_parameter("linear", math.inf)]),
        ("angular = minus infinity", [double_parameter("angular", -math.inf)]),
        (f"linear = {below:g}", [double_parameter("linear", below)]),
        (f"linear = {above:g}", [double_parameter("linear", above)]),
        ("linear = 1.01", [double_parameter("linear", 1.01)]),
        (f"angular = {below:g}", [double_parameter("angular", below)]),
        (f"angular = {turning:g}", [double_parameter("angular", turning)]),
        ("linear = “fast”, a string", [string_parameter("linear", "fast")]),
        ("linear = 1, an integer", [integer_parameter("linear", 1)]),
        ("angular = true, a bool", [bool_parameter("angular", True)]),
        ("linear = [0.5], an array of doubles", [array_parameter("linear", 0.5)]),
        ("linear without a type", [untyped_parameter("linear")]),
        ("a limit named “warp”", [double_parameter("warp", angular)]),
        ("a limit named “Linear”", [double_parameter("Linear", angular)]),
        (
            f"linear = {linear:g}, angular = {angular:g} and a limit named “warp”",
            [
                double_parameter("linear", linear),
                double_parameter("angular", angular),
                double_parameter("warp", angular),
            ],
        ),
        (
            f"linear = {linear:g} and angular = “fast”, a string",
            [double_parameter("linear", linear), string_parameter("angular", "fast")],
        ),
        (
            f"linear = NaN, then linear = {linear:g}",
            [double_parameter("linear", math.nan), double_parameter("linear", linear)],
        ),
        ("an empty list", []),
    ]


def examine_good_requests(rig: RobotRig) -> None:
    """Good requests: the first one, both limits, one at a time, at its bounds, the same again."""
    draw = rig.bench.draws.number
    first = draw("the first angular limit", 0.8, 1.05, 1.9)
    both = draw("a linear limit", 0.33, 0.26, 0.45), draw("an angular limit", 0.66, 0.3, 1.2)
    again = draw("the next linear limit", 0.21, 0.11, 0.25), draw("the next", 1.3, 1.25, 1.8)
    with rig.run_robot(Operator.SERVER, Operator) as (robot, operator):
        _require_accepted(robot, operator, "At first", (0.5, first), angular=first)
        _require_accepted(robot, operator, "Then", both, linear=both[0], angular=both[1])
        _require_accepted(robot, operator, "Then", (both[0], 2.0), angular=2.0)
        # Of a request that names both, each has to be kept: only one might be.
        _require_accepted(robot, operator, "Then", again, linear=again[0], angular=again[1])
        _require_accepted(robot, operator, "Then", (0.0, again[1]), linear=0.0)
        _require_accepted(robot, operator, "Then", (0.0, 2.0), angular=2.0)
        _require_accepted(robot, operator, "Then", (1.0, 2.0), linear=1.0)
        when = "When linear and angular have these values already,"
        _require_accepted(robot, operator, when, (1.0, 2.0), linear=1.0, angular=2.0)


def examine_bad_requests(rig: RobotRig) -> None:
    """Everything that can be wrong with a request, and good ones now and then."""
    draws = rig.bench.draws
    linear = draws.number("a linear limit after nonsense", 0.4, 0.05, 0.95)
    angular = draws.number("an angular limit after nonsense", 0.8, 0.05, 1.95)
    with rig.run_robot(Operator.SERVER, Operator) as (robot, operator):

        def be_told_something_good() -> None:
            due = linear, angular
            _require_accepted(
                robot, operator, "After nonsense", due, linear=linear, angular=angular
            )

        for what, parameters in draws.shuffled("nonsense", _bad_requests(draws)):
            _require_refused(robot, operator, what, parameters)
            if draws.flag(f"something good after {what}", usual=False):
                be_told_something_good()
        be_told_something_good()
        robot.require_no_errors("bad")


def examine_atomicity(rig: RobotRig) -> None:
    """Requests that are good in part, and wheels that raise."""
    rig.renew_node()
    draw = rig.bench.draws.number
    linear = draw("a linear limit that stays", 0.4, 0.31, 0.49)
    half = draw("a half-good linear limit", 0.2, 0.05, 0.29)
    angular = draw("an angular limit after a half-good one", 1.5, 1.2, 1.95)
    later = draw("an angular limit after a jam", 1.1, 0.3, 1.15)
    with rig.run_robot(Operator.SERVER, Operator) as (robot, operator):
        _require_accepted(robot, operator, "At first", (linear, 1.0), linear=linear)
        halves = [double_parameter("linear", half), double_parameter("angular", math.nan)]
        _require_refused(robot, operator, f"linear = {half:g} together with angular = NaN", halves)
        _require_refused(
            robot, operator, f"angular = NaN together with linear = {half:g}", halves[::-1]
        )
        due = linear, angular
        _require_accepted(robot, operator, "After a half-good request", due, angular=angular)
        operator.jam_wheels(True)
        robot.wait_for_rest()
        what = "linear = 0.9 with jammed wheels"
        _require_refused(robot, operator, what, [double_parameter("linear", 0.9)], may_command=True)
        operator.jam_wheels(False)
        robot.spend_time(LATER, COARSE)
        if operator.limits:
            raise Failed(
                expected="A request that was refused is over: when the wheels work again, the old "
                "limits hold.",
                actual=f"Within {LATER:g} s after the jam, what reached the wheels: "
                f"{_limits_phrase(operator.limits)}.",
            )
        _require_accepted(robot, operator, "After the jam", (linear, later), angular=later)
        robot.require_no_errors("atomic")


def _get_answer(robot: Robot, operator: Operator, request: str, parameters: list[Parameter]) -> Any:
    future = operator.request_limits(parameters)
    if not robot.run(done_condition(future), PATIENCE):
        raise Failed(
            expected=f"{request} is answered.",
            actual=f"No answer came.{robot.error_note()}",
        )
    robot.wait_for_rest()
    return future.result().result


def _require_accepted(
    robot: Robot, operator: Operator, when: str, due: tuple[float, float], **values: float
) -> None:
    """Require that a request for the limits of ``values`` is good, and sets those that are due."""
    parameters = [double_parameter(name, value) for name, value in values.items()]
    named = " and ".join(f"{name} = {value}" for name, value in values.items())
    request = f"{when} a request with {named}"
    result = _get_answer(robot, operator, request, parameters)
    if not result.successful:
        raise Failed(
            expected=f"{request} is good, and answered successful=True.",
            actual=f"It was answered successful=False, {with_reason(result.reason)}.",
        )
    wanted = _limits_phrase([due])
    reached = operator.limits
    fits = len(reached) == 1 and all(
        abs(seen - wish) < SAME for seen, wish in zip(reached[0], due, strict=True)
    )
    if not fits:
        raise Failed(
            expected=f"{request} hands both limits to the wheels, once: {wanted}.",
            actual=f"What reached the wheels: {_limits_phrase(reached)}.",
        )


def _require_refused(
    robot: Robot,
    operator: Operator,
    what: str,
    parameters: list[Parameter],
    *,
    may_command: bool = False,
) -> None:
    """Require that a request is answered with a reason, and that nothing reaches the wheels.

    Where wheels raise, the task does not say that nothing else is asked of them: a server that
    stops them then ``may_command`` it.
    """
    result = _get_answer(robot, operator, f"A request with {what}", parameters)
    if operator.limits:
        raise Failed(
            expected=f"Nothing of a request with {what} reaches the wheels.",
            actual=f"What reached the wheels: {_limits_phrase(operator.limits)}.",
        )
    if operator.commands and not may_command:
        told = "drive" if any(map(is_motion, operator.commands)) else "stop"
        raise Failed(
            expected=f"Nothing at all reaches the wheels at a request with {what}.",
            actual=f"On cmd_vel they were told to {told}.",
        )
    if result.successful:
        raise Failed(
            expected=f"A request with {what} is answered successful=False.",
            actual="It was answered successful=True.",
        )
    if not result.reason.strip():
        raise Failed(
            expected=f"A request with {what} is refused with a reason in words.",
            actual="It was answered successful=False, and the reason was empty.",
        )


def _limits_phrase(reached: list[tuple[float, float]]) -> str:
    words = [f"linear {linear:g} and angular {angular:g}" for linear, angular in reached[:3]]
    return ", then ".join(words) or "nothing"
