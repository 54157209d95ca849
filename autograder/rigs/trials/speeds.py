"""Part B, the server of speed limits: good requests, nonsense, jammed wheels."""

# mypy: allow-untyped-calls
# rclpy leaves most of its functions untyped.

from __future__ import annotations

import math
from typing import Any

from rcl_interfaces.msg import Parameter

from autograder.exam import Failed
from autograder.rigs.gripper import (
    Operator,
    double,
    doubles,
    flag,
    ready,
    text,
    unset,
    whole,
)
from autograder.rigs.navigation import moves
from autograder.rigs.phrases import with_reason
from autograder.rigs.safety import RobotRig
from autograder.rigs.safety_robot import COARSE, Robot

PATIENCE = 1.0  # s for an answer; a service callback may await something
LATER = 1.5  # s in which a request that was refused might be made up for
SAME = 1e-6  # limits that differ by less are equal

NONSENSE: tuple[tuple[str, list[Parameter]], ...] = (
    ("linear = NaN", [double("linear", math.nan)]),
    ("angular = NaN", [double("angular", math.nan)]),
    ("linear = infinity", [double("linear", math.inf)]),
    ("angular = minus infinity", [double("angular", -math.inf)]),
    ("linear = -0.1", [double("linear", -0.1)]),
    ("linear = 1.5", [double("linear", 1.5)]),
    ("linear = 1.01", [double("linear", 1.01)]),
    ("angular = -0.1", [double("angular", -0.1)]),
    ("angular = 2.5", [double("angular", 2.5)]),
    ("linear = “fast”, a string", [text("linear", "fast")]),
    ("linear = 1, an integer", [whole("linear", 1)]),
    ("angular = true, a bool", [flag("angular", True)]),
    ("linear = [0.5], an array of doubles", [doubles("linear", 0.5)]),
    ("linear without a type", [unset("linear")]),
    ("a limit named “warp”", [double("warp", 0.5)]),
    ("a limit named “Linear”", [double("Linear", 0.5)]),
    (
        "linear = 0.2, angular = 0.5 and a limit named “warp”",
        [double("linear", 0.2), double("angular", 0.5), double("warp", 0.5)],
    ),
    (
        "linear = 0.2 and angular = “fast”, a string",
        [double("linear", 0.2), text("angular", "fast")],
    ),
    ("linear = NaN, then linear = 0.2", [double("linear", math.nan), double("linear", 0.2)]),
    ("an empty list", []),
)


def good(rig: RobotRig) -> None:
    """Good requests: the first one, both limits, one at a time, at its bounds, the same again."""
    with rig.robot(Operator.SERVER, Operator) as (robot, operator):
        _accepted(robot, operator, "At first", (0.5, 0.8), angular=0.8)
        _accepted(robot, operator, "Then", (0.33, 0.66), linear=0.33, angular=0.66)
        _accepted(robot, operator, "Then", (0.33, 2.0), angular=2.0)
        # Of a request that names both, each has to be kept: only one might be.
        _accepted(robot, operator, "Then", (0.21, 1.3), linear=0.21, angular=1.3)
        _accepted(robot, operator, "Then", (0.0, 1.3), linear=0.0)
        _accepted(robot, operator, "Then", (0.0, 2.0), angular=2.0)
        _accepted(robot, operator, "Then", (1.0, 2.0), linear=1.0)
        when = "When linear and angular have these values already,"
        _accepted(robot, operator, when, (1.0, 2.0), linear=1.0, angular=2.0)


def bad(rig: RobotRig) -> None:
    """Everything that can be wrong with a request, and a good one after each."""
    with rig.robot(Operator.SERVER, Operator) as (robot, operator):
        for what, parameters in NONSENSE:
            _refused(robot, operator, what, parameters)
        _accepted(robot, operator, "After nonsense", (0.4, 0.8), linear=0.4, angular=0.8)
        robot.require_no_errors()


def atomic(rig: RobotRig) -> None:
    """Requests that are good in part, and wheels that raise."""
    rig.renew()
    with rig.robot(Operator.SERVER, Operator) as (robot, operator):
        _accepted(robot, operator, "At first", (0.4, 1.0), linear=0.4)
        halves = [double("linear", 0.2), double("angular", math.nan)]
        _refused(robot, operator, "linear = 0.2 together with angular = NaN", halves)
        _refused(robot, operator, "angular = NaN together with linear = 0.2", halves[::-1])
        _accepted(robot, operator, "After a half-good request", (0.4, 1.5), angular=1.5)
        operator.jam(True)
        robot.rest()
        what = "linear = 0.9 with jammed wheels"
        _refused(robot, operator, what, [double("linear", 0.9)], may_command=True)
        operator.jam(False)
        robot.spend(LATER, COARSE)
        if operator.limits:
            raise Failed(
                expected="A request that was refused is over: when the wheels work again, the old "
                "limits hold.",
                actual=f"Within {LATER:g} s after the jam, what reached the wheels: "
                f"{_limits(operator.limits)}.",
            )
        _accepted(robot, operator, "After the jam", (0.4, 1.1), angular=1.1)
        robot.require_no_errors()


def _answer(robot: Robot, operator: Operator, request: str, parameters: list[Parameter]) -> Any:
    future = operator.ask(parameters)
    if not robot.run(ready(future), PATIENCE):
        raise Failed(
            expected=f"{request} is answered.",
            actual=f"No answer came.{robot.complaint()}",
        )
    robot.rest()
    return future.result().result


def _accepted(
    robot: Robot, operator: Operator, when: str, due: tuple[float, float], **values: float
) -> None:
    """Require that a request for the limits of ``values`` is good, and sets those that are due."""
    parameters = [double(name, value) for name, value in values.items()]
    named = " and ".join(f"{name} = {value}" for name, value in values.items())
    request = f"{when} a request with {named}"
    result = _answer(robot, operator, request, parameters)
    if not result.successful:
        raise Failed(
            expected=f"{request} is good, and answered successful=True.",
            actual=f"It was answered successful=False, {with_reason(result.reason)}.",
        )
    wanted = _limits([due])
    reached = operator.limits
    fits = len(reached) == 1 and all(
        abs(seen - wish) < SAME for seen, wish in zip(reached[0], due, strict=True)
    )
    if not fits:
        raise Failed(
            expected=f"{request} hands both limits to the wheels, once: {wanted}.",
            actual=f"What reached the wheels: {_limits(reached)}.",
        )


def _refused(
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
    result = _answer(robot, operator, f"A request with {what}", parameters)
    if operator.limits:
        raise Failed(
            expected=f"Nothing of a request with {what} reaches the wheels.",
            actual=f"What reached the wheels: {_limits(operator.limits)}.",
        )
    if operator.commands and not may_command:
        told = "drive" if any(map(moves, operator.commands)) else "stop"
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


def _limits(reached: list[tuple[float, float]]) -> str:
    words = [f"linear {linear:g} and angular {angular:g}" for linear, angular in reached[:3]]
    return ", then ".join(words) or "nothing"
