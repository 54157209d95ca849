"""Messages that an examiner publishes at a rate, as a sensor does."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager

from rclpy.node import Node

AHEAD = 4
"""Messages that may be on their way into a node, if it is not said otherwise."""
LAG_S = 1.0
"""Seconds that the next message waits for those on their way: a node may drop some."""
UNLIMITED = 2**31
"""Messages of a stream that goes on until it is stopped."""
CATCH_UP_S = 0.25
"""Seconds whose messages may be on their way in when they are to come in at their rate."""


class MessageStream:
    """Numbered messages that are published at a rate until it is stopped.

    No faster than the node under test takes them: on a busy machine a node with a short queue would
    lose what it could not take, and that would not be its fault.

    Attributes:
        sent: how many are out.
    """

    def __init__(
        self, node: Node, rate_hz: float, send: Callable[[int], None], newest: Callable[[], int],
        *, ahead: int = AHEAD, limit: int = UNLIMITED,
    ) -> None:  # fmt: skip
        """Begin at once.

        Args:
            node: the examiner's, which has the timer.
            rate_hz: messages a second.
            send: publishes the message of a number.
            newest: returns the number of the newest that the node under test has dealt with, -1 if
                there is none.
            ahead: how many may be on their way.
            limit: how many there are.
        """
        self.sent = 0
        self._rate_hz, self._send, self._newest = rate_hz, send, newest
        self._ahead, self._limit = ahead, limit
        self._on_time: tuple[float, int] | None = None
        self._since = time.monotonic()
        self._turn = threading.Lock()
        self._timer = node.create_timer(1 / rate_hz, self._send_due)

    def slow_down(self) -> None:
        """Publish the next only when the node has dealt with the one before, from now on.

        On a busy machine messages would keep a thread from what waits for it.
        """
        with self._turn:
            self._ahead = 1

    def keep_rate(self) -> None:
        """Keep to the rate on average from now on, though the node may lose some.

        A busy machine skips turns of a timer, so that messages come in more slowly than on a robot,
        and a consumer that is too slow would keep up. What was skipped is caught up with.
        """
        with self._turn:
            self._ahead = max(AHEAD, int(CATCH_UP_S * self._rate_hz))
            self._on_time = time.monotonic(), self.sent

    @contextmanager
    def hold_back(self) -> Iterator[None]:
        """Publish nothing for the length of the block."""
        with self._turn:
            limit, self._limit = self._limit, 0
        try:
            yield
        finally:
            self._limit = limit

    def stop(self) -> None:
        """Publish no more."""
        self._limit = 0
        self._timer.cancel()

    def _send_due(self) -> None:
        with self._turn:
            for _ in range(self._count_due()):
                if self.sent >= self._limit or self._is_waiting():
                    break
                self._send(self.sent)
                self.sent += 1
                self._since = time.monotonic()

    def _count_due(self) -> int:
        if self._on_time is None:
            return 1
        since, sent = self._on_time
        return int((time.monotonic() - since) * self._rate_hz) + sent - self.sent

    def _is_waiting(self) -> bool:
        if time.monotonic() - self._since > LAG_S:
            return False
        return self.sent - self._newest() > self._ahead


@contextmanager
def hold_streams(streams: Iterable[MessageStream]) -> Iterator[None]:
    """Publish nothing on any of these for the length of the block."""
    with ExitStack() as held:
        for stream in streams:
            held.enter_context(stream.hold_back())
        yield
