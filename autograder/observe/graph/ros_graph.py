"""The ROS graph as data: who is connected with whom, and where information can flow.

It is read once (`autograder.observe.graph.graph_reader`), and then only looked at: each question
about the structure of a design is a function of these data.

Example:
    >>> LASER, POSES = "sensor_msgs/msg/LaserScan", "geometry_msgs/msg/PoseArray"
    >>> graph = RosGraph.of(
    ...     [
    ...         GraphTopic("/scan", (End("/lidar", LASER),), (End("/detector", LASER),)),
    ...         GraphTopic("/obstacles", (End("/detector", POSES),), (End("/planner", POSES),)),
    ...     ],
    ...     services=[GraphService("/plan", "nav_msgs/srv/GetPlan", {"/planner"}, {"/navigation"})],
    ... )
    >>> sorted(graph.nodes)
    ['/detector', '/lidar', '/navigation', '/planner']
    >>> sorted(graph.reachable_nodes({"/lidar"}, ("topic",)))
    ['/detector', '/lidar', '/planner']
    >>> "/navigation" in graph.reachable_nodes({"/lidar"}, ("topic", "response"))
    True
"""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, field

from rclpy.qos import QoSProfile

KINDS = ("topic", "request", "response", "goal", "feedback")
"""The ways in which information goes from one node to another."""


@dataclass(frozen=True)
class End:
    """A publisher or a subscription.

    Attributes:
        node: the full name of its node.
        type: its message type, such as ``sensor_msgs/msg/LaserScan``.
        qos: what it offers or requests.
    """

    node: str
    type: str
    qos: QoSProfile = field(default_factory=lambda: QoSProfile(depth=10), compare=False)


@dataclass(frozen=True)
class GraphTopic:
    """A topic on the graph, with its publishers (``writers``) and subscriptions (``readers``)."""

    name: str
    writers: tuple[End, ...] = ()
    readers: tuple[End, ...] = ()

    @property
    def ends(self) -> tuple[End, ...]:
        """All of its publishers and subscriptions."""
        return (*self.writers, *self.readers)

    @property
    def types(self) -> tuple[str, ...]:
        """The types that its endpoints give it: one, unless they disagree."""
        return tuple(sorted({end.type for end in self.ends}))

    @property
    def written_by(self) -> frozenset[str]:
        """The nodes that publish on it."""
        return frozenset(end.node for end in self.writers)

    @property
    def read_by(self) -> frozenset[str]:
        """The nodes that subscribe to it."""
        return frozenset(end.node for end in self.readers)

    @property
    def other_readers(self) -> frozenset[str]:
        """The nodes that subscribe to it and do not publish on it."""
        return self.read_by - self.written_by


@dataclass
class GraphService:
    """A service or an action on the graph: the nodes that serve it, and those that use it.

    Attributes:
        name: its full name.
        type: such as ``nav_msgs/srv/GetPlan``.
        servers: full names of nodes.
        clients: full names of nodes.
        dds_topics: for a service, what DDS makes of it: a topic of requests and one of replies.
    """

    name: str
    type: str
    servers: set[str] = field(default_factory=set)
    clients: set[str] = field(default_factory=set)
    dds_topics: tuple[GraphTopic, ...] = field(default=(), compare=False)

    @property
    def other_clients(self) -> set[str]:
        """The nodes that use it and do not serve it."""
        return self.clients - self.servers


