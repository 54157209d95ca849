"""What DDS itself says about endpoints that do not fit: the incompatible-QoS events of nodes."""

# mypy: allow-untyped-calls

from __future__ import annotations

import threading
import weakref
from collections.abc import Callable, Iterable
from typing import Any

from rclpy.event_handler import EventHandler, QoSSubscriptionEventType
from rclpy.node import Node
from rclpy.qos import qos_policy_name_from_kind

_INCOMPATIBLE = QoSSubscriptionEventType.RCL_SUBSCRIPTION_REQUESTED_INCOMPATIBLE_QOS


class IncompatibleQoS:
    """Remembers, by topic and node, which policy DDS last named in an incompatible-QoS event.

    It listens in on the handlers that subscriptions have anyway (rclpy gives each one that logs a
    warning), so a learner's endpoints are not changed. One that was made since the last look, and
    whose event has fired already, is missed: then the announced QoS has to tell.
    """

    def __init__(self) -> None:
        """Know of nothing yet."""
        self._named: dict[tuple[str, str], str] = {}
        self._known: weakref.WeakSet[EventHandler] = weakref.WeakSet()
        self._lock = threading.Lock()

    def watch(self, nodes: Iterable[Node]) -> None:
        """Listen to every subscription of ``nodes``. Idempotent."""
        with self._lock:
            for node in nodes:
                for subscription in node.subscriptions:
                    handlers: Any = subscription.event_handlers  # rclpy's annotation is wrong
                    for handler in handlers:
                        if handler.event_type == _INCOMPATIBLE and handler not in self._known:
                            self._known.add(handler)
                            where = (subscription.topic_name, node.get_fully_qualified_name())
                            handler.callback = self._listening(where, handler.callback)

    def policy(self, topic: str, node: str) -> str | None:
        """Return the policy that DDS named last for a node's subscription, such as RELIABILITY."""
        return self._named.get((topic, node))

    def _listening(
        self, where: tuple[str, str], callback: Callable[[Any], Any]
    ) -> Callable[[Any], Any]:
        def heard(event: Any) -> Any:
            self._named[where] = qos_policy_name_from_kind(event.last_policy_kind)
            return callback(event)

        return heard
