"""Callbacks of the examiner's servers that wait until they are told to go on."""

from __future__ import annotations

from collections import deque

from rclpy.executors import Executor
from rclpy.node import Node
from rclpy.task import Future


class DeferredReplies:
    """The callbacks that wait, each in the executor of its server."""

    def __init__(self) -> None:
        """None yet."""
        self._waiting: deque[tuple[Executor, Future]] = deque()

    async def wait(self, server: Node) -> None:
        """Wait, in a callback of the ``server``, until all are released."""
        executor = server.executor
        assert isinstance(executor, Executor)
        over = Future(executor=executor)
        self._waiting.append((executor, over))
        await over

    def release(self) -> bool:
        """Let all go on; return whether there were any."""
        released = False
        while self._waiting:
            executor, over = self._waiting.popleft()
            over.set_result(None)
            executor.wake()
            released = True
        return released
