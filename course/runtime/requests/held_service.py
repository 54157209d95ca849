"""A service whose requests wait until they are answered: at once, late, with a no, or never."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import Executor
from rclpy.node import Node
from rclpy.service import Service
from rclpy.task import Future


class Request:
    """A request that has come to a service of held requests.

    Attributes:
        at_s: when it came, in s of the clock that `hold_requests` was given.
        message: the request itself.
    """

    def __init__(self, at_s: float, message: Any, response: Any, executor: Executor) -> None:
        """Wait for `answer`."""
        self.at_s, self.message, self._response = at_s, message, response
        self._executor = executor
        self.answered = Future(executor=executor)

    def answer(self, **fields: Any) -> None:
        """Send the answer, with these fields; only the first one counts."""
        if self.answered.done():
            return
        for name, value in fields.items():
            setattr(self._response, name, value)
        self.answered.set_result(self._response)
        self._executor.wake()

    def fail(self) -> None:
        """Let the server's callback raise: rclpy then sends no answer at all."""
        if not self.answered.done():
            self.answered.set_exception(RuntimeError("the server of this service raises"))
            self._executor.wake()


def hold_requests(
    node: Node,
    srv_type: Any,
    name: str,
    take: Callable[[Request], object],
    now_s: Callable[[], float],
) -> Service:
    """Serve a service from a node; ``take`` gets each request, which waits for its answer.

    Args:
        node: spun by an executor of a session. Other callbacks of it run while requests wait.
        srv_type: the class of the service's type.
        name: the service.
        take: called with each request, in the order in which they come.
        now_s: tells the time (s) that is noted of each.

    Example:
        >>> requests: list[Request] = []
        >>> hold_requests(node, SetBool, "gripper/set", requests.append, time.monotonic)
        >>> requests[0].answer(success=False)  # once somebody has called it
    """

    async def respond(message: Any, response: Any) -> Any:
        executor = node.executor
        assert isinstance(executor, Executor)
        request = Request(now_s(), message, response, executor)
        take(request)
        return await request.answered

    group = ReentrantCallbackGroup()
    return node.create_service(srv_type, name, respond, callback_group=group)