@dataclass
class RosGraph:
    """Nodes, topics, services and actions, each by its full name.

    Attributes:
        namesakes: full names that more than one node has.
    """

    nodes: frozenset[str] = frozenset()
    topics: dict[str, GraphTopic] = field(default_factory=dict)
    services: dict[str, GraphService] = field(default_factory=dict)
    actions: dict[str, GraphService] = field(default_factory=dict)
    namesakes: frozenset[str] = frozenset()

    @classmethod
    def of(
        cls,
        topics: Iterable[GraphTopic] = (),
        services: Iterable[GraphService] = (),
        actions: Iterable[GraphService] = (),
        nodes: Iterable[str] = (),
    ) -> RosGraph:
        """Return the graph of these, with every node that has an endpoint, and with ``nodes``."""
        graph = cls(
            topics={topic.name: topic for topic in topics},
            services={service.name: service for service in services},
            actions={action.name: action for action in actions},
        )
        ends = {end.node for topic in graph.topics.values() for end in topic.ends}
        called = (*graph.services.values(), *graph.actions.values())
        graph.nodes = frozenset(nodes).union(ends, *(c.servers | c.clients for c in called))
        return graph

    def topic(self, name: str) -> GraphTopic:
        """Return a topic; one without endpoints if it is not there."""
        return self.topics.get(name, GraphTopic(name))

    def action(self, name: str) -> GraphService:
        """Return an action; one without nodes if it is not there."""
        return self.actions.get(name, GraphService(name, ""))

    def topics_of(self, types: Iterable[str]) -> list[GraphTopic]:
        """Return the topics that have one of these types."""
        return [topic for topic in self.topics.values() if not {*types}.isdisjoint(topic.types)]

    def topics_from(self, nodes: Collection[str]) -> list[GraphTopic]:
        """Return the topics that one of these nodes publishes on."""
        return [t for t in self.topics.values() if not t.written_by.isdisjoint(nodes)]

    def writers_of(self, names: Iterable[str]) -> set[str]:
        """Return the nodes that publish on one of these topics."""
        return {node for name in names for node in self.topic(name).written_by}

    def readers_of(self, names: Iterable[str]) -> set[str]:
        """Return the nodes that subscribe to one of these topics."""
        return {node for name in names for node in self.topic(name).read_by}

    def readers_through(self, names: Iterable[str], types: Collection[str]) -> set[str]:
        """Return the nodes that read some topics, also by way of nodes that filter and hand on.

        Args:
            names: of topics.
            types: what a node publishes that reads one of them, if it hands on what it reads.
        """
        found: set[str] = set()
        while new := self.readers_of(names) - found:
            found |= new
            names = [t.name for t in self.topics_from(new) if not {*types}.isdisjoint(t.types)]
        return found

    def links(self, kinds: Collection[str]) -> Iterator[tuple[str, str, str]]:
        """Yield (from, to, name of the link) for pairs of nodes; ``kinds`` are some of `KINDS`."""
        if "topic" in kinds:
            for topic in self.topics.values():
                yield from _node_pairs(topic.written_by, topic.read_by, topic.name)
        for services, there, back in (
            (self.services, "request", "response"),
            (self.actions, "goal", "feedback"),
        ):
            for service in services.values():
                if there in kinds:
                    yield from _node_pairs(service.clients, service.servers, service.name)
                if back in kinds:
                    yield from _node_pairs(service.servers, service.clients, service.name)

    def reachable_nodes(self, start: Iterable[str], kinds: Collection[str]) -> set[str]:
        """Return ``start`` and every node that information from there can get to.

        Args:
            start: full names of nodes.
            kinds: the ways that it may take, some of `KINDS`.
        """
        onward: dict[str, set[str]] = {}
        for source, target, _ in self.links(kinds):
            onward.setdefault(source, set()).add(target)
        found, waiting = set(start), deque(start)
        while waiting:
            for node in onward.get(waiting.popleft(), set()) - found:
                found.add(node)
                waiting.append(node)
        return found

    def added_since(self, earlier: RosGraph) -> RosGraph:
        """Return the topics, services and actions with endpoints that were not there earlier."""
        return RosGraph(
            self.nodes - earlier.nodes,
            {n: t for n, t in self.topics.items() if {*t.ends} - {*earlier.topic(n).ends}},
            _grown(self.services, earlier.services),
            _grown(self.actions, earlier.actions),
            self.namesakes - earlier.namesakes,
        )


def _grown(
    services: dict[str, GraphService], earlier: dict[str, GraphService]
) -> dict[str, GraphService]:
    def has_grown(service: GraphService) -> bool:
        old = earlier.get(service.name, GraphService(service.name, ""))
        return not (service.servers <= old.servers and service.clients <= old.clients)

    return {name: service for name, service in services.items() if has_grown(service)}


def _node_pairs(
    sources: Iterable[str], targets: Iterable[str], by: str
) -> Iterator[tuple[str, str, str]]:
    targets = tuple(targets)
    yield from ((s, t, by) for s in sources for t in targets if s != t)
