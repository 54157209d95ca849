"""One name, two types, in one process: what DDS refuses, and rclpy has no words for."""

# mypy: allow-untyped-calls

from __future__ import annotations

import traceback
from typing import Any

from rclpy.node import Node

from course.runtime.names import type_name

_KINDS = {
    "create_publisher": ("topic", "msg_type", "topic"),
    "create_subscription": ("topic", "msg_type", "topic"),
    "create_client": ("service", "srv_type", "srv_name"),
    "create_service": ("service", "srv_type", "srv_name"),
}
"""Methods of a node: what they make an endpoint of, and their arguments for its type and name."""


def explain(error: BaseException) -> None:
    """Say in ``error`` that a name has another type already, if that is why rclpy raised it.

    Between two processes such endpoints are made, and DDS does not connect them: then a diagnosis
    says so. In one, rclpy raises "invalid allocator".
    """
    for frame, _ in traceback.walk_tb(error.__traceback__):
        kind = _KINDS.get(frame.f_code.co_name)
        if kind is not None and frame.f_globals.get("__name__") == "rclpy.node":
            what, type_of, name_of = kind
            given = frame.f_locals
            if found := _clash(given["self"], what, given[type_of], given[name_of]):
                error.args = (f"{found} ({error})",)
            return


def _clash(node: Node, what: str, ros_type: Any, name: str) -> str:
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
