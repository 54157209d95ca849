"""Looks at nodes in one network, waits for what they do, and asks their services."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Any

from autograder.exercises.resources.camera_examiner import ExaminerNode
from autograder.observe.patience import IDLE_S, SETTLE_S, Patience
from autograder.observe.stillness import Stillness
from autograder.processes.outside.asking import Outside
from course.errors import WaitTimeout
from course.runtime.core_session import CoreSession
from course.runtime.waiting import Deadline

RESEND = 1.0
"""Seconds after which a request that has no response is made again."""
NUDGE = 0.05
"""Seconds after which a callback that does not answer may be one that awaits something."""


class Observer:
    """Someone in the network of a subject, or of a program of its own."""

    def __init__(self, session: CoreSession, outside: Outside) -> None:
        """Bring up endpoints in ``session``; ``outside`` looks at the processes."""
        self.session = session
        self._still = Stillness(outside)
        node = session.run(ExaminerNode)
        assert isinstance(node, ExaminerNode)
        self.node = node
        self._clients: dict[str, Any] = {}
        self.requests = 0  # that were made of services so far
        self.waited = 0.0  # s of wall time that the last wait took which had no time-out

    def error_note(self) -> str:
        """Return what the student's callbacks are known to have raised, as the end of a sentence.

        From outside it is not.
        """
        return ""

    def nudge(self) -> None:
        """Give the executors of who is asked something to do; on a robot the next tick does."""

    def is_gone(self) -> bool:
        """Whether who is asked has gone, so that there is nothing to wait for."""
        return False

    def wait(
        self, condition: Callable[[], Any], timeout: float | None = None, idle: float = IDLE_S
    ) -> bool:
        """Wait until ``condition`` holds, for ``timeout`` s; return whether it did by then.

        Without ``timeout`` as long as it may come: until all have slept for ``idle`` s, see
        `Patience`. `end_of_wait` says afterwards when that was.
        """
        if timeout is None:
            patience = self.start_patience(idle)
            holds = patience.wait(self.session, condition)
            self.waited = patience.seconds_spent
            return holds
        with suppress(WaitTimeout):
            self.session.until(condition, timeout=timeout, what="an observation")
            return True
        return False

    @property
    def end_of_wait(self) -> str:
        """When the last wait without a time-out was over, as a phrase."""
        if self.waited < SETTLE_S:
            return "when nothing was at work any more"
        return f"{SETTLE_S:.0f} s later"

    def start_patience(self, idle: float = IDLE_S, seconds: float = SETTLE_S) -> Patience:
        """Begin to wait for as long as something may take: see `Patience`."""
        return Patience(self._still, seconds, idle)

    def ask(self, service: Any, name: str, request: Any, *, nudging: bool = False) -> Any:
        """Call a service; return its response, or None if none came in time.

        A response that goes out before its way back is known is lost: it is asked for again, so
        this is for requests that may be made twice. ``nudging``: a callback may await something.
        """
        client = self.get_client(service, name)
        self.wait(client.service_is_ready)
        patience = self.start_patience()
        replies: list[Any] = []
        while patience.has_time_left() and not self.is_gone():
            replies.append(client.call_async(request))
            self.requests += 1
            again = Deadline(RESEND)
            while again.seconds_left and patience.has_time_left() and not self.is_gone():
                self.wait(lambda: any(reply.done() for reply in replies), NUDGE)
                for reply in replies:
                    if reply.done():
                        return reply.result()
                if nudging:
                    self.nudge()
        return None

    def get_client(self, service: Any, name: str) -> Any:
        """Return the client of a service, one for all lives of its server."""
        if name not in self._clients:
            self._clients[name] = self.node.create_client(service, name)
        return self._clients[name]
