"""The ROS graph of a robot as data: who is connected with whom, and where information can flow.

It is read when all of the subject's nodes are known to be on the graph, and then only looked at:
every question about a design's structure is a function of these data.
"""

# mypy: allow-untyped-calls

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, field

from rclpy.action.graph import (
    get_action_client_names_and_types_by_node,
    get_action_server_names_and_types_by_node,
)
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.topic_endpoint_info import TopicEndpointInfo

from course.runtime.names import full_name

KINDS = ("topic", "request", "response", "goal", "feedback")
"""The ways in which information goes from one node to another."""

INFRASTRUCTURE = frozenset(
    f"/{name}" for name in ("rosout", "parameter_events", "clock", "tf", "tf_static", "diagnostics")
)
"""Topics that nobody in particular reads or writes."""

_OF_EVERY_NODE = ("rcl_interfaces/", "type_description_interfaces/", "lifecycle_msgs/")
_TRANSITIONS = "lifecycle_msgs/msg/TransitionEvent"
"""What every lifecycle node publishes, whether anybody wants to know or not."""


@dataclass(frozen=True)
class End:
    """A publisher or subscription: of which node, with which type and QoS."""

    node: str
    type: str
    qos: QoSProfile = field(compare=False)


@dataclass(frozen=True)
class Topic:
    """A topic with its publishers and subscriptions."""

    name: str
    writers: tuple[End, ...] = ()
    readers: tuple[End, ...] = ()

    @property
    def types(self) -> tuple[str, ...]:
        """The types that its endpoints give it: one, unless they disagree."""
        return tuple(sorted({end.type for end in (*self.writers, *self.readers)}))

    @property
    def written_by(self) -> frozenset[str]:
        """The nodes that publish on it."""
        return frozenset(end.node for end in self.writers)

    @property
    def read_by(self) -> frozenset[str]:
        """The nodes that subscribe to it."""
        return frozenset(end.node for end in self.readers)


@dataclass
class Offer:
    """A service or an action: the nodes that offer it and those that use it.

    Attributes:
        ways: for a service, what DDS makes of it: a topic of requests and one of replies.
    """

    name: str
    type: str
    servers: set[str] = field(default_factory=set)
    clients: set[str] = field(default_factory=set)
    ways: tuple[Topic, ...] = field(default=(), compare=False)


@dataclass
class RobotGraph:
    """All of it, without the examiner and without what every node has (parameters, the log)."""

    nodes: frozenset[str] = frozenset()
    topics: dict[str, Topic] = field(default_factory=dict)
    services: dict[str, Offer] = field(default_factory=dict)
    actions: dict[str, Offer] = field(default_factory=dict)
    namesakes: frozenset[str] = frozenset()
    """Full names that more than one node has."""

    def topic(self, name: str) -> Topic:
        """Return a topic; one without endpoints if it is not there."""
        return self.topics.get(name, Topic(name))

    def action(self, name: str) -> Offer:
        """Return an action; one without nodes if it is not there."""
        return self.actions.get(name, Offer(name, ""))

    def since(self, earlier: RobotGraph) -> RobotGraph:
        """Return the part of it with endpoints that were not there earlier."""
        before: dict[str, set[End]] = {
            name: {*topic.writers, *topic.readers} for name, topic in earlier.topics.items()
        }
        new = {
            name: topic
            for name, topic in self.topics.items()
            if {*topic.writers, *topic.readers} - before.get(name, set())
        }
        return RobotGraph(
            self.nodes - earlier.nodes,
            new,
            _more(self.services, earlier.services),
            _more(self.actions, earlier.actions),
            self.namesakes - earlier.namesakes,
        )

    def writes(self, node: str) -> list[Topic]:
        """Return the topics that a node publishes on."""
        return [topic for topic in self.topics.values() if node in topic.written_by]

    def flows(self, kinds: Collection[str]) -> Iterator[tuple[str, str, str]]:
        """Yield (from, to, name of the link) for pairs of nodes; ``kinds`` are some of `KINDS`."""
        if "topic" in kinds:
            for topic in self.topics.values():
                yield from _pairs(topic.written_by, topic.read_by, topic.name)
        for offers, there, back in (
            (self.services, "request", "response"),
            (self.actions, "goal", "feedback"),
        ):
            for offer in offers.values():
                if there in kinds:
                    yield from _pairs(offer.clients, offer.servers, offer.name)
                if back in kinds:
                    yield from _pairs(offer.servers, offer.clients, offer.name)

    def reached(self, start: Iterable[str], kinds: Collection[str]) -> set[str]:
        """Return `start` and every node that information from there can get to."""
        onward: dict[str, set[str]] = {}
        for source, target, _ in self.flows(kinds):
            onward.setdefault(source, set()).add(target)
        found, waiting = set(start), deque(start)
        while waiting:
            for node in onward.get(waiting.popleft(), set()) - found:
                found.add(node)
                waiting.append(node)
        return found


