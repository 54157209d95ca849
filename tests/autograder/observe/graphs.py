"""Graphs for tests, in few words."""

from __future__ import annotations

from collections.abc import Iterable

from autograder.observe.graph.ros_graph import End, GraphService, GraphTopic, RosGraph

SCAN = "sensor_msgs/msg/LaserScan"
ARRAY = "geometry_msgs/msg/PoseArray"
TWIST = "geometry_msgs/msg/Twist"


def topic(name: str, kind: str, writers: str, readers: str) -> GraphTopic:
    """Return a topic, of which two texts name the nodes at either side."""

    def ends(nodes: str) -> tuple[End, ...]:
        return tuple(End(f"/{node}", kind) for node in nodes.split())

    return GraphTopic(name, ends(writers), ends(readers))


def graph(
    *topics: GraphTopic,
    services: Iterable[GraphService] = (),
    actions: Iterable[GraphService] = (),
) -> RosGraph:
    """Return the graph of these."""
    return RosGraph.of(topics, services, actions)
