"""Who knows whom: waiting until a node under examination has discovered the examiner's endpoints.

DDS discovers in both directions, each in its own time: what is sent before the other side knows of
it is lost. Nobody is asked here: that a node has answered proves what it knows.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rcl_interfaces.srv import GetParameters
from rclpy.node import Node


def find_answering_service(node: Node) -> str | None:
    """Return a service that every node has which was made with its parameter services, if any."""
    for name, types in node.get_service_names_and_types():
        if types == ["rcl_interfaces/srv/GetParameters"] and node.count_services(name):
            return str(name)
    return None


def await_discovery(node: Node, wait: Callable[[Callable[[], Any]], bool]) -> None:
    """Return when a node of others' knows every endpoint that the examiner's has made so far.

    A participant makes its endpoints known in the order in which they were made. So once a client
    that is newer than all of them gets an answer, the others' writers know the earlier readers.

    Args:
        node: the examiner's.
        wait: waits for a condition, and gives up after a while.
    """
    if name := find_answering_service(node):
        client = node.create_client(GetParameters, name)
        if wait(client.service_is_ready):
            wait(client.call_async(GetParameters.Request()).done)
        node.destroy_client(client)
