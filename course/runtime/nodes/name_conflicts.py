"""One name for two things: what DDS or rclpy refuses, and rclpy has no words for.

A topic or a service of two types in one process, or a node whose class uses a name of rclpy's.
"""

from __future__ import annotations

import inspect
import traceback
from typing import Any

from rclpy.node import Node

from course.messages.types import type_name

_KINDS = {
    "create_publisher": ("topic", "msg_type", "topic"),
    "create_subscription": ("topic", "msg_type", "topic"),
    "create_client": ("service", "srv_type", "srv_name"),
    "create_service": ("service", "srv_type", "srv_name"),
}
"""Methods of a node: what they make an endpoint of, and their arguments for its type and name."""


_OF_NODES = {
    name for name, _ in inspect.getmembers(Node, lambda member: isinstance(member, property))
}
"""What rclpy keeps in a node, such as its ``handle``: a class that calls a method so breaks it."""


def explain_conflict(error: BaseException) -> None:
    """Say in ``error`` that a name is something else already, if that may be why rclpy raised it.

    Between two processes endpoints of two types are made, and DDS does not connect them: then a
    diagnosis says so. In one, rclpy raises "invalid allocator".
    """
    for frame, _ in traceback.walk_tb(error.__traceback__):
        given, found = frame.f_locals, ""
        node = given.get("self")
        if frame.f_globals.get("__name__") != "rclpy.node" or not isinstance(node, Node):
            continue
        if isinstance(error, (AttributeError, TypeError)):
            found = _describe_taken(type(node))
        if not found and (kind := _KINDS.get(frame.f_code.co_name)) is not None:
            what, type_of, name_of = kind
            found = _describe_clash(node, what, given[type_of], given[name_of])
        if found:
            error.args = (f"{found} ({error})",)
            return


def _describe_taken(kind: type[Node]) -> str:
    """Return a sentence about names of rclpy's that a class of nodes uses; empty without any."""
    own = [name for name in sorted(_OF_NODES) if not _is_property(kind, name)]
    if not own:
        return ""
    names = ", ".join(f"'{name}'" for name in own)
    return (
        f"{kind.__qualname__} has its own {names}, a name under which rclpy keeps something in "
        "every Node: call it something else."
    )


def _is_property(kind: type[Node], name: str) -> bool:
    return isinstance(inspect.getattr_static(kind, name), property)


def _describe_clash(node: Node, what: str, ros_type: Any, name: str) -> str:
    """Return a sentence about the types of a name; empty if they are the same."""
    if what == "topic":
        full, known = node.resolve_topic_name(name), node.get_topic_names_and_types()
    else:
        full, known = node.resolve_service_name(name), node.get_service_names_and_types()
    types, wanted = dict(known).get(full, []), type_name(ros_type)
    if not types or wanted in types:
        return ""
    return (
        f"{full} is of type {', '.join(sorted(types))}, not {wanted}: one {what} has one type, so "
        "correct the type or the name on one side."
    )
