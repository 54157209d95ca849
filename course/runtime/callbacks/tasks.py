"""Records to which node a task belongs: rclpy makes tasks for what has no entity of its own.

The execution of a goal is one, the done callback of a future another. Without a record of who
created them, nobody could tell whose mistake it is when one fails.
"""

from __future__ import annotations

import threading
import weakref
from collections.abc import Callable, Iterable
from typing import Any

from rclpy.node import Node
from rclpy.task import Task
from rclpy.waitable import Waitable

from course.runtime.callbacks.callback_runs import current_job, wrap_callback

Owner = tuple[Node | None, Any]
"""The node that a task is put to, and the callable to name when it fails."""


class CreatedTasks:
    """The tasks that were created on one executor and are not done. Thread-safe."""

    def __init__(self) -> None:
        """Start without any."""
        self._owners: weakref.WeakKeyDictionary[Task, Owner] = weakref.WeakKeyDictionary()
        self._lock = threading.RLock()

    def create(self, make: Callable[[], Task], owner: Owner) -> Task:
        """Return the task that `make` schedules, put to `owner` before anybody can run it."""
        with self._lock:
            task = make()
            self._owners[task] = owner
            return task

    def owner_of(self, task: Task) -> Owner:
        """Return whose `task` is."""
        with self._lock:
            return self._owners.get(task, (None, None))

    def forget(self, task: Task) -> None:
        """Let go of a task that is done."""
        with self._lock:
            self._owners.pop(task, None)

    def unfinished_tasks(self) -> list[Task]:
        """Return the tasks that are not done."""
        with self._lock:
            return list(self._owners)


def find_owner(
    callback: Any, args: tuple[Any, ...], nodes: Iterable[Node]
) -> tuple[Owner, tuple[Any, ...]]:
    """Return who owns a task that is to call `callback(*args)`, and what to call it with."""
    bound_to = getattr(getattr(callback, "func", callback), "__self__", None)
    if isinstance(bound_to, Waitable):  # an action server starts the execution of a goal
        node = next((node for node in nodes if bound_to in node.waitables), None)
        shown = next((arg for arg in args if callable(arg)), callback)
        # rclpy swallows what an execute callback raises: hear of it before rclpy does.
        return (node, shown), tuple(wrap_callback(arg) if arg is shown else arg for arg in args)
    if isinstance(bound_to, Node):
        return (bound_to, callback), args
    job = current_job()
    return (None if job is None else job.node, callback), args
