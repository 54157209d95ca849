"""Check what learners pass to a session: a wrong kind of value is answered in one sentence."""

from __future__ import annotations

import math
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSProfile

from course.errors import SessionError

_MAX_INT = 2**31 - 1

_KINDS = {
    "message": ("msg", "String from std_msgs.msg"),
    "service": ("srv", "Trigger from std_srvs.srv"),
    "action": ("action", "Fibonacci from example_interfaces.action"),
}


def check_seconds(value: Any, name: str = "timeout") -> float:
    """Return a time span.

    Raises:
        SessionError: it is not a number of seconds, 0 or more.
    """
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise SessionError(
            f"{name} is a number of seconds, such as 5.0, not {describe_value(value)}."
        )
    if math.isnan(value) or value < 0:
        raise SessionError(f"{name} is a number of seconds, 0 or more, not {value:g}.")
    return float(value)


def check_whole_number(value: Any, name: str, least: int, example: int) -> int:
    """Return a whole number.

    Raises:
        SessionError: it is something else, less than `least`, or more than ROS can count (31 bits).
    """
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise SessionError(
            f"{name} is a whole number, at least {least}, not {describe_value(value)}: try "
            f"{name}={example}."
        )
    if value > _MAX_INT:
        raise SessionError(
            f"{name} is at most {_MAX_INT}, not {describe_value(value)}: try {name}={example}."
        )
    return value


def check_text(value: Any, name: str, example: str) -> str:
    """Return a string.

    Raises:
        SessionError: it is something else.
    """
    if not isinstance(value, str):
        raise SessionError(f"{name} is a string, such as {example!r}, not {describe_value(value)}.")
    return value


def check_function(value: Any, name: str, example: str) -> None:
    """Check that `value` can be called.

    Raises:
        SessionError: it cannot.
    """
    if not callable(value):
        raise SessionError(f"{name} is a function, such as {example}, not {describe_value(value)}.")


def check_qos(value: Any) -> QoSProfile | None:
    """Return a QoS profile; a number stands for its depth, as in rclpy.

    Raises:
        SessionError: it is neither, nor None.
    """
    if value is None or isinstance(value, QoSProfile):
        return value
    return QoSProfile(depth=check_whole_number(value, "qos", least=1, example=10))


def node_or_name(value: Any) -> None:
    """Check that `value` can stand for a node: a node, a name, or what made the node.

    Raises:
        SessionError: it cannot.
    """
    if not isinstance(value, str | Node) and not callable(value):
        raise SessionError(
            f"A node is named by itself, its name or its class, not by {describe_value(value)}."
        )


def check_factory(value: Any, args: tuple[Any, ...], kwargs: dict[str, Any]) -> None:
    """Check that `value` is a node, without arguments, or can make one.

    Raises:
        SessionError: it is not.
    """
    if isinstance(value, Node):
        if args or kwargs:
            raise SessionError(
                "This node has been made already: give the arguments to its class, as in "
                f"run({type(value).__name__}, ...)."
            )
    elif not callable(value):
        raise SessionError(
            "run() needs a Node class, or a function that returns a node, as in run(Talker); it "
            f"was {describe_value(value)}."
        )


def ros_type(value: Any, kind: str) -> None:
    """Check that `value` is the class of a "message", "service" or "action".

    Raises:
        SessionError: it is not; it says what it is instead, if it is one of the other two.
    """
    if (actual := _kind_of(value)) == kind:
        return
    _, example = _KINDS[kind]
    if actual is not None:
        was = f"{value.__name__}, which is a {actual} type"
    elif not isinstance(value, type) and (_kind_of(type(value)) == "message"):
        was = f"a {type(value).__name__} that has been made: pass the class itself"
    else:
        was = describe_value(value)
    article = "an" if kind == "action" else "a"
    raise SessionError(f"The type is {article} {kind} class, such as {example}; it was {was}.")


def check_message(value: Any) -> None:
    """Check that `value` is a message, not its class.

    Raises:
        SessionError: it is something else.
    """
    if isinstance(value, type) or _kind_of(type(value)) != "message":
        raise SessionError(
            "The message is made from its class, as in String(data='hello'); it was "
            f"{describe_value(value)}."
        )


def check_instance(value: Any, wanted: type, what: str) -> None:
    """Check that `value`, sent as `what`, is made from the class `wanted`.

    Raises:
        SessionError: it is not.
    """
    if not isinstance(value, wanted):
        outer, _, inner = wanted.__name__.rpartition("_")
        name = f"{outer}.{inner}(...)" if outer else f"{inner}(...)"
        raise SessionError(f"The {what} is made with {name}; it was {describe_value(value)}.")


def describe_value(value: Any) -> str:
    """Return `value` as a sentence can name it."""
    if isinstance(value, type):
        return f"the class {value.__name__}"
    representation = repr(value)
    return representation if len(representation) <= 40 else f"{type(value).__name__} value"


def _kind_of(value: Any) -> str | None:
    """Return what ROS class `value` is, told by its package, or None.

    The services and messages that an action is made of stand in its package, too.
    """
    parts = str(getattr(value, "__module__", "")).split(".")
    if not isinstance(value, type) or len(parts) < 2:
        return None
    found = next((kind for kind, (part, _) in _KINDS.items() if part == parts[1]), None)
    if found == "action" and not hasattr(value, "Goal"):
        return "service" if hasattr(value, "Request") else "message"
    return found
