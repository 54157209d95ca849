"""When callbacks of subscriptions ran, and for how long."""

from __future__ import annotations

import functools
import inspect
import threading
import time
import weakref
from collections import deque
from typing import Any, NamedTuple

from rclpy.exceptions import InvalidHandle
from rclpy.node import Node
from rclpy.subscription import Subscription

KEPT_RUNS = 20_000


class Run(NamedTuple):
    """One run of a callback: its node, the message's time of publication, start and end (ns).

    ``sequence`` is the message's number, as in `timeline.Passage`.
    """

    node: str
    published: int
    started: int
    ended: int
    sequence: int = 0


class CallbackTap:
    """Listens to the callbacks of one topic's subscriptions, until `stop`.

    A callback runs as before, with the arguments that it takes; what it raises goes its way.
    However many taps a subscription has, its callback is wrapped once; without any, the wrapper
    stays and only passes on. rclpy reads how many arguments a callback takes when it takes a
    message, and calls it some time later, in another thread maybe: a callback given back in between
    would get an argument too many.
    """

    def __init__(self, topic: str) -> None:
        """Listen to subscriptions of ``topic``, once `watch` has seen their nodes."""
        self.topic = topic
        self._runs: deque[Run] = deque(maxlen=KEPT_RUNS)
        self._heard: weakref.WeakSet[_Wrapped] = weakref.WeakSet()

    def watch(self, nodes: list[Node]) -> None:
        """Listen to the subscriptions that ``nodes`` have now, and to no others. Idempotent."""
        present = [found for node in nodes for found in self._find_subscriptions(node)]
        with _lock:
            wrapped = [_wrap_callback(subscription, name) for subscription, name in present]
            for known in list(self._heard):
                if known not in wrapped:
                    known.remove_listener(self._runs)
                    self._heard.discard(known)
            for found in wrapped:
                found.add_listener(self._runs)
                self._heard.add(found)

    def _find_subscriptions(self, node: Node) -> list[tuple[Subscription, str]]:
        try:
            name = node.get_fully_qualified_name()
            return [(end, name) for end in node.subscriptions if end.topic_name == self.topic]
        except InvalidHandle:  # it has been destroyed just now, or one of its subscriptions has
            return []

    def runs_since(self, moment_ns: int) -> list[Run]:
        """Return the runs that started since a moment (ns since the epoch)."""
        with _lock:
            runs = list(self._runs)
        return [run for run in runs if run.started >= moment_ns]

    @property
    def complete_since(self) -> int:
        """The moment (ns) since when no run has been let go of; 0 if none ever was."""
        with _lock:
            return self._runs[0].started if len(self._runs) == self._runs.maxlen else 0

    def stop(self) -> None:
        """Listen no more. Idempotent."""
        self.watch([])


class _Wrapped:
    """A subscription's callback, wrapped so that taps can listen to its runs."""

    def __init__(self, node: str, original: Any) -> None:
        self._listeners: tuple[deque[Run], ...] = ()  # another one each time, so read at any time
        wants_info = _takes_two(original)

        def keep(info: dict[str, int] | None, started: int) -> None:
            said = info or {}
            run = Run(
                node, said.get("source_timestamp", 0), started, time.time_ns(),
                said.get("publication_sequence_number") or 0,
            )  # fmt: skip
            with _lock:
                for listener in self._listeners:
                    listener.append(run)

        def call(message: Any, info: dict[str, int] | None) -> Any:
            return original(message, info or {}) if wants_info else original(message)

        def plain(message: Any, info: dict[str, int] | None = None) -> Any:
            if not self._listeners:
                return call(message, info)
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
        # Known by the callback alone: a table of them would keep nodes that nobody has any more.
        self.callback.__dict__[_MARK] = self

    def add_listener(self, listener: deque[Run]) -> None:
        """Have a listener hear of the callback; called with the lock held. Idempotent."""
        if not any(known is listener for known in self._listeners):
            self._listeners = (*self._listeners, listener)

    def remove_listener(self, listener: deque[Run]) -> None:
        """Have a listener hear no more; called with the lock held. Idempotent."""
        self._listeners = tuple(known for known in self._listeners if known is not listener)


_MARK = "_course_wrapped"
_lock = threading.Lock()


def _wrap_callback(subscription: Subscription, node: str) -> _Wrapped:
    """Return the wrapper of a subscription's callback, a new one if there is none around it."""
    found = getattr(subscription.callback, "__dict__", {}).get(_MARK)
    if not isinstance(found, _Wrapped) or found.callback is not subscription.callback:
        # New, or somebody has set another callback since: it is that one that runs now.
        found = _Wrapped(node, subscription.callback)
        subscription.callback = found.callback
    return found


def _with_info(message: Any, info: dict[str, int]) -> None:
    """Have the signature of a callback that takes the message's information, too."""


def _takes_two(callback: Any) -> bool:
    """Whether rclpy gives a callback the message's information, too: by the rule that it uses."""
    try:
        inspect.signature(callback).bind(object())
    except TypeError:
        return True
    return False
