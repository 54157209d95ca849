"""Names as the ROS graph spells them."""

from __future__ import annotations

from rclpy.exceptions import InvalidHandle
from rclpy.node import Node

from course.runtime.logs.log_store import node_of


def node_name(node: Node | None) -> str:
    """Return the fully qualified name of `node`, also after it has been destroyed."""
    if node is None:
        return ""
    try:
        return str(node.get_fully_qualified_name())
    except InvalidHandle:
        return node_of(str(node.get_logger().name))


def full_name(name: str, namespace: str) -> str:
    """Return a node's fully qualified name, of the two parts in which the graph gives it."""
    return f"{namespace.rstrip('/')}/{name}"


def is_name(full_name: str, name: str) -> bool:
    """Return whether `name` stands for the node `full_name`: in full, or its last parts."""
    return full_name == name or (not name.startswith("/") and full_name.endswith("/" + name))
