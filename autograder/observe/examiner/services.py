"""A service that the examiner plays: it answers when it is told to, late, with a no, or never."""

from __future__ import annotations

from collections.abc import Callable

from autograder.observe.examiner.quiet_node import QuietNode
from autograder.observe.nouns import Service
from course.runtime.requests.held_service import Request, hold_requests

__all__ = ["Request", "ServiceServer"]


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
        hold_requests(self, served.type, str(served), self.requests.append, now_s)

    def release(self) -> bool:
        """Return whether anything was held back that is not the exam's to answer: never."""
        return False
