"""Declaring a design: which nodes there are, and what each of them is connected to."""

from __future__ import annotations

import importlib
import weakref
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

from rclpy.exceptions import InvalidNamespaceException, InvalidNodeNameException
from rclpy.node import Node
from rclpy.validate_namespace import validate_namespace
from rclpy.validate_node_name import validate_node_name

from course.design import drawing, findings
from course.design.endpoints import DesignError, Role, rclpy_reason
from course.design.node import DesignNode
from course.design.node_declaration import NodeDeclaration
from course.runtime.core_session import CoreSession

if TYPE_CHECKING:
    from course.design.at_work.departure import DrivenWorld
    from course.design.at_work.trip import Trip

_running: weakref.WeakKeyDictionary[CoreSession, list[Node]] = weakref.WeakKeyDictionary()


def _replace_nodes(host: CoreSession) -> list[Node]:
    """Stop the nodes of the last run in a session; return the list that keeps those of the next."""
    if earlier := _running.pop(host, []):
        host.stop(*earlier)
    return _running.setdefault(host, [])


class Design:
    """The nodes of a robot and what connects them, brought up as real ROS 2 nodes.

    Brought up by `run`, the nodes do no work of their own: each passes tagged messages (see
    `message_tags`) from everything it reads to everything it writes. Brought up by `drive`, they
    drive a robot. In a notebook a design shows itself as a graph.

    Example::

        design = course.Design(outside=["motors/command"])
        design.node("lidar_driver").publishes("scan", LaserScan)
        design.node("reflex").subscribes("scan", LaserScan).publishes("motors/command", Twist)
        design.run()
    """

    def __init__(self, outside: Iterable[str] = ()) -> None:
        """Begin an empty design.

        Args:
            outside: topics, services and actions whose other side is not part of the design: the
                motors' electronics, or the person who sends goals.
        """
        if isinstance(outside, str):
            raise DesignError(
                "Design(outside=…) takes a list of names, such as ['motors/command']."
            )
        self.outside = frozenset("/" + name.strip("/") for name in outside)
        self.nodes: dict[str, NodeDeclaration] = {}

    @classmethod
    def from_data(cls, data: Mapping[str, Any], outside: Iterable[str] = ()) -> Design:
        """Return the design that plain data describe.

        Args:
            data: ``{node: {role: [[name, type], [name, type, qos], ...]}}``, where a role is one
                of the methods that declare an endpoint, such as ``"publishes"``, and a type is a
                class or a name such as ``"sensor_msgs/msg/LaserScan"``.
            outside: as for `Design`.

        Raises:
            DesignError: the data are none of that; names the node.
        """
        design = cls(outside)
        for name, roles in data.items():
            node = design.node(name)
            for role, entries in roles.items():
                if role not in list(Role):
                    known = ", ".join(Role)
                    raise DesignError(f"{name}: {role!r} is not one of {known}.")
                for entry in entries:
                    if isinstance(entry, str) or not 2 <= len(entry) <= 3:
                        raise DesignError(f"{name}.{role}: {entry!r} is not [name, type, qos].")
                    node.add_endpoint(Role(role), *entry)
        return design

    def node(
        self,
        name: str,
        *,
        namespace: str = "",
        factory: Callable[[], Node] | None = None,
    ) -> NodeDeclaration:
        """Declare a node, or return the one of that name.

        Args:
            name: its name on the ROS graph.
            namespace: its namespace, such as ``"front"``.
            factory: a node class of your own, or a function that returns a node: it is run in
                place of one that the library makes, and what you declare of it is only drawn.
                It passes a mark on by copying the header of what it received, or with
                ``course.design.carry(received, sent)`` just before it sends.

        Raises:
            DesignError: it is no name for a node, or `factory` cannot be called.
        """
        if not isinstance(name, str) or not isinstance(namespace, str):
            raise DesignError(f"{name!r} is not a name for a node: names are texts.")
        new = NodeDeclaration(name, namespace, factory)
        try:
            validate_node_name(name)
            validate_namespace("/" + namespace.strip("/"))
        except (InvalidNodeNameException, InvalidNamespaceException) as error:
            raise DesignError(
                f"{name!r} is not a name for a node: {rclpy_reason(error)}."
            ) from None
        if factory is not None and not callable(factory):
            raise DesignError(f"{name}: factory is a node class or a function, not {factory!r}.")
        known = self.nodes.setdefault(new.label, new)
        if factory is not None:
            known.factory = factory
        return known

    def findings(self) -> list[str]:
        """Return what is worth another look, a sentence each: links that cannot work.

        Only what is declared is looked at, so nodes of your own count with what you declare.
        """
        return findings.list_findings(self.nodes.values(), self.outside)

    def node_factories(self) -> dict[str, Callable[[], Node]]:
        """Return {label: a function that makes the node}, for code that runs the nodes.

        Raises:
            DesignError: there is no node, or two endpoints of one name disagree about its type.
        """
        if not self.nodes:
            raise DesignError("The design has no node yet: begin with design.node('name').")
        if clash := findings.type_clash(self.nodes.values()):
            raise DesignError(clash)
        return {
            label: node.factory or partial(DesignNode, node.name, node.namespace, node.endpoints)
            for label, node in self.nodes.items()
        }

    def run(self, session: CoreSession | None = None) -> dict[str, Node]:
        """Bring every node up and spin it in the background; replace those of an earlier run.

        Args:
            session: the session that runs them; None takes this notebook's own.

        Returns:
            The nodes, by label.

        Raises:
            DesignError: see `node_factories`.
        """
        factories = self.node_factories()
        # Imported by name: with a session given, nothing of the default one is needed.
        host = (
            session or importlib.import_module("course.learner_session.default_session").session()
        )
        nodes = _replace_nodes(host)
        made = {}
        for label, factory in factories.items():
            made[label] = host.run(factory)
            nodes.append(made[label])
        return made

    def drive(self, world: DrivenWorld, to: str | tuple[float, float]) -> Trip:
        """Bring every node up to do its work, and send the robot of a world to a place.

        The nodes do what their endpoints ask for, and know only what they are told: drivers have
        the sensors' cables, a node that reads a scan finds what is in the way, one that has the map
        and is asked plans a path, and ``motors/command`` moves the robot. What is missing in the
        design is missing on the floor. It returns at once::

            world = course.world("warehouse")
            design.drive(world, to="dock")

        Args:
            world: as `course.world` makes one; its robot is the design's from now on.
            to: the name of a station, or x and y in m.

        Returns:
            How the trip goes: it shows itself, and says what each node could not do.

        Raises:
            DesignError: see `node_factories`; or there is no such station.
            SessionError: the world has ended.
        """
        self.node_factories()
        # Imported by name: examinations, which never drive, need nothing of it.
        departure = importlib.import_module("course.design.at_work.departure")
        trip: Trip = departure.start_trip(self, world, to, _replace_nodes)
        return trip

    def __repr__(self) -> str:
        """Return the design as text: nodes, links, and what is worth another look."""
        return drawing.describe_design(self)

    def _repr_mimebundle_(self, include: Any = None, exclude: Any = None) -> dict[str, str]:
        return {
            "text/vnd.mermaid": drawing.draw_mermaid(self),
            "text/plain": drawing.describe_design(self),
        }
