"""A subscription that joins late, and what it is handed of what was published before."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from autograder.examination.exam import Failed
from autograder.observe.examiner.merged_subscriptions import MergedSubscription
from autograder.observe.nouns import Topic
from autograder.observe.participants import of_others
from autograder.observe.stepped_time.stepped_observer import SteppedObserver

QUIET_S, COARSE_S, TICK_S = 8.0, 0.5, 0.05
"""Seconds of the node's time after which a change is long past, and between two moments of it; and
between two looks where one message is reckoned from another."""


class LateSubscription:
    """Begins now, and asks for what was published before, if that is kept.

    Only a reliable reader is handed what a durable writer keeps (DDS 1.4, 2.2.3.4).

    Attributes:
        is_durable: whether every publisher keeps it for those who join late.
        unkept: if not, why, as a phrase: "VOLATILE".
    """

    def __init__(self, node: Node, topic: Topic) -> None:
        """Subscribe a ``node`` of the examiner's, so that every publisher there is matches."""
        offers = [e.qos_profile for e in of_others(node.get_publishers_info_by_topic(str(topic)))]
        reliable = bool(offers) and all(
            offer.reliability == ReliabilityPolicy.RELIABLE for offer in offers
        )
        kept = [offer.durability == DurabilityPolicy.TRANSIENT_LOCAL for offer in offers]
        self.is_durable = reliable and all(kept)
        self.unkept = "TRANSIENT_LOCAL, but BEST_EFFORT" if offers and all(kept) else "VOLATILE"
        self._topic, self._heard = topic, list[Any]()
        durable, volatile = DurabilityPolicy.TRANSIENT_LOCAL, DurabilityPolicy.VOLATILE
        qos = QoSProfile(
            history=HistoryPolicy.KEEP_ALL,
            reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
            durability=durable if self.is_durable else volatile,
        )
        node.create_subscription(topic.type, str(topic), self._heard.append, qos)

    @property
    def last(self) -> Any:
        """What the newest message says, or None: a publisher may keep some earlier ones, too."""
        return self._topic.value(self._heard[-1]) if self._heard else None


def require_for_late_joiners(
    observer: SteppedObserver,
    stream: MergedSubscription,
    is_right: Callable[[Any], bool],
    seconds: float,
) -> str:
    """Require that a late joiner of a topic learns what was published last, without a change.

    It is in the newest message that somebody hears who joins long after.

    Args:
        observer: whose time passes meanwhile.
        stream: listens to the topic from before.
        is_right: whether a message, by `Topic.value`, says what was published last.
        seconds: of the node's time in which it must be known.

    Returns:
        How: "Transient local", or "Published again".

    Raises:
        Failed: it is not kept, nor published again in time, or something else is.
    """
    topic, node = stream.topic, observer.node
    needed = f"Whoever joins {topic} late knows the last value within {seconds:g} s, "
    needed += "without a change."
    # Everything that the last change set off is over before anyone joins.
    observer.wait_stepping(lambda: stream.last is not None and is_right(stream.last), seconds)
    observer.step(QUIET_S, COARSE_S)
    late = LateSubscription(node, topic)
    # Somebody may join just after one repetition: from there on the next one counts. And it may be
    # joining that sets it off, so somebody joins each time.
    for tolerance_s in () if late.is_durable else (0.0, TICK_S):
        joined_ns = time.time_ns()
        late = LateSubscription(node, topic)
        observer.await_discovery()
        if not observer.wait_for_arrival(
            lambda joined_ns=joined_ns: stream.newest_ns > joined_ns,  # type: ignore[misc]
            seconds + tolerance_s,
            TICK_S,
        ):
            raise Failed(
                expected=needed,
                actual=f"It was not published again within {seconds:g} s, and its publisher "
                f"({late.unkept}) keeps nothing for late joiners.",
            )
    if not observer.wait_stepping(lambda: late.last is not None and is_right(late.last), seconds):
        told = "nothing" if late.last is None else f"{late.last!r:.80}"
        raise Failed(expected=needed, actual=f"Whoever joined was told {told}.")
    return "Transient local" if late.is_durable else "Published again"
