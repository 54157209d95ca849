"""What DDS itself says about endpoints that do not fit: the incompatible-QoS events of nodes."""

from __future__ import annotations

import weakref
from collections.abc import Iterable
from typing import Any

from rclpy.event_handler import (
    EventHandler,
    QoSPublisherEventType,
    QoSSubscriptionEventType,
)
from rclpy.publisher import Publisher
from rclpy.qos import qos_policy_name_from_kind
from rclpy.subscription import Subscription

_INCOMPATIBLE: tuple[Any, ...] = (
    QoSSubscriptionEventType.RCL_SUBSCRIPTION_REQUESTED_INCOMPATIBLE_QOS,
    QoSPublisherEventType.RCL_PUBLISHER_OFFERED_INCOMPATIBLE_QOS,
)

_named: weakref.WeakKeyDictionary[EventHandler, set[str]] = weakref.WeakKeyDictionary()


def listen_to(handler: EventHandler) -> None:
    """Remember what ``handler`` hears, if it is told of incompatible QoS. Idempotent.

    An executor calls this before it runs a handler for the first time, so that no event is missed,
    however late somebody asks for it. The handlers are those that endpoints have anyway (rclpy
    gives each one that logs a warning): a learner's endpoints are not changed, and their own
    handlers run as before.
    """
    if handler in _named or not any(handler.event_type is kind for kind in _INCOMPATIBLE):
        return
    policies = _named[handler] = set()
    callback = handler.callback

    def heard(event: Any) -> Any:
        policies.add(qos_policy_name_from_kind(event.last_policy_kind))
        return callback(event)

    handler.callback = heard


def incompatible_policies(endpoint: Publisher | Subscription) -> set[str]:
    """Return the policies (RELIABILITY, say) that DDS has named as incompatible for an endpoint."""
    return set().union(*(_named.get(handler, ()) for handler in _event_handlers(endpoint)))


def _event_handlers(endpoint: Publisher | Subscription) -> Iterable[EventHandler]:
    handlers: Any = endpoint.event_handlers  # rclpy's annotation is wrong
    return list(handlers)
