"""A node's clock sleeps in the node's own context, whatever the process's default context is."""

# mypy: allow-untyped-calls

from __future__ import annotations

from rclpy.clock import Clock
from rclpy.context import Context
from rclpy.node import Node
from rclpy.time import Time


def sleeps_in_own_context(node: Node) -> None:
    """Let ``node.get_clock().sleep_for(...)`` and ``sleep_until(...)`` do without ``context=``.

    rclpy takes the process's default context then, although the clock is a node's; a session
    beside the notebook's own is not that context, and rclpy would raise NotInitializedException.
    """
    clock, own = node.get_clock(), node.context

    def sleep_until(until: Time, context: Context | None = None) -> bool:
        return bool(Clock.sleep_until(clock, until, own if context is None else context))

    clock.sleep_until = sleep_until  # type: ignore[method-assign]
