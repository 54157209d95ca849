"""When callbacks of subscriptions ran, and for how long."""

from __future__ import annotations

import inspect
import threading
import time
from collections import deque
from typing import Any, NamedTuple

from rclpy.node import Node
from rclpy.subscription import Subscription

KEPT = 20_000


class Run(NamedTuple):
    """One run of a callback: its node, the message's time of publication, start and end (ns)."""

    node: str
    published: int
    started: int
    ended: int


class CallbackTap:
    """Listens to the callbacks of one topic's subscriptions, until `stop` gives them back.

    A callback runs as before, with the arguments that it takes; what it raises goes its way.
    """

    def __init__(self, topic: str) -> None:
        """Listen to subscriptions of ``topic``, once `watch` has seen their nodes."""
        self.topic = topic
        self._runs: deque[Run] = deque(maxlen=KEPT)
        self._tapped: dict[Subscription, tuple[Any, Any]] = {}
        self._lock = threading.Lock()

    def watch(self, nodes: list[Node]) -> None:
        """Listen to the subscriptions that ``nodes`` have now. Idempotent."""
        with self._lock:
            for node in nodes:
                for subscription in node.subscriptions:
                    if subscription.topic_name == self.topic and not self._has(subscription):
                        self._tap(node.get_fully_qualified_name(), subscription)

    def since(self, moment_ns: int) -> list[Run]:
        """Return the runs that started since a moment (ns since the epoch)."""
        with self._lock:
            runs = list(self._runs)
        return [run for run in runs if run.started >= moment_ns]

    def stop(self) -> None:
        """Give the callbacks back, unless somebody has changed them since. Idempotent."""
        with self._lock:
            for subscription, (tapped, original) in self._tapped.items():
                if subscription.callback is tapped:
                    subscription.callback = original
            self._tapped.clear()

    def _has(self, subscription: Subscription) -> bool:
        known = self._tapped.get(subscription)
        return known is not None and subscription.callback is known[0]

    def _tap(self, node: str, subscription: Subscription) -> None:
        original = subscription.callback
        wants_info = _takes_two(original)

        def keep(info: dict[str, int] | None, started: int) -> None:
            run = Run(node, (info or {}).get("source_timestamp", 0), started, time.time_ns())
            with self._lock:
                self._runs.append(run)

        def call(message: Any, info: dict[str, int] | None) -> Any:
            return original(message, info or {}) if wants_info else original(message)

        def plain(message: Any, info: dict[str, int] | None = None) -> Any:
            started = time.time_ns()
            try:
                return call(message, info)
            finally:
                keep(info, started)

        async def coroutine(message: Any, info: dict[str, int] | None = None) -> Any:
            started = time.time_ns()
            try:
                return await call(message, info)
            finally:
                keep(info, started)

        tapped: Any = coroutine if inspect.iscoroutinefunction(original) else plain
        # rclpy reads the signature to know what to pass, and a moment lies between its two notes of
        # it: a message in that moment comes without its information.
        tapped.__signature__ = inspect.signature(_with_info)
        self._tapped[subscription] = (tapped, original)
        subscription.callback = tapped


def _with_info(message: Any, info: dict[str, int]) -> None:
    """Have the signature of a callback that takes the message's information, too."""


def _takes_two(callback: Any) -> bool:
    """Whether rclpy gives a callback the message's information, too: by the rule that it uses."""
    try:
        inspect.signature(callback).bind(object())
    except TypeError:
        return True
    return False
