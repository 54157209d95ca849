"""Declaring a design: which nodes there are, and what each of them is connected to."""

from __future__ import annotations

import importlib
import weakref
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import Any, Self

from rclpy.exceptions import InvalidNamespaceException, InvalidNodeNameException
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.validate_namespace import validate_namespace
from rclpy.validate_node_name import validate_node_name

from course.design import drawing, findings
from course.design.endpoints import DesignEndpoint, DesignError, Role, make_endpoint, rclpy_reason
from course.design.node import DesignNode
from course.runtime.core_session import CoreSession

_running: weakref.WeakKeyDictionary[CoreSession, list[Node]] = weakref.WeakKeyDictionary()


class NodeDeclaration:
    """One node of a design. Every method adds an endpoint and returns the node again."""

    def __init__(self, name: str, namespace: str = "", factory: Any = None) -> None:
        """Declare a node; `Design.node` does it for you."""
        self.name = name
        self.namespace = namespace
        self.factory = factory
        self.endpoints: list[DesignEndpoint] = []

    @property
    def label(self) -> str:
        """The name under which the design knows the node: with its namespace, if it has one."""
        return f"{self.namespace}/{self.name}".strip("/")

    def publishes(self, topic: str, msg_type: Any, qos: QoSProfile | int | None = None) -> Self:
        """Publish on a topic; without `qos`, reliable and volatile with depth 10."""
        return self._add_endpoint(Role.PUBLISHES, topic, msg_type, qos)

    def subscribes(self, topic: str, msg_type: Any, qos: QoSProfile | int | None = None) -> Self:
        """Subscribe to a topic; without `qos`, reliable and volatile with depth 10."""
        return self._add_endpoint(Role.SUBSCRIBES, topic, msg_type, qos)

    def serves(self, service: str, srv_type: Any, qos: QoSProfile | None = None) -> Self:
        """Answer the requests of a service."""
        return self._add_endpoint(Role.SERVES, service, srv_type, qos)

    def calls(self, service: str, srv_type: Any, qos: QoSProfile | None = None) -> Self:
        """Call a service."""
        return self._add_endpoint(Role.CALLS, service, srv_type, qos)

    def action_server(self, action: str, action_type: Any) -> Self:
        """Carry out the goals of an action."""
        return self._add_endpoint(Role.ACTION_SERVER, action, action_type)

    def action_client(self, action: str, action_type: Any) -> Self:
        """Send goals of an action."""
        return self._add_endpoint(Role.ACTION_CLIENT, action, action_type)

    def _add_endpoint(self, role: Role, name: str, ros_type: Any, qos: Any = None) -> Self:
        new = make_endpoint(role, self.name, self.namespace, name, ros_type, qos)
        for old in self.endpoints:
            if (old.role, old.full_name) == (role, new.full_name):
                raise DesignError(f"{self.label} {role} {new.full_name} twice: once is enough.")
        self.endpoints.append(new)
        return self

    def __repr__(self) -> str:
        """Return the node and its endpoints as text."""
        return "\n".join(drawing.node_lines(self))


class Design:
    """The nodes of a robot and what connects them, brought up as real ROS 2 nodes.

    The nodes do no work of their own: each passes tagged messages (see `message_tags`) from
    everything it reads to everything it writes. In a notebook a design shows itself as a graph.

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
                    node._add_endpoint(Role(role), *entry)
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
        if earlier := _running.pop(host, []):
            host.stop(*earlier)
        nodes = _running.setdefault(host, [])
        made = {}
        for label, factory in factories.items():
            made[label] = host.run(factory)
            nodes.append(made[label])
        return made

    def __repr__(self) -> str:
        """Return the design as text: nodes, links, and what is worth another look."""
        return drawing.describe_design(self)

    def _repr_mimebundle_(self, include: Any = None, exclude: Any = None) -> dict[str, str]:
        return {
            "text/vnd.mermaid": drawing.draw_mermaid(self),
            "text/plain": drawing.describe_design(self),
        }
