"""What a node of a design is connected to: endpoints, their names, types and QoS."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from rclpy.exceptions import InvalidServiceNameException, InvalidTopicNameException
from rclpy.expand_topic_name import expand_topic_name
from rclpy.qos import QoSProfile, qos_profile_services_default
from rclpy.validate_full_topic_name import validate_full_topic_name

from course.errors import CourseError
from course.messages import types
from course.messages.types import type_name


class DesignError(CourseError):
    """A design that cannot be brought up; the message says which node, what, and the mend."""


class Role(StrEnum):
    """What a node does at an endpoint. The values are the methods that declare it."""

    PUBLISHES = "publishes"
    SUBSCRIBES = "subscribes"
    SERVES = "serves"
    CALLS = "calls"
    ACTION_SERVER = "action_server"
    ACTION_CLIENT = "action_client"

    @property
    def type_kind(self) -> str:
        """``"msg"``, ``"srv"`` or ``"action"``: the kind of its type."""
        if self in (Role.PUBLISHES, Role.SUBSCRIBES):
            return "msg"
        return "srv" if self in (Role.SERVES, Role.CALLS) else "action"

    @property
    def is_writer(self) -> bool:
        """Whether it is the side that publishes, calls or sends goals."""
        return self in (Role.PUBLISHES, Role.CALLS, Role.ACTION_CLIENT)


_KINDS = {
    "msg": ("get_fields_and_field_types", "a message type, such as LaserScan"),
    "srv": ("Request", "a service type, such as GetPlan"),
    "action": ("Goal", "an action type, such as NavigateTo"),
}


@dataclass(frozen=True)
class DesignEndpoint:
    """One endpoint of a node. `full_name` is its name as the ROS graph spells it."""

    role: Role
    name: str
    full_name: str
    type: Any
    qos: QoSProfile

    @property
    def type_name(self) -> str:
        """The type's name as on the graph, such as ``sensor_msgs/msg/LaserScan``."""
        return type_name(self.type)


def make_endpoint(
    role: Role, node: str, namespace: str, name: object, ros_type: object, qos: object
) -> DesignEndpoint:
    """Return the endpoint that a node declares.

    Raises:
        DesignError: the name, the type or the QoS is none.
    """
    where = f"{node}.{role}({_short_repr(name)}, …)"
    if not isinstance(name, str):
        raise DesignError(f"{where}: the name comes first and is a text, then the type.")
    return DesignEndpoint(
        role,
        name,
        _full_name(where, node, namespace, name),
        _check_type(where, role, ros_type),
        _check_qos(where, role, qos),
    )


def rclpy_reason(error: Exception) -> str:
    """Return what rclpy says about a name, without the place in its own source."""
    first = str(error).splitlines()[0].partition(", at /")[0]
    return (first.partition(": ")[2] or first).rstrip(": ")


def _full_name(where: str, node: str, namespace: str, name: str) -> str:
    try:
        full = str(expand_topic_name(name, node, "/" + namespace.strip("/")))
        validate_full_topic_name(full)
    except (InvalidTopicNameException, InvalidServiceNameException, ValueError) as error:
        raise DesignError(
            f"{where}: {name!r} is not a name on the ROS graph: {rclpy_reason(error)}."
        ) from None
    return full


def _check_type(where: str, role: Role, ros_type: object) -> Any:
    mark, wanted = _KINDS[role.type_kind]
    if isinstance(ros_type, str):
        ros_type = _load_type(where, ros_type)
    if not isinstance(ros_type, type) and hasattr(ros_type, "get_fields_and_field_types"):
        name = type(ros_type).__name__
        raise DesignError(f"{where}: write the type {name}, not the message {name}().")
    if not isinstance(ros_type, type) or not hasattr(ros_type, mark):
        raise DesignError(f"{where} needs {wanted}, not {_short_repr(ros_type)}.")
    return ros_type


def _load_type(where: str, name: str) -> Any:
    try:
        return types.load_named(name)
    except types.UnknownTypeError:
        raise DesignError(
            f"{where}: there is no type {name!r} here; a type is written like "
            "'sensor_msgs/msg/LaserScan'."
        ) from None


def _check_qos(where: str, role: Role, qos: object) -> QoSProfile:
    if isinstance(qos, QoSProfile):
        return qos
    if qos is None:
        return qos_profile_services_default if role.type_kind == "srv" else QoSProfile(depth=10)
    if isinstance(qos, int) and not isinstance(qos, bool) and qos > 0:
        return QoSProfile(depth=qos)
    raise DesignError(
        f"{where}: qos is a QoSProfile or a depth of 1 or more, not {_short_repr(qos)}."
    )


def _short_repr(value: object) -> str:
    return value.__name__ if isinstance(value, type) else repr(value)[:60]
