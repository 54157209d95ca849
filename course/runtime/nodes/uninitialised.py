"""Node classes whose constructor does not call rclpy's: what raises then says nothing of it."""

from __future__ import annotations

from rclpy.node import Node


def is_uninitialised(node: Node) -> bool:
    """Return whether `Node.__init__` has not run for this node."""
    return not hasattr(node, "handle")


def explain_uninitialised(error: BaseException) -> str:
    """Return what to write, if ``error`` comes of a node that was used uninitialised; else ""."""
    node = getattr(error, "obj", None) if isinstance(error, AttributeError) else None
    if not isinstance(node, Node) or not is_uninitialised(node):
        return ""
    return describe_missing_init(type(node))


def describe_missing_init(node_class: type) -> str:
    """Return one sentence: what a node class lacks, and the line that mends it."""
    return (
        f"{node_class.__name__}.__init__ has not called super().__init__, so this is no node yet: "
        'begin it with super().__init__("a_name"), with the name that the node has on the graph.'
    )
