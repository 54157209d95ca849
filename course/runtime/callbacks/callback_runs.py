"""A job is one run of one callback: whose it is, and what became of it."""

from __future__ import annotations

import functools
import inspect
import threading
import time
from collections.abc import Callable
from typing import Any, Protocol

from rclpy.node import Node
from rclpy.task import Task

from course.runtime.callbacks.idleness import Idleness
from course.runtime.logs.log_store import add_line
from course.runtime.ros_names import node_name

Report = Callable[["CallbackRun", BaseException], None]
"""Called when a callback has raised."""


class Home(Protocol):
    """What a job knows of the executor that runs it."""

    threads: int
    session_key: object
    report: Report


class _Current(threading.local):
    job: CallbackRun | None = None


_current = _Current()


def current_job() -> CallbackRun | None:
    """Return the job that runs in this thread, or None outside callbacks."""
    return _current.job


class CallbackRun:
    """One run of an rclpy Task, which it stands in for on an executor.

    One is made for every message that arrives, so it is kept small.
    """

    __slots__ = (
        "entity", "home", "idleness", "node", "shown", "since", "task", "thread_id", "unfinished",
    )  # fmt: skip

    def __init__(
        self, task: Task, entity: object, node: Node | None, home: Home, shown: Any = None
    ) -> None:
        """Take over `task`, made for `entity` of `node`, on the executor `home`.

        `shown` is the callable to name where there is no entity: rclpy makes tasks for the
        execution of a goal and for the done callbacks of a future.
        """
        self.task = task
        self.entity = entity
        self.node = node
        self.home = home
        self.shown = shown
        self.since = time.monotonic()
        self.thread_id = 0
        self.idleness: Idleness | None = None  # once it has kept others waiting
        self.unfinished: dict[str, str] | None = None  # printed without a line end, by level

    @property
    def callback(self) -> Callable[..., Any] | None:
        """What to name when this job fails, if rclpy knows it."""
        return self.shown or getattr(self.entity, "callback", None)

    def __call__(self) -> BaseException | None:
        """Run the callback to its end, or a coroutine to its next await.

        Returns:
            What it raised, or None. No exception leaves a job: the executor goes on.
        """
        outer, _current.job = _current.job, self
        task = self.task
        try:
            task()
            failure: BaseException | None = task.exception() if task.done() else None
            return failure
        except BaseException as error:  # noqa: BLE001 - sys.exit() in a callback must not end spinning
            task.cancel()
            return error
        finally:
            _current.job = outer

    def log_line(self, level: str, text: str) -> None:
        """Log a line that the callback printed."""
        add_line(level, node_name(self.node), text, self.home.session_key)


def wrap_callback(callback: Callable[..., Any]) -> Callable[..., Any]:
    """Return `callback`, made to report what it raises before its caller can swallow it."""

    def failed(error: BaseException) -> None:
        if (job := _current.job) is not None:
            job.home.report(job, error)

    if inspect.iscoroutinefunction(callback):

        @functools.wraps(callback)
        async def run_async(*args: Any) -> Any:
            try:
                return await callback(*args)
            except Exception as error:
                failed(error)
                raise

        return run_async

    @functools.wraps(callback)
    def run(*args: Any) -> Any:
        try:
            return callback(*args)
        except Exception as error:
            failed(error)
            raise

    return run
