"""The ROS graph of a robot as data: who is connected with whom, and where information can flow.

It is read when all of the subject's nodes are known to be on the graph, and then only looked at:
every question about a design's structure is a function of these data.
"""

from __future__ import annotations

import re
from collections import Counter, deque
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, field

from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.topic_endpoint_info import TopicEndpointInfo

from autograder.observe.participants import NO_NODE, node_of, of_others, participant_of
from course.runtime.ros_names import full_name

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

    def get_topic(self, name: str) -> Topic:
        """Return a topic; one without endpoints if it is not there."""
        return self.topics.get(name, Topic(name))

    def get_action(self, name: str) -> Offer:
        """Return an action; one without nodes if it is not there."""
        return self.actions.get(name, Offer(name, ""))

    def added_since(self, earlier: RobotGraph) -> RobotGraph:
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
            _new_offers(self.services, earlier.services),
            _new_offers(self.actions, earlier.actions),
            self.namesakes - earlier.namesakes,
        )

    def published_topics(self, node: str) -> list[Topic]:
        """Return the topics that a node publishes on."""
        return [topic for topic in self.topics.values() if node in topic.written_by]

    def iterate_links(self, kinds: Collection[str]) -> Iterator[tuple[str, str, str]]:
        """Yield (from, to, name of the link) for pairs of nodes; ``kinds`` are some of `KINDS`."""
        if "topic" in kinds:
            for topic in self.topics.values():
                yield from _node_pairs(topic.written_by, topic.read_by, topic.name)
        for offers, there, back in (
            (self.services, "request", "response"),
            (self.actions, "goal", "feedback"),
        ):
            for offer in offers.values():
                if there in kinds:
                    yield from _node_pairs(offer.clients, offer.servers, offer.name)
                if back in kinds:
                    yield from _node_pairs(offer.servers, offer.clients, offer.name)

    def reachable_nodes(self, start: Iterable[str], kinds: Collection[str]) -> set[str]:
        """Return `start` and every node that information from there can get to."""
        onward: dict[str, set[str]] = {}
        for source, target, _ in self.iterate_links(kinds):
            onward.setdefault(source, set()).add(target)
        found, waiting = set(start), deque(start)
        while waiting:
            for node in onward.get(waiting.popleft(), set()) - found:
                found.add(node)
                waiting.append(node)
        return found


def _new_offers(offers: dict[str, Offer], earlier: dict[str, Offer]) -> dict[str, Offer]:
    def grew(offer: Offer) -> bool:
        old = earlier.get(offer.name, Offer(offer.name, ""))
        return not (offer.servers <= old.servers and offer.clients <= old.clients)

    return {name: offer for name, offer in offers.items() if grew(offer)}


def _node_pairs(
    sources: Iterable[str], targets: Iterable[str], by: str
) -> Iterator[tuple[str, str, str]]:
    targets = tuple(targets)
    yield from ((s, t, by) for s in sources for t in targets if s != t)


def read_graph(node: Node, marks: Collection[str] = ()) -> RobotGraph:
    """Return what `node` sees on the ROS graph besides the examiner's own endpoints.

    Hidden nodes count as others do, as soon as they have an endpoint here; so do endpoints that no
    node is known to have. ``marks`` are topics that the examiner has asked for.
    """
    reader = _Reader(node)
    graph = RobotGraph()
    for topic, _ in node.get_topic_names_and_types():
        if topic not in INFRASTRUCTURE and topic not in marks and not _OF_ACTION.fullmatch(topic):
            found = reader.read_topic(topic, topic)
            if found.readers or found.types not in ((), (_TRANSITIONS,)):
                graph.topics[topic] = found
    for raw, _ in node.get_topic_names_and_types(no_demangle=True):
        if request := _REQUEST.fullmatch(raw):
            _add_offer(graph, reader, request["name"])
    # A node has no endpoint itself: of those without any that counts, the name is all there is.
    count = reader.count_names()
    graph.nodes = frozenset(
        {name for name in count if "/_" not in name}
        | {end.node for topic in graph.topics.values() for end in (*topic.writers, *topic.readers)}
        | {
            node
            for offer in (*graph.services.values(), *graph.actions.values())
            for node in offer.servers | offer.clients
        }
    )
    apart = reader.names_apart()
    graph.namesakes = frozenset(name for name in graph.nodes if max(count[name], apart[name]) > 1)
    return graph


_OF_ACTION = re.compile(r".*/_action/(feedback|status)")
_REQUEST = re.compile(r"rq(?P<name>/.+)Request")
_SEND_GOAL = "/_action/send_goal"
_OTHER_SERVICES_OF_ACTION = ("/_action/cancel_goal", "/_action/get_result")
_REQUEST_TYPE = re.compile(r"(\w+)::(srv|action)::dds_::(\w+?)(_SendGoal)?_Request_")


class _Reader:
    """Reads endpoints off the graph through one node."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._participants: dict[str, set[bytes]] = {}

    def read_topic(self, name: str, raw: str, *, no_mangle: bool = False) -> Topic:
        """Return a topic as ``name``; ``raw`` is what it is called, on DDS with ``no_mangle``."""
        return Topic(
            name,
            self._read_ends(self._node.get_publishers_info_by_topic(raw, no_mangle)),
            self._read_ends(self._node.get_subscriptions_info_by_topic(raw, no_mangle)),
        )

    def _read_ends(self, infos: Iterable[TopicEndpointInfo]) -> tuple[End, ...]:
        ends = []
        for info in of_others(infos):
            node = node_of(info)
            if node != NO_NODE:
                self._participants.setdefault(node, set()).add(participant_of(info))
            ends.append(End(node, info.topic_type, info.qos_profile))
        return tuple(ends)

    def count_names(self) -> Counter[str]:
        """Return how many nodes there are of each full name, without the reading one."""
        count = Counter(
            full_name(name, space) for name, space in self._node.get_node_names_and_namespaces()
        )
        count[self._node.get_fully_qualified_name()] -= 1  # another of this name is not ours
        return +count

    def names_apart(self) -> Counter[str]:
        """Return in how many participants each name has endpoints."""
        return Counter({name: len(found) for name, found in self._participants.items()})


def _add_offer(graph: RobotGraph, reader: _Reader, name: str) -> None:
    """Add a service or an action, by the topics that ROS 2 makes of it on DDS.

    See https://design.ros2.org/articles/topic_and_service_names.html. So each end of it is known by
    its endpoint, as those of topics are.
    """
    if name.endswith(_OTHER_SERVICES_OF_ACTION):
        return
    ways = (
        reader.read_topic(name, f"rq{name}Request", no_mangle=True),
        reader.read_topic(name, f"rr{name}Reply", no_mangle=True),
    )
    requests = ways[0]
    types = [_service_type(end.type) for end in (*requests.readers, *requests.writers)]
    if not types or (requests.readers and types[0].startswith(_OF_EVERY_NODE)):
        return
    servers, clients = set(requests.read_by), set(requests.written_by)
    if name.endswith(_SEND_GOAL):
        action = name.removesuffix(_SEND_GOAL)
        graph.actions[action] = Offer(action, types[0], servers, clients)
    else:
        graph.services[name] = Offer(name, types[0], servers, clients, ways)


def _service_type(dds_type: str) -> str:
    """Return the ROS type of a service or an action of which DDS knows the type of its requests."""
    found = _REQUEST_TYPE.fullmatch(dds_type)
    return f"{found[1]}/{found[2]}/{found[3]}" if found else dds_type
