"""One node of a design: its name, and what it is connected to."""

from __future__ import annotations

from typing import Any, Self

from rclpy.qos import QoSProfile

from course.design import drawing
from course.design.endpoints import DesignEndpoint, DesignError, Role, make_endpoint


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
        return self.add_endpoint(Role.PUBLISHES, topic, msg_type, qos)

    def subscribes(self, topic: str, msg_type: Any, qos: QoSProfile | int | None = None) -> Self:
        """Subscribe to a topic; without `qos`, reliable and volatile with depth 10."""
        return self.add_endpoint(Role.SUBSCRIBES, topic, msg_type, qos)

    def serves(self, service: str, srv_type: Any, qos: QoSProfile | None = None) -> Self:
        """Answer the requests of a service."""
        return self.add_endpoint(Role.SERVES, service, srv_type, qos)

    def calls(self, service: str, srv_type: Any, qos: QoSProfile | None = None) -> Self:
        """Call a service."""
        return self.add_endpoint(Role.CALLS, service, srv_type, qos)

    def action_server(self, action: str, action_type: Any) -> Self:
        """Carry out the goals of an action."""
        return self.add_endpoint(Role.ACTION_SERVER, action, action_type)

    def action_client(self, action: str, action_type: Any) -> Self:
        """Send goals of an action."""
        return self.add_endpoint(Role.ACTION_CLIENT, action, action_type)

    def add_endpoint(self, role: Role, name: str, ros_type: Any, qos: Any = None) -> Self:
        """Add an endpoint of a role.

        Raises:
            DesignError: it is there already, or its name, type or QoS is none.
        """
        new = make_endpoint(role, self.name, self.namespace, name, ros_type, qos)
        for old in self.endpoints:
            if (old.role, old.full_name) == (role, new.full_name):
                raise DesignError(f"{self.label} {role} {new.full_name} twice: once is enough.")
        self.endpoints.append(new)
        return self

    def __repr__(self) -> str:
        """Return the node and its endpoints as text."""
        return "\n".join(drawing.node_lines(self))
