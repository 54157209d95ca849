"""A service that the examiner plays: it answers when it is told to, late, with a no, or never."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import Executor
from rclpy.node import Node
from rclpy.service import Service as RosService
from rclpy.task import Future

from autograder.observe.examiner.quiet_node import QuietNode
from autograder.observe.nouns import Service


class Request:
    """A request that the student's node has sent to a service which the examiner plays.

    Attributes:
        at_s: when it came, in s of the node's time.
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
            self.answered.set_exception(RuntimeError("the examiner's server raises"))
            self._executor.wake()


def hold_requests(
    node: Node, service: Service, requests: list[Request], now_s: Callable[[], float]
) -> RosService:
    """Serve a service from a node; each request is added to ``requests``, and waits there.

    ``now_s`` tells the time of the node under test, in s.
    """

    async def respond(message: Any, response: Any) -> Any:
        executor = node.executor
        assert isinstance(executor, Executor)
        request = Request(now_s(), message, response, executor)
        requests.append(request)
        return await request.answered

    group = ReentrantCallbackGroup()
    return node.create_service(service.type, str(service), respond, callback_group=group)


class ServiceServer(QuietNode):
    """A server in a node of its own, which may vanish with all the requests that it has.

    Attributes:
        served: the service.
        requests: what has come, in order; each waits until it is answered.
    """

    def __init__(self, served: Service, now_s: Callable[[], float]) -> None:
        """Serve; ``now_s`` tells the time of the node under test, in s."""
        super().__init__(f"server_of_{served.name.replace('/', '_')}")
        self.served = served
        self.requests: list[Request] = []
        hold_requests(self, served, self.requests, now_s)

    def release(self) -> bool:
        """Return whether anything was held back that is not the exam's to answer: never."""
        return False
