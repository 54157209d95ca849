"""What nodes that start late are handed of a topic's past."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy

from autograder.observe.nouns import Topic
from autograder.observe.relays.endpoint_qos import lossless_profile, undemanding_profile
from autograder.observe.relays.observed_process import ObservedProcess

REPEATED_S = 0.3
"""Seconds in which a publisher that repeats its last message shows itself."""


@dataclass
class PastOfTopic:
    """What two late readers of a topic were handed: what `Topic.value` makes of it, if not None.

    Attributes:
        asking: by the one that asks for the past (RELIABLE, TRANSIENT_LOCAL).
        plain: by the one that does not (BEST_EFFORT, VOLATILE).
        refusals: of the first, whom DDS does not connect to who has no past to hand out.
    """

    asking: list[Any] = field(default_factory=list)
    plain: list[Any] = field(default_factory=list)
    refusals: list[Any] = field(default_factory=list)


def hear_past(
    process: ObservedProcess, node: Node, name: str, topics: Sequence[Topic]
) -> list[PastOfTopic]:
    """Join late on each topic, and return what is handed out there of its past.

    To be called when nothing is sent any more: all that comes then is old.

    Args:
        process: the student's.
        node: the examiner's, which gets two subscriptions to each topic for a while.
        name: the class of the student's node that publishes there.
        topics: those to join.
    """
    full_names = [str(topic) for topic in topics]

    def count_readers() -> list[int]:
        seen = process.subject.sees(name, {"subscribers": full_names})["subscribers"]
        return [seen[topic] for topic in full_names]

    known = count_readers()
    pasts = [PastOfTopic() for _ in topics]
    asks = lossless_profile(DurabilityPolicy.TRANSIENT_LOCAL)
    guests = []
    for topic, past in zip(topics, pasts, strict=True):
        events = SubscriptionEventCallbacks(
            incompatible_qos=past.refusals.append, use_default_callbacks=False
        )
        guests += [
            node.create_subscription(
                topic.type,
                topic.name,
                _note_value(topic, past.asking),
                asks,
                event_callbacks=events,
            ),
            node.create_subscription(
                topic.type, topic.name, _note_value(topic, past.plain), undemanding_profile()
            ),
        ]
    # Either DDS refuses to hand out the past, or the writer replays it at once.
    process.wait(lambda: all(past.refusals or past.asking for past in pasts))
    # A publisher of which each reader is known has its chance to greet it, until all is at rest.
    process.wait(lambda: all(n >= k + 2 for n, k in zip(count_readers(), known, strict=True)))
    process.wait_for_rest()
    process.wait(lambda: any(past.plain for past in pasts), REPEATED_S)
    for guest in guests:
        node.destroy_subscription(guest)
    return pasts


def _note_value(topic: Topic, heard: list[Any]) -> Callable[[Any], None]:
    def note(message: Any) -> None:
        if (value := topic.value(message)) is not None:
            heard.append(value)

    return note
