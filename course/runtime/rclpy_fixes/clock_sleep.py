"""Sleeping by a node's clock: in the node's own context, and seen from the outside."""

from __future__ import annotations

import math
import sys

from rclpy.clock import Clock, ROSClock
from rclpy.context import Context
from rclpy.node import Node
from rclpy.time import Time

from course.runtime.callbacks.callback_runs import CallbackRun

_RATE_DEPTH = 3  # frames from a lock of `threading` to the `Rate.sleep` that waits for it


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


def sleeps_until(job: CallbackRun) -> float | None:
    """Return the simulated time (ns) at which a callback goes on that sleeps by its node's clock.

    Infinity for one in `Rate.sleep`: a timer of its node wakes it. None: it does something else, or
    its time has come.
    """
    if job.node is None or not isinstance(clock := job.node.get_clock(), ROSClock):
        return None
    if not clock.ros_time_is_active:
        return None
    frame = sys._current_frames().get(job.thread_id)
    for depth in range(_RATE_DEPTH + 1):
        if frame is None:
            break
        where = frame.f_globals.get("__name__"), frame.f_code.co_name
        if where == ("rclpy.timer", "sleep"):
            return math.inf
        if where == ("rclpy.clock", "sleep_until") and not depth:
            until = frame.f_locals.get("until")
            if frame.f_locals.get("self") is clock and isinstance(until, Time):
                return float(until.nanoseconds) if until > clock.now() else None
            break
        frame = frame.f_back
    return None


def sleeps_by_clock(job: CallbackRun) -> bool:
    """Return whether a callback does nothing until its node's clock moves on, by `sleep_until`.

    Known from where it is: whether its thread has come to rest by now makes no difference.
    """
    return math.isfinite(sleeps_until(job) or math.inf)
