"""Simulated time: move the clock of a session's nodes, step by step, and let each step take effect.

Nodes with `use_sim_time` follow /clock (ROS 2 design, "Clock and Time"). A step publishes the new
time, and ends when every node has it and everything that it set off has run: how often a timer
fires then depends on nothing but the clock, whatever the machine's load.
"""

from __future__ import annotations

import math
import threading
import time

from rclpy.clock import ROSClock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.time import Time
from rosgraph_msgs.msg import Clock

from course.errors import SessionError, WaitTimeout
from course.runtime.callbacks.callback_runs import current_job
from course.runtime.executor.executor_pool import ExecutorPool
from course.runtime.executor.quiescence import all_held, come_to_rest, follow_each_other
from course.runtime.nodes.node_registry import NodeRegistry
from course.runtime.rclpy_fixes.clock_sleep import sleeps_until
from course.runtime.requests.hidden_node import Probe
from course.runtime.ros_names import node_name
from course.util import argument_checks

_NS = 1_000_000_000
_LONGEST_STRIDE = 1000  # steps
_POLLED_STRIDE = 5  # steps, where somebody looks again and again: each look takes its time
_STEP_TIMEOUT_S = 10.0  # s of wall time that a callback may hold up one step


class SimulatedTime:
    """The clock of a session with `sim_time=True`; it starts at 0 and moves on demand only."""

    def __init__(self, probe: Probe, pool: ExecutorPool, registry: NodeRegistry) -> None:
        """Move the clock of `registry`, spun by `pool`; `probe` publishes /clock."""
        self._pool = pool
        self._registry = registry
        self._now_ns = 0
        self._moving = threading.Lock()
        # The QoS that ROS 2 gives /clock: the latest time is all that counts.
        qos = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
        self._publisher = probe.node.create_publisher(Clock, "/clock", qos)

    @property
    def now(self) -> float:
        """Simulated time in seconds."""
        return self._now_ns / _NS

    @property
    def now_ns(self) -> int:
        """Simulated time in nanoseconds."""
        return self._now_ns

    def advance(self, seconds: float, step: float = 0.01, patience: float | None = None) -> None:
        """Move the clock on by `seconds`, in steps of `step` seconds.

        After each step, callbacks run until nothing is left to do. A callback that blocks (for
        more than 0.2 s) is left behind in its thread, if the session has more than one.

        Args:
            seconds: of simulated time.
            step: s between two times that nodes get to see, if a timer is due or anybody watches.
            patience: s of wall time that a callback may hold up one step; None for 10.

        Raises:
            SessionError: called from a callback, or with a step or time that is not positive.
            WaitTimeout: a callback kept its node from following for longer than `patience`.
        """
        if (
            any(isinstance(value, int | float) and value < 0 for value in (seconds, step))
            or not step
        ):
            raise SessionError(
                f"Simulated time moves forward, in positive steps: not by {seconds} s in steps of "
                f"{step} s."
            )
        seconds, step = (
            argument_checks.check_seconds(seconds, "seconds"),
            argument_checks.check_seconds(step, "step"),
        )
        if current_job() is not None:
            raise SessionError("A callback cannot move the time that it runs in.")
        with self._moving, all_held(self._pool.all_executors()):
            step_ns, target = round(step * _NS), self._now_ns + round(seconds * _NS)
            while self._now_ns < target:
                moment = min(self._now_ns + self._stride_ns(step_ns), target)
                self._move_to(moment, _STEP_TIMEOUT_S if patience is None else patience)

    def nudge(self) -> None:
        """Tell every node that a nanosecond has passed, wake the executors, and wait for nothing.

        This gives them something to do and hardly a timer a reason to fire: a callback that awaits
        what has come by now goes on. In contrast to `advance`, no callback runs in the calling
        thread, where one might never return.
        """
        with self._moving:
            self._now_ns += 1
            self._publish_time()
        # Nobody hears the time while a callback awaits something in the node's own group.
        for executor in self._pool.all_executors():
            executor.wake()

    def welcome(self, node: Node) -> None:
        """Let a node that has just been made start from the present time.

        Its clock and timers began at 0: the first /clock would make each timer fire at once.
        """
        if self._now_ns and (clock := _simulated_clock(node)) is not None:
            moment = Time(nanoseconds=self._now_ns, clock_type=ClockType.ROS_TIME)
            clock.set_ros_time_override(moment)
            for timer in node.timers:
                if not timer.is_canceled():
                    timer.reset()

    def _stride_ns(self, step_ns: int) -> int:
        """Return how far to move: one step, or several at once if no timer is due in between.

        Nothing can tell the difference, unless others follow /clock or a callback looks at it. A
        callback that sleeps until a time of the clock, by rclpy's own means, is due like a timer. A
        callback that goes on for ever, such as a coroutine that naps and looks again, can tell; but
        to it a few steps are only a nap that took longer. The same holds for a thread that will
        wake a callback which waits for a lock.
        """
        followers = self._following_nodes()
        if self._publisher.get_subscription_count() != len(followers):
            return step_ns
        most, executors = _LONGEST_STRIDE, self._pool.all_executors()
        waits: list[float] = []
        running = [job for executor in executors for job in executor.running.copy()]
        if running and follow_each_other(executors):
            most = _POLLED_STRIDE
        else:
            for job in running:
                if job.idleness is not None and job.idleness.until_woken():
                    most = _POLLED_STRIDE
                    continue
                if (wakes := sleeps_until(job)) is None:
                    return step_ns
                waits.append(wakes - self._now_ns)
        waits += [
            wait
            for node in followers
            for timer in node.timers
            if timer.clock is node.get_clock()
            and (wait := timer.time_until_next_call()) is not None
            and not (running and wait <= 0)  # it waits for a callback of its group to end
        ]
        soonest = min(waits, default=math.inf)
        steps = most if soonest == math.inf else math.ceil(soonest / step_ns)
        return step_ns * min(max(1, steps), most)

    def _move_to(self, moment_ns: int, patience: float) -> None:
        self._now_ns = moment_ns
        deadline = time.monotonic() + patience
        executors = self._pool.all_executors()
        while True:
            self._publish_time()
            settled = come_to_rest(executors, deadline - time.monotonic())
            late = [node for node in self._following_nodes() if _clock_ns(node) < moment_ns]
            if settled and not late:
                return
            if time.monotonic() >= deadline:
                names = ", ".join(node_name(node) for node in late) or "the session"
                raise WaitTimeout(
                    f"{names} did not follow simulated time to {self.now:g} s: "
                    f"a callback has been running for {patience:g} s."
                )
            if late:  # blocked, or the message is on its way
                executors[0].wait_for_a_job(0.001)

    def _publish_time(self) -> None:
        message = Clock()
        message.clock.sec, message.clock.nanosec = divmod(self._now_ns, _NS)
        self._publisher.publish(message)

    def _following_nodes(self) -> list[Node]:
        return [
            entry.node
            for entry in self._registry.list_nodes()
            if not entry.paused and _simulated_clock(entry.node) is not None
        ]


def _simulated_clock(node: Node) -> ROSClock | None:
    clock = node.get_clock()
    return clock if isinstance(clock, ROSClock) and clock.ros_time_is_active else None


def _clock_ns(node: Node) -> int:
    return int(node.get_clock().now().nanoseconds)
