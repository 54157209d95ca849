"""Part B, the server of speed limits: what a request is in words, and what becomes of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from typing import Any

from geometry_msgs.msg import Twist
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.parameter import Parameter
from std_msgs.msg import Bool

from autograder.examination.draws import Draws
from autograder.observe import Service, Task, Topic
from autograder.observe.phrases import as_phrase, with_reason
from autograder.observe.several_nodes.clock_bound_node import ClockBoundNode

LIMITS = Topic("wheels/limits", Twist, value=lambda message: (message.linear.x, message.angular.z))
COMMANDS = Topic("cmd_vel", Twist)
JAMMED = Topic("hardware/jammed", Bool)
SET_SPEED = Service("speed/set", SetParametersAtomically)
SPEED_SERVER = Task(
    "SpeedServer", publishes=[LIMITS, COMMANDS], subscribes=[JAMMED], serves=[SET_SPEED], threads=4
)

ANSWER_S = 1.0  # for an answer; a service callback may await something
SAME = 1e-6  # limits that differ by less are equal
KINDS = {str: "a string", int: "an integer", bool: "a bool", list: "an array of doubles"}
SPELLED = {"nan": "NaN", "inf": "infinity", "-inf": "minus infinity"}

Parameters = Sequence[tuple[str, Any]]
"""Names and values, whose types are the parameters'; None is a parameter without a type."""


def bad_requests(draws: Draws) -> list[Parameters]:
    """Return requests of which something is wrong."""
    below = draws.number("a limit below 0", -0.1, -0.9, -0.01)
    above = draws.number("a linear limit that is too high", 1.5, 1.05, 3.0)
    turning = draws.number("an angular limit that is too high", 2.5, 2.01, 4.0)
    linear = draws.number("the good half of a request", 0.2, 0.05, 0.95)
    angular = draws.number("the other good half", 0.5, 0.05, 1.95)
    alone = [
        *[("linear", value) for value in (math.nan, math.inf, below, above, 1.01)],
        *[("angular", value) for value in (math.nan, -math.inf, below, turning)],
        *[("linear", "fast"), ("linear", 1), ("angular", True), ("linear", [0.5])],
        *[("linear", None), ("warp", angular), ("Linear", angular)],
    ]
    return [
        *[[parameter] for parameter in alone],
        [("linear", linear), ("angular", angular), ("warp", angular)],
        [("linear", linear), ("angular", "fast")],
        [("linear", math.nan), ("linear", linear)],
        [],
    ]


def describe_request(parameters: Parameters) -> str:
    """Return what a request has, as a phrase: "linear = 0.2 and angular = “fast”, a string"."""
    return as_phrase([_describe(*parameter) for parameter in parameters]) or "an empty list"


def _describe(name: str, value: Any) -> str:
    if name not in ("linear", "angular"):
        return f"a limit named “{name}”"
    if value is None:
        return f"{name} without a type"
    text = f"“{value}”" if isinstance(value, str) else SPELLED.get(str(value), str(value))
    kind = KINDS.get(type(value))
    return f"{name} = {text}" + (f", {kind}" if kind else "")


def as_messages(parameters: Parameters) -> list[Any]:
    """Return the messages of some parameters."""
    return [Parameter(name, value=value).to_parameter_msg() for name, value in parameters]


def request_limits(node: ClockBoundNode, request: str, parameters: Parameters) -> Any:
    """Send a ``request``, which is in words the begin of a sentence; return its result."""
    node.forget(LIMITS, COMMANDS)
    return node.call_within(
        SET_SPEED, ANSWER_S, expected=f"{request} is answered.", parameters=as_messages(parameters)
    ).result


def require_set(node: ClockBoundNode, when: str, due: tuple[float, float], **limits: float) -> None:
    """Require that a request for some limits is good, and that both limits are ``due`` then."""
    request = f"{when} a request with {describe_request([*limits.items()])}"
    result = request_limits(node, request, [*limits.items()])
    node.require_that(
        result.successful,
        f"{request} is good, and answered successful=True.",
        f"It was answered successful=False, {with_reason(result.reason)}.",
    )
    reached = node.end.values(LIMITS)
    node.require_that(
        len(reached) == 1 and all(map(partial(math.isclose, abs_tol=SAME), reached[0], due)),
        f"{request} hands both limits to the wheels, once: {describe_limits([due])}.",
        f"What reached the wheels: {describe_limits(reached)}.",
    )


def require_refused(node: ClockBoundNode, parameters: Parameters, aside: str = "") -> None:
    """Require that a request is answered with a reason, and that nothing reaches the wheels.

    ``aside`` is what else is wrong. Where wheels raise, the task does not say that nothing else is
    asked of them: a server may stop them then.
    """
    request = f"request with {describe_request(parameters)}{aside}"
    result = request_limits(node, f"A {request}", parameters)
    reached, commands = node.end.values(LIMITS), node.end.values(COMMANDS)
    node.require_that(
        not reached,
        f"Nothing of a {request} reaches the wheels.",
        f"What reached the wheels: {describe_limits(reached)}.",
    )
    node.require_that(
        aside or not commands,
        f"Nothing at all reaches the wheels at a {request}.",
        f"On cmd_vel they were told to {'drive' if any(map(is_motion, commands)) else 'stop'}.",
    )
    node.require_that(
        not result.successful,
        f"A {request} is answered successful=False.",
        "It was answered successful=True.",
    )
    node.require_that(
        result.reason.strip(),
        f"A {request} is refused with a reason in words.",
        "It was answered successful=False, and the reason was empty.",
    )


def describe_limits(reached: Sequence[tuple[float, float]]) -> str:
    """Return which limits reached the wheels, as a phrase."""
    words = [f"linear {linear:g} and angular {angular:g}" for linear, angular in reached[:3]]
    return ", then ".join(words) or "nothing"


def is_motion(speed: Twist) -> bool:
    """Return whether a Twist is anything but a stop; NaN is no stop."""
    parts = (speed.linear, speed.angular)
    return any(value != 0.0 for part in parts for value in (part.x, part.y, part.z))
