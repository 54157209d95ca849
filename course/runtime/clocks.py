"""A node's clock sleeps in the node's own context, and not at all until a time that has passed."""

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

    rclpy also waits for the next /clock if the time has passed already, which a clock that is moved
    step by step may not send before somebody hears from the one who sleeps.
    """
    clock, own = node.get_clock(), node.context

    def sleep_until(until: Time, context: Context | None = None) -> bool:
        context = own if context is None else context
        if context.ok() and until.clock_type == clock.clock_type and clock.now() >= until:
            return True
        return bool(Clock.sleep_until(clock, until, context))

    clock.sleep_until = sleep_until  # type: ignore[method-assign]
