"""What others' endpoints on a topic offer and request: read from the ROS graph.

The graph tells reliability, durability, lifespan, deadline and liveliness of each endpoint, but not
its history and depth (these show in what a slow reader finds).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.topic_endpoint_info import TopicEndpointInfo

from autograder.examination.exam import Failed
from autograder.observe.graph.qos_refusal import Refusal, find_refusal
from autograder.observe.nouns import Topic
from autograder.observe.participants import of_others
from autograder.observe.relays.observed_process import ObservedProcess

ENDLESS_NS = 3600 * 10**9
"""Nanoseconds: a lifespan of an hour or more is as good as none."""


def lossless_profile(durability: DurabilityPolicy = DurabilityPolicy.VOLATILE) -> QoSProfile:
    """Return the profile of a cable: every message, in order."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_ALL,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=durability,
    )


def undemanding_profile() -> QoSProfile:
    """Return the profile of a reader that matches every writer and keeps all it gets."""
    return QoSProfile(history=HistoryPolicy.KEEP_ALL, reliability=ReliabilityPolicy.BEST_EFFORT)


class TopicEnds:
    """Others' endpoints on a topic, as the graph has them now.

    Attributes:
        publishers: theirs; ``subscriptions`` likewise.
    """

    def __init__(self, node: Node, topic: str) -> None:
        """Look at the graph as ``node`` knows it."""
        self.publishers = of_others(node.get_publishers_info_by_topic(topic))
        self.subscriptions = of_others(node.get_subscriptions_info_by_topic(topic))

    @property
    def is_offered_reliably(self) -> bool:
        """Whether all publishers offer RELIABLE."""
        return all(map(is_reliable, self.publishers))

    @property
    def is_offered_durably(self) -> bool:
        """Whether some publisher offers TRANSIENT_LOCAL."""
        durable = DurabilityPolicy.TRANSIENT_LOCAL
        return any(end.qos_profile.durability == durable for end in self.publishers)

    @property
    def can_expire(self) -> bool:
        """Whether messages are dropped when they get old: by a lifespan, at any end."""
        ends = [*self.publishers, *self.subscriptions]
        return any(0 < end.qos_profile.lifespan.nanoseconds < ENDLESS_NS for end in ends)

    @property
    def refusals(self) -> list[Refusal]:
        """Why DDS connects no publisher to any subscription; empty if it does, or if one lacks."""
        found = [
            find_refusal(offer.qos_profile, request.qos_profile)
            for offer in self.publishers
            for request in self.subscriptions
        ]
        return [] if None in found else [refusal for refusal in found if refusal is not None]

    @property
    def matching_request(self) -> QoSProfile:
        """The profile of a subscription that hears every publisher: lossless where it can be."""
        return lossless_profile() if self.is_offered_reliably else undemanding_profile()

    @property
    def strongest_offer(self) -> QoSProfile:
        """What a publisher offers, of several the one that most can hear; it keeps all.

        How many messages it keeps cannot be seen.

        Raises:
            ValueError: there is no publisher.
        """
        offers = [end.qos_profile for end in self.publishers]
        best = max(offers, key=lambda qos: (-qos.reliability.value, -qos.durability.value))
        return QoSProfile(
            history=HistoryPolicy.KEEP_ALL, reliability=best.reliability,
            durability=best.durability, lifespan=best.lifespan, deadline=best.deadline,
            liveliness=best.liveliness,
            liveliness_lease_duration=best.liveliness_lease_duration,
        )  # fmt: skip


def is_reliable(end: TopicEndpointInfo) -> bool:
    """Return whether an endpoint offers or requests RELIABLE."""
    return bool(end.qos_profile.reliability == ReliabilityPolicy.RELIABLE)


def describe_missing(
    node: Node, *, publishes: Iterable[Topic] = (), subscribes: Iterable[Topic] = ()
) -> list[str]:
    """Return which of others' endpoints are missing or of another type, a sentence each.

    Args:
        node: the examiner's, which knows the graph.
        publishes: topics that others have to publish on.
        subscribes: topics that others have to listen to.
    """
    told = []
    for topic in publishes:
        told += _describe_ends("publisher on", topic, TopicEnds(node, topic.name).publishers)
    for topic in subscribes:
        ends = TopicEnds(node, topic.name).subscriptions
        told += _describe_ends("subscription to", topic, ends)
    return told


def _describe_ends(what: str, topic: Topic, ends: Sequence[TopicEndpointInfo]) -> list[str]:
    wanted = f"{topic.type.__module__.split('.')[0]}/msg/{topic.type.__name__}"
    types = {end.topic_type for end in ends}
    if not types:
        return [f"There is no {what} {topic.name}."]
    if wanted not in types:
        return [f"The {what} {topic.name} has type {', '.join(sorted(types))}, not {wanted}."]
    return []


def require_endpoints(
    process: ObservedProcess, node: Node, *, publishes: Iterable[Topic], subscribes: Iterable[Topic]
) -> None:
    """Require that the student's nodes have endpoints on these topics, of their types.

    Raises:
        Failed: one is missing, or has another type.
    """
    missing: list[str] = []

    def are_there() -> bool:
        missing[:] = describe_missing(node, publishes=publishes, subscribes=subscribes)
        return not any(line.startswith("There is no") for line in missing)

    process.wait(are_there)
    if missing:
        raise Failed(expected="Every topic of the task has its endpoint.", actual=" ".join(missing))