def _more(offers: dict[str, Offer], earlier: dict[str, Offer]) -> dict[str, Offer]:
    def grew(offer: Offer) -> bool:
        old = earlier.get(offer.name, Offer(offer.name, ""))
        return not (offer.servers <= old.servers and offer.clients <= old.clients)

    return {name: offer for name, offer in offers.items() if grew(offer)}


def _pairs(
    sources: Iterable[str], targets: Iterable[str], by: str
) -> Iterator[tuple[str, str, str]]:
    targets = tuple(targets)
    yield from ((s, t, by) for s in sources for t in targets if s != t)


def read_graph(node: Node) -> RobotGraph:
    """Return what `node` sees on the ROS graph besides itself and hidden nodes."""
    names = [
        (name, namespace)
        for name, namespace in node.get_node_names_and_namespaces()
        if not name.startswith("_") and name != node.get_name()
    ]
    count = Counter(full_name(name, space) for name, space in names)
    graph = RobotGraph(
        nodes=frozenset(count), namesakes=frozenset(name for name in count if count[name] > 1)
    )
    for topic, _ in node.get_topic_names_and_types():
        if topic not in INFRASTRUCTURE and "/_" not in topic:
            found = Topic(
                topic,
                _ends(node.get_publishers_info_by_topic(topic), graph.nodes),
                _ends(node.get_subscriptions_info_by_topic(topic), graph.nodes),
            )
            if found.readers or found.types not in ((), (_TRANSITIONS,)):
                graph.topics[topic] = found
    for name, space in dict.fromkeys(names):
        _add_offers(graph, node, name, space)
    for offer in [*graph.services.values()]:
        if offer.servers and offer.type.startswith(_OF_EVERY_NODE):
            del graph.services[offer.name]
        else:
            offer.ways = _ways(offer.name, node, graph.nodes)
    return graph


def _add_offers(graph: RobotGraph, node: Node, name: str, space: str) -> None:
    full = full_name(name, space)
    for offers, serves, found in (
        (graph.services, True, node.get_service_names_and_types_by_node(name, space)),
        (graph.services, False, node.get_client_names_and_types_by_node(name, space)),
        (graph.actions, True, get_action_server_names_and_types_by_node(node, name, space)),
        (graph.actions, False, get_action_client_names_and_types_by_node(node, name, space)),
    ):
        for offer_name, types in found:
            if "/_action/" not in offer_name:
                offer = offers.setdefault(offer_name, Offer(offer_name, types[0]))
                (offer.servers if serves else offer.clients).add(full)


def _ways(service: str, node: Node, nodes: frozenset[str]) -> tuple[Topic, ...]:
    """Return the two topics of a service, by the names that ROS 2 gives them on DDS.

    See https://design.ros2.org/articles/topic_and_service_names.html. A middleware that has others
    shows no endpoints there.
    """
    return tuple(
        Topic(
            service,
            _ends(node.get_publishers_info_by_topic(name, no_mangle=True), nodes),
            _ends(node.get_subscriptions_info_by_topic(name, no_mangle=True), nodes),
        )
        for name in (f"rq{service}Request", f"rr{service}Reply")
    )


def _ends(infos: Iterable[TopicEndpointInfo], nodes: frozenset[str]) -> tuple[End, ...]:
    ends = (
        End(full_name(i.node_name, i.node_namespace), i.topic_type, i.qos_profile) for i in infos
    )
    return tuple(end for end in ends if end.node in nodes)
