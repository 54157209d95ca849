"""The ROS graph as plain data: nodes, topics with their endpoints, services and actions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

Role = Literal["publisher", "subscription"]

QOS_POLICIES = (
    "reliability",
    "durability",
    "history",
    "depth",
    "deadline",
    "lifespan",
    "liveliness",
)
"""The keys of an endpoint's QoS, in the order in which people read them."""


@dataclass(frozen=True, order=True)
class Endpoint:
    """One publisher or subscription.

    Attributes:
        node: the fully qualified name of its node.
        role: "publisher" offers its QoS, "subscription" requests it.
        type: its message type, as in ``sensor_msgs/msg/Image``.
        qos: policies by name, in words ("RELIABLE", "10", "0.5 s"); what DDS does not announce
            (history and depth of other processes) is left out.
        gid: DDS's own identifier of the endpoint, as hexadecimal digits.
    """

    node: str
    role: Role
    type: str
    qos: Mapping[str, str] = field(default_factory=dict, compare=False)
    gid: str = ""


@dataclass(frozen=True)
class Mismatch:
    """A publisher and a subscription that DDS does not connect.

    Attributes:
        publisher, subscription: the fully qualified names of the two nodes.
        reasons: what does not fit, a phrase each ("offers BEST_EFFORT, requests RELIABLE").
        policies: the policies that break it ("RELIABILITY"), or "TYPE".
        from_event: DDS itself has said so, by an event; otherwise it follows from the QoS that both
            announce.
    """

    publisher: str
    subscription: str
    reasons: tuple[str, ...]
    policies: tuple[str, ...]
    from_event: bool = False


@dataclass(frozen=True)
class Topic:
    """A topic, who writes it, who reads it, and which of them do not connect."""

    name: str
    publishers: tuple[Endpoint, ...] = ()
    subscriptions: tuple[Endpoint, ...] = ()
    mismatches: tuple[Mismatch, ...] = ()

    @property
    def broken_pairs(self) -> tuple[dict[str, list[Mismatch]], dict[str, list[Mismatch]]]:
        """The pairs that a drawing tells at each publisher's arrow, and at each subscription's.

        An arrow through which nothing passes tells all its pairs; another one, only a pair that
        would be told by neither end, and that is the subscription's.
        """
        writers = {end.node for end in self.publishers}
        readers = {end.node for end in self.subscriptions}
        pairs = {(pair.publisher, pair.subscription) for pair in self.mismatches}
        unread = {w for w in writers if all((w, r) in pairs for r in readers)}
        deaf = {r for r in readers if all((w, r) in pairs for w in writers)}
        sent: dict[str, list[Mismatch]] = {}
        heard: dict[str, list[Mismatch]] = {}
        for pair in self.mismatches:
            if pair.publisher in unread:
                sent.setdefault(pair.publisher, []).append(pair)
            if pair.subscription in deaf or pair.publisher not in unread:
                heard.setdefault(pair.subscription, []).append(pair)
        return sent, heard

    @property
    def types(self) -> tuple[str, ...]:
        """The types that its endpoints have: more than one is a clash."""
        return tuple(sorted({end.type for end in (*self.publishers, *self.subscriptions)}))


@dataclass(frozen=True)
class Exchange:
    """A service or an action: its type, and the nodes on either side."""

    name: str
    type: str
    servers: tuple[str, ...] = ()
    clients: tuple[str, ...] = ()


@dataclass(frozen=True)
class Graph:
    """A snapshot of the ROS graph.

    ``nodes`` has fully qualified names, a name as often as there are nodes that bear it.
    """

    nodes: tuple[str, ...] = ()
    topics: tuple[Topic, ...] = ()
    services: tuple[Exchange, ...] = ()
    actions: tuple[Exchange, ...] = ()

    @property
    def mismatches(self) -> tuple[tuple[str, Mismatch], ...]:
        """(topic, mismatch) of every pair that does not connect."""
        return tuple((topic.name, pair) for topic in self.topics for pair in topic.mismatches)

    @property
    def duplicate_names(self) -> tuple[str, ...]:
        """Names that more than one node bears."""
        return tuple(sorted({name for name in self.nodes if self.nodes.count(name) > 1}))
