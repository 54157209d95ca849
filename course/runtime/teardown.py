"""Take nodes down completely: the node, and what rclpy's destroy_node() leaves behind."""

from __future__ import annotations

import contextlib

from rcl_interfaces.msg import ParameterEvent
from rclpy.action.client import ActionClient
from rclpy.action.server import ActionServer
from rclpy.exceptions import InvalidHandle
from rclpy.lifecycle import LifecycleNodeMixin
from rclpy.node import Node


def destroy_node(node: Node) -> bool:
    """Destroy `node` with its action servers and clients. Idempotent.

    No executor may be waiting on the node. rclpy's own destroy_node() leaves action entities
    alive, and with them the node's endpoints on the ROS graph.

    Returns:
        Whether the class's own `destroy_node()` left the node on the graph.
    """
    left = False
    # The node's own method first: a class that overrides it destroys its action server itself,
    # and rclpy does not take that twice.
    try:
        with contextlib.suppress(InvalidHandle):
            node.destroy_node()
    finally:
        left = is_alive(node)
        destroy_leftovers(node)
    return left


def destroy_leftovers(node: Node) -> None:
    """Destroy what a class's own `destroy_node()` may have left; it is not called. Idempotent."""
    for waitable in list(node.waitables):
        if isinstance(waitable, ActionServer | ActionClient):
            with contextlib.suppress(InvalidHandle, ValueError):  # destroyed already
                waitable.destroy()
    # An override that raised, or did not call the base method, must leave no ghost.
    with contextlib.suppress(InvalidHandle):
        Node.destroy_node(node)
    _destroy_state_machine(node)


def _destroy_state_machine(node: Node) -> None:
    """Take the services of a managed node off the graph.

    They belong to its state machine, which rclpy leaves to Python's garbage collection.
    """
    machine = getattr(node, "_state_machine", None)
    if isinstance(node, LifecycleNodeMixin) and machine is not None:
        with contextlib.suppress(InvalidHandle):  # destroyed already
            machine.destroy_when_not_in_use()


def is_alive(node: Node) -> bool:
    """Return whether `node` has been made and not been destroyed."""
    try:
        with node.handle:
            return True
    except (InvalidHandle, AttributeError, TypeError):  # super().__init__() not reached
        return False


def is_being_destroyed(node: Node) -> bool:
    """Return whether `destroy_node()` of `node` has begun, or ended: its entities are going.

    The publisher that rclpy gives every node first is also the first that it destroys.
    """
    return not any(publisher.msg_type is ParameterEvent for publisher in node.publishers)
