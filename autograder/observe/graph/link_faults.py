"""What does not connect on a ROS graph: sentences for the student, in the names of the nodes."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from autograder.observe.graph.qos_refusal import find_refusal
from autograder.observe.graph.ros_graph import GraphTopic, RosGraph
from autograder.observe.phrases import as_phrase, name_nodes, who_does


def find_link_faults(graph: RosGraph, outside: Collection[str] = ()) -> list[str]:
    """Return what is wrong with the links of a graph, a sentence each.

    Every topic has a publisher, a subscription and one type, whoever calls a service or sends goals
    finds one server, DDS connects the two sides, and each node has a name of its own.

    Args:
        graph: what was read, or what has been added to it.
        outside: full names at the boundary of the graph: nobody in it need read such a topic, and
            how many servers such a service or action has is not looked at.

    Example:
        >>> from autograder.observe.graph.ros_graph import End
        >>> path = GraphTopic("/path", (End("/navigation", "nav_msgs/msg/Path"),))
        >>> find_link_faults(RosGraph.of([path]))
        ['navigation publishes /path, but nobody reads it.']
        >>> find_link_faults(RosGraph.of([path]), outside=["/path"])
        []
    """
    namesakes = [
        f"More than one node is called {name_nodes([name])}: on the graph nobody can tell them "
        "apart."
        for name in sorted(graph.namesakes)
    ]
    return [*namesakes, *_topic_faults(graph, outside), *_service_faults(graph, outside)]


def _topic_faults(graph: RosGraph, outside: Collection[str]) -> Iterator[str]:
    for topic in graph.topics.values():
        if len(topic.types) > 1:
            yield f"{topic.name} has more than one type: {as_phrase(topic.types)}."
        elif not topic.writers:
            yield f"{who_does(topic.read_by, 'read')} {topic.name}, but nobody publishes on it."
        elif not topic.readers and topic.name not in outside:
            yield f"{who_does(topic.written_by, 'publish')} {topic.name}, but nobody reads it."
        else:
            yield from _qos_refusals(topic)


def _qos_refusals(topic: GraphTopic) -> Iterator[str]:
    for writer in topic.writers:
        for reader in topic.readers:
            if reason := find_refusal(writer.qos, reader.qos):
                yield reason.as_sentence(
                    name_nodes([writer.node]), name_nodes([reader.node]), topic.name
                )


def _service_faults(graph: RosGraph, outside: Collection[str]) -> Iterator[str]:
    for services, use in ((graph.services, ("call", "")), (graph.actions, ("send", "goals to "))):
        for name, service in services.items():
            if not service.servers:
                users = who_does(service.clients, use[0])
                yield f"{users} {use[1]}{name}, but no node is its server."
            elif len(service.servers) > 1 and name not in outside:
                both = "both" if len(service.servers) == 2 else "all"
                yield f"{name_nodes(service.servers)} are {both} servers of {name}: one is right."
            for topic in service.dds_topics:
                yield from _qos_refusals(topic)
