"""Both ends of a service on the graph, each of which DDS discovers by itself.

A client writes requests and reads replies; a server reads requests and writes replies. rclpy's
``count_clients`` and ``count_services`` look at the replies alone (rmw_fastrtps of Jazzy), while a
participant makes its readers and its writers known apart from each other: a server that counts a
client may not know yet who writes the requests, and drops the first one.
"""

from __future__ import annotations

from rclpy.node import Node


def request_topic(service: str) -> str:
    """Return the topic of DDS that carries the requests of a service, given by its full name."""
    return f"rq{service}Request"


def reply_topic(service: str) -> str:
    """Return the topic of DDS that carries the replies of a service, given by its full name."""
    return f"rr{service}Reply"


def count_known_clients(node: Node, service: str) -> int:
    """Return how many clients of a service a node knows as writer of requests and as reader."""
    return min(
        len(Node.get_publishers_info_by_topic(node, request_topic(service), no_mangle=True)),
        len(Node.get_subscriptions_info_by_topic(node, reply_topic(service), no_mangle=True)),
    )


def count_known_servers(node: Node, service: str) -> int:
    """Return how many servers of a service a node knows as reader of requests and as writer."""
    return min(
        len(Node.get_subscriptions_info_by_topic(node, request_topic(service), no_mangle=True)),
        len(Node.get_publishers_info_by_topic(node, reply_topic(service), no_mangle=True)),
    )
