"""When callbacks of subscriptions ran, and for how long."""

from __future__ import annotations

import functools
import inspect
import threading
import time
import weakref
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
    However many taps a subscription has, its callback is wrapped once.
    """

    def __init__(self, topic: str) -> None:
        """Listen to subscriptions of ``topic``, once `watch` has seen their nodes."""
        self.topic = topic
        self._runs: deque[Run] = deque(maxlen=KEPT)

    def watch(self, nodes: list[Node]) -> None:
        """Listen to the subscriptions that ``nodes`` have now, and to no others. Idempotent."""
        present = {
            subscription: node.get_fully_qualified_name()
            for node in nodes
            for subscription in node.subscriptions
            if subscription.topic_name == self.topic
        }
        with _lock:
            for subscription in [known for known in _wrapped if known not in present]:
                _leave(subscription, self._runs)
            for subscription, name in present.items():
                _join(subscription, self._runs, name)

    def since(self, moment_ns: int) -> list[Run]:
        """Return the runs that started since a moment (ns since the epoch)."""
        with _lock:
            runs = list(self._runs)
        return [run for run in runs if run.started >= moment_ns]

    def stop(self) -> None:
        """Give the callbacks back, unless somebody has changed them since. Idempotent."""
        self.watch([])


class _Wrapped:
    """A subscription's callback, wrapped for whoever listens to it."""

    def __init__(self, node: str, original: Any) -> None:
        self.original = original
        self.listeners: list[deque[Run]] = []
        wants_info = _takes_two(original)

        def keep(info: dict[str, int] | None, started: int) -> None:
            run = Run(node, (info or {}).get("source_timestamp", 0), started, time.time_ns())
            with _lock:
                for listener in self.listeners:
                    listener.append(run)

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

        self.callback: Any = coroutine
        if not inspect.iscoroutinefunction(original):
            self.callback = plain
        # What is said of it, and its errors above all, names the learner's own callback.
        functools.update_wrapper(self.callback, original, updated=())
        # rclpy reads the signature to know what to pass, and a moment lies between its two notes of
        # it: a message in that moment comes without its information.
        self.callback.__signature__ = inspect.signature(_with_info)


_wrapped: weakref.WeakKeyDictionary[Subscription, _Wrapped] = weakref.WeakKeyDictionary()
_lock = threading.Lock()


def _join(subscription: Subscription, listener: deque[Run], node: str) -> None:
    """Have a listener hear of a subscription's callback; called with the lock held."""
    wrapped = _wrapped.get(subscription)
    if wrapped is None or subscription.callback is not wrapped.callback:
        # New, or somebody has set another callback since: it is that one that runs now.
        heard = wrapped.listeners if wrapped else []
        wrapped = _wrapped[subscription] = _Wrapped(node, subscription.callback)
        wrapped.listeners = heard
        subscription.callback = wrapped.callback
    if not any(known is listener for known in wrapped.listeners):
        wrapped.listeners = [*wrapped.listeners, listener]


def _leave(subscription: Subscription, listener: deque[Run]) -> None:
    """Have a listener hear no more, and the last one leave all as it was; the lock is held."""
    wrapped = _wrapped[subscription]
    wrapped.listeners = [known for known in wrapped.listeners if known is not listener]
    if not wrapped.listeners:
        del _wrapped[subscription]
        if subscription.callback is wrapped.callback:
            subscription.callback = wrapped.original


def _with_info(message: Any, info: dict[str, int]) -> None:
    """Have the signature of a callback that takes the message's information, too."""


def _takes_two(callback: Any) -> bool:
    """Whether rclpy gives a callback the message's information, too: by the rule that it uses."""
    try:
        inspect.signature(callback).bind(object())
    except TypeError:
        return True
    return False
