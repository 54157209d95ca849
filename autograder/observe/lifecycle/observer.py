"""Looks at nodes in one network, waits for what they do, and asks their services.

Nothing waits for a fixed time: while somebody is at work on what is waited for, a busy machine is
given `SETTLE_S`; once all threads sleep, little time is enough (`Patience`).
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import Any

from rclpy.node import Node

from autograder.observe.lifecycle.process_holdings import ProcessHoldings
from autograder.observe.patience import IDLE_S, SETTLE_S, Patience
from autograder.observe.stillness import Stillness
from autograder.processes.outside.asking import Outside
from course.errors import WaitTimeout
from course.runtime.core_session import CoreSession
from course.runtime.waiting import Deadline

RESEND_S = 1.0
"""Seconds after which a request that has no response is made again."""
NUDGE_S = 0.05
"""Seconds after which a callback that does not answer may be one that awaits something."""
LOOK_S = 0.1
"""Seconds between two looks at a number whose highest value is wanted."""
ENDED_S, SOON_S = 1.5, 0.5
"""Seconds in which all sleep that something may take to end, where a task allows one second; and
that it may take to be woken up by another thread."""


class Observer:
    """Someone in the network of a subject, or of a plain program.

    Attributes:
        session: the examiner's session in that network.
        node: its node there, which has the endpoints that an exam needs.
        outside: looks at the processes.
        process: what these hold.
        requests: how many requests were made of services so far.
    """

    def __init__(self, session: CoreSession, outside: Outside, node: Node) -> None:
        """Look on through ``node``, which runs in ``session``."""
        self.session, self.outside, self.node = session, outside, node
        self.process = ProcessHoldings(outside)
        self.requests = 0
        self._still = Stillness(outside)
        self._clients: dict[str, Any] = {}
        self._waited_s = 0.0

    # What another kind of observer knows better.

    def error_note(self) -> str:
        """Return what callbacks are known to have raised, as the end of a sentence."""
        return ""

    def nudge(self) -> None:
        """Give the executors of who is asked something to do; on a robot the next tick does."""

    def is_gone(self) -> bool:
        """Whether who is observed has gone, so that there is nothing to wait for."""
        return False

    # Waiting.

    def start_patience(self, idle: float = IDLE_S, seconds: float = SETTLE_S) -> Patience:
        """Begin to wait for as long as something may take: see `Patience`."""
        return Patience(self._still, seconds, idle)

    def wait(
        self, condition: Callable[[], Any], timeout: float | None = None, idle: float = IDLE_S
    ) -> bool:
        """Wait until a condition holds; return whether it did in time.

        Args:
            condition: is looked at after each callback of the examiner's.
            timeout: seconds; without it as long as it may come, that is until all threads have
                slept for ``idle`` s. `end_of_wait` says afterwards when that was.
            idle: seconds.
        """
        holds = False

        def is_over() -> bool:
            nonlocal holds
            holds = bool(condition())
            if not holds and self.is_gone():
                holds = bool(condition())  # its end may be what is waited for
                return True
            return holds

        if timeout is None:
            patience = self.start_patience(idle)
            patience.wait(self.session, is_over)
            self._waited_s = patience.seconds_spent
        else:
            with suppress(WaitTimeout):
                self.session.until(is_over, timeout=timeout, what="an observation")
        return holds

    @property
    def end_of_wait(self) -> str:
        """When the last wait without a time-out was over, as a phrase."""
        if self._waited_s < SETTLE_S:
            return "when nothing was at work any more"
        return f"{SETTLE_S:.0f} s later"

    def wait_for_rest(self) -> bool:
        """Return True when all that was sent has been dealt with, False if a thread never rests."""
        return self._still.wait_for_rest()

    def wait_for_end(self, over: Callable[[], Any], among: Iterable[int] | None = None) -> bool:
        """Wait for what a task gives a second to end; return whether it did.

        Where no thread sleeps for such a time, and there is no other process, nobody wakes up by
        itself.

        Args:
            over: whether it has ended.
            among: the threads that may have a part in it; None for all.
        """
        if self.wait(over, idle=SOON_S):
            return True
        if self.is_gone():
            return False
        nobody_wakes = min(self.process.wake_times(among), default=ENDED_S) >= ENDED_S
        if nobody_wakes and not self.process.other_processes():
            return False
        return self.wait(over, idle=ENDED_S)

    def highest_during(self, act: Callable[[], object], look: Callable[[], int]) -> int:
        """Return the highest number that was seen while something was done that takes its time.

        Args:
            act: what is done; nobody else is asked for anything meanwhile.
            look: returns the number; it looks from outside, every tenth of a second.
        """
        over, seen = threading.Event(), [look()]

        def look_again() -> None:
            while not over.wait(LOOK_S):
                seen.append(look())

        with ThreadPoolExecutor(max_workers=1) as beside:
            looking = beside.submit(look_again)
            try:
                act()
            finally:
                over.set()
        looking.result()
        return max(seen)

    # Services.

    def ask(self, service: Any, name: str, request: Any, *, nudging: bool = False) -> Any:
        """Call a service; return its response, or None if none came in time.

        A response that goes out before its way back is known is lost: it is asked for again, so
        this is for requests that may be made twice.

        Args:
            service: its type, such as ``Trigger``.
            name: its full name.
            request: what is sent.
            nudging: whether a callback may await something, and has to be woken up.
        """
        client = self.client_of(service, name)
        self.wait(client.service_is_ready)
        patience = self.start_patience()
        replies: list[Any] = []
        while patience.has_time_left() and not self.is_gone():
            replies.append(client.call_async(request))
            self.requests += 1
            again = Deadline(RESEND_S)
            while again.seconds_left and patience.has_time_left() and not self.is_gone():
                self.wait(lambda: any(reply.done() for reply in replies), NUDGE_S)
                for reply in replies:
                    if reply.done():
                        return reply.result()
                if nudging:
                    self.nudge()
        return None

    def client_of(self, service: Any, name: str) -> Any:
        """Return the examiner's client of a service, one for all lives of its server."""
        if name not in self._clients:
            self._clients[name] = self.node.create_client(service, name)
        return self._clients[name]
