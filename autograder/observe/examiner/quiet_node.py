"""The kind of node that an examiner has: it adds as little as it can to what it observes."""

from __future__ import annotations

from typing import Any

from rclpy.context import Context
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.node import Node

from autograder.observe.participants import note_own

_UNHEARD_PUBLISHER = PublisherEventCallbacks(use_default_callbacks=False)
_UNHEARD_SUBSCRIPTION = SubscriptionEventCallbacks(use_default_callbacks=False)


class QuietNode(Node):
    """A node without services, without logs over DDS, and without events nobody asked for.

    rclpy would listen to two events of each endpoint, log what DDS does not connect as warnings,
    and have its executor wait for all of them again before each callback: half of its work.
    """

    def __init__(self, name: str, context: Context | None = None) -> None:
        """Create it as ``name``, which nobody else should use; ``context``: not the default."""
        super().__init__(name, context=context, start_parameter_services=False, enable_rosout=False)
        note_own(self)

    def create_publisher(self, *arguments: Any, **options: Any) -> Any:
        """Create a publisher as every node does, with ``event_callbacks`` only if given."""
        return super().create_publisher(
            *arguments, **{"event_callbacks": _UNHEARD_PUBLISHER, **options}
        )

    def create_subscription(self, *arguments: Any, **options: Any) -> Any:
        """Create a subscription as every node does, with ``event_callbacks`` only if given."""
        return super().create_subscription(
            *arguments, **{"event_callbacks": _UNHEARD_SUBSCRIPTION, **options}
        )
