"""The nodes of a design, brought up to do their work."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol

from rclpy.action.graph import get_action_server_names_and_types_by_node
from rclpy.node import Node

from course.design.at_work.meanings import (
    NAVIGATE,
    Meaning,
    NodePart,
    find_frames,
    find_meanings,
)
from course.design.at_work.places.place import Place
from course.design.at_work.worker import Worker
from course.design.at_work.working_node import WorkingNode
from course.design.endpoints import DesignEndpoint, Role, make_endpoint
from course.messages.types import load_type
from course.runtime.core_session import CoreSession

OWN_THREADS = 8
"""Threads for nodes that a student has written, which may wait in a callback; as in the exam."""

_OF_RCLPY = ("rcl_interfaces.", "rosgraph_msgs.", "type_description_interfaces.")


class Declared(Protocol):
    """What is read of a declared node."""

    name: str
    namespace: str
    endpoints: list[DesignEndpoint]
    factory: Any


@dataclass
class Crew:
    """The nodes that work.

    Attributes:
        parts: the part of each node in the design.
        working: those that the library makes.
    """

    parts: list[NodePart]
    working: list[WorkingNode]

    @property
    def action_type(self) -> Any | None:
        """The type of ``navigate_to``, or None if nobody serves it."""
        served = (end for part in self.parts for end in part.ends(Role.ACTION_SERVER))
        return next((end.type for end in served if end.full_name == NAVIGATE), None)

    def drivers(self, meaning: Meaning) -> list[WorkingNode]:
        """Return the nodes that have the cable of a sensor: they publish what they do not read."""
        return [
            node
            for node in self.working
            if meaning in node.worker.part.tells and meaning not in node.worker.part.hears
        ]


def bring_up(
    session: CoreSession, declared: Mapping[str, Declared], keep: Callable[[Node], None],
    floor: Mapping[str, Any], start: Place,
) -> Crew:  # fmt: skip
    """Bring the nodes of a design up.

    Args:
        session: the session that runs them.
        declared: the declarations by label.
        keep: gets each node as soon as it runs.
        floor: the floor plan, which a node that hands the map out knows.
        start: where the robot is now, which a node that reckons its pose knows.
    """
    parts = {}
    for label, node in declared.items():
        parts[label] = NodePart(label, list(node.endpoints), node.factory)
        if node.factory is not None:
            made = session.run(node.factory, threads=OWN_THREADS)
            keep(made)
            parts[label].endpoints = _read_endpoints(made)
    meanings = find_meanings(parts.values())
    frames = find_frames(parts.values(), meanings)
    working = []
    for label, node in declared.items():
        if node.factory is None:
            worker = Worker(parts[label], floor, start)
            factory = partial(WorkingNode, node.name, node.namespace, worker, meanings, frames)
            made = session.run(factory)
            keep(made)
            assert isinstance(made, WorkingNode)
            working.append(made)
    return Crew(list(parts.values()), working)


def _read_endpoints(node: Node) -> list[DesignEndpoint]:
    """Return what a node of a student's own is connected to, as the design would declare it."""
    name, namespace = node.get_name(), node.get_namespace()
    found: list[tuple[Role, str, Any, Any]] = [
        *((Role.PUBLISHES, p.topic_name, p.msg_type, p.qos_profile) for p in node.publishers),
        *((Role.SUBSCRIBES, s.topic_name, s.msg_type, s.qos_profile) for s in node.subscriptions),
        *((Role.CALLS, c.srv_name, c.srv_type, None) for c in node.clients),
        *((Role.SERVES, s.srv_name, s.srv_type, None) for s in node.services),
    ]
    served = get_action_server_names_and_types_by_node(node, name, namespace)
    found += [
        (Role.ACTION_SERVER, action, load_type(kinds[0], action, "action"), None)
        for action, kinds in served
    ]
    return [
        make_endpoint(role, name, namespace, topic, ros_type, qos)
        for role, topic, ros_type, qos in found
        if not ros_type.__module__.startswith(_OF_RCLPY) and "/_action/" not in topic
    ]
