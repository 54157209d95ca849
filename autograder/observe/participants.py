"""Tell whose an endpoint is: its GUID names the DDS participant, whatever its node is called.

All nodes of one context share one participant (DDSI-RTPS 2.3, 9.3.1). Names on the graph are a
stranger's words: a student's node may bear the examiner's name, or none.
"""

from __future__ import annotations

import secrets
from collections.abc import Iterable
from pathlib import Path

from rclpy.node import Node
from rclpy.topic_endpoint_info import TopicEndpointInfo
from std_msgs.msg import Empty

from course.runtime.ros_names import full_name

GUID_PREFIX_BYTES = 12
"""Bytes of an endpoint's GUID that name its participant."""

NAMELESS = "_NODE_NAME_UNKNOWN_"
"""How the graph calls the node of an endpoint that no node is known to have (rmw_dds_common)."""
NO_NODE = "/(endpoints of no node)"
"""What stands for that node."""

_ours: set[bytes] = set()


def participant_of(end: TopicEndpointInfo) -> bytes:
    """Return the participant that has an endpoint."""
    return bytes(end.endpoint_gid)[:GUID_PREFIX_BYTES]


def node_of(end: TopicEndpointInfo) -> str:
    """Return the full name of the node that its participant says has an endpoint, or `NO_NODE`."""
    if end.node_name == NAMELESS:
        return NO_NODE
    return full_name(end.node_name, end.node_namespace)


def note_own(node: Node) -> None:
    """Note that the participant of a node of this process is the examiner's.

    A context has a new one whenever all of its nodes have gone.
    """
    found: list[TopicEndpointInfo] = []
    while len(found) != 1:
        # Nobody can have heard of this topic when it is looked at: what is there is ours.
        topic = f"_own_{secrets.token_hex(8)}"
        probe = node.create_publisher(Empty, topic, 1)
        found = node.get_publishers_info_by_topic(topic)
        node.destroy_publisher(probe)
    _ours.add(participant_of(found[0]))


def known_participants(node: Node) -> set[bytes]:
    """Return the participants of ROS that a node has discovered, its own among them."""
    ends = node.get_publishers_info_by_topic("ros_discovery_info", no_mangle=True)
    return {participant_of(end) for end in ends}


def count_listening(domain_id: int) -> int:
    """Return how many participants of a domain there are in this network namespace.

    Each has a port of its own for discovery (DDSI-RTPS 2.3, 9.6.1.4), known before anybody has
    discovered it.
    """
    first = 7400 + 250 * domain_id + 10
    lines = Path("/proc/net/udp").read_text().splitlines()[1:]
    ports = {int(line.split()[1].rpartition(":")[2], 16) for line in lines}
    return len(ports & set(range(first, first + 240, 2)))


def is_own(end: TopicEndpointInfo) -> bool:
    """Whether an endpoint is the examiner's."""
    return participant_of(end) in _ours


def of_others(ends: Iterable[TopicEndpointInfo]) -> list[TopicEndpointInfo]:
    """Return the endpoints that are not the examiner's."""
    return [end for end in ends if not is_own(end)]
