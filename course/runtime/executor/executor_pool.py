"""The executors of one session: one for each number of threads asked for, made when needed."""

from __future__ import annotations

import threading
import time

from rclpy.context import Context
from rclpy.node import Node

from course.runtime.callbacks.callback_runs import Report
from course.runtime.executor.background import BackgroundExecutor
from course.runtime.ros_names import node_name
from course.runtime.waiting import Pulse


class ExecutorPool:
    """Makes, finds and stops a session's executors."""

    def __init__(self, context: Context, label: str, report: Report, pulse: Pulse) -> None:
        """Prepare for executors on `context`; their threads are named after `label`."""
        self._context = context
        self._label = label
        self._report = report
        self._pulse = pulse
        self._executors: dict[tuple[int, str], BackgroundExecutor] = {}
        self._ended: list[BackgroundExecutor] = []
        self._lock = threading.Lock()

    def get_executor(self, threads: int, purpose: str = "") -> BackgroundExecutor:
        """Return the spinning executor of `threads` threads for `purpose`; make it at first use."""
        with self._lock:
            executor = self._executors.get((threads, purpose))
            if executor is None or executor.has_ended:  # a callback may shut its executor down
                if executor is not None:
                    self._ended.append(executor)
                name = f"{self._label} {purpose}".rstrip()
                executor = BackgroundExecutor(
                    self._context,
                    threads,
                    name,
                    report=self._report,
                    pulse=self._pulse,
                    session_key=self,
                )
                self._executors[threads, purpose] = executor
                executor.start()
            return executor

    def all_executors(self) -> list[BackgroundExecutor]:
        """Return the executors made so far."""
        with self._lock:
            return [*self._ended, *self._executors.values()]

    def all_nodes(self) -> list[Node]:
        """Return the nodes of all executors."""
        return [node for executor in self.all_executors() for node in executor.get_nodes()]

    def has_thread(self, thread: threading.Thread) -> bool:
        """Return whether `thread` belongs to one of the executors."""
        return any(executor.has_thread(thread) for executor in self.all_executors())

    def stop(self, deadline: float) -> None:
        """Stop them all; return when no callback runs any more, or at `deadline`."""
        for executor in self.all_executors():
            executor.request_stop()
        self.find_leaks(deadline)

    def find_leaks(self, deadline: float) -> list[str]:
        """Return what still runs at `deadline`: the thread, and whose callback.

        To be called once they have been stopped.
        """
        return [
            f"{thread.name}{_busy_with(executor, thread)}"
            for executor in self.all_executors()
            for thread in executor.join(deadline)
        ]

    def shutdown(self, deadline: float) -> None:
        """Free what the stopped executors hold of rclpy."""
        for executor in self.all_executors():
            executor.shutdown(timeout_sec=max(0.0, deadline - time.monotonic()))


def _busy_with(executor: BackgroundExecutor, thread: threading.Thread) -> str:
    jobs = executor.running.copy() | executor.given_up.copy()
    names = [node_name(job.node) for job in jobs if job.thread_id == thread.ident]
    return f" (a callback of {names[0]})" if names else ""
