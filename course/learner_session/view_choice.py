"""Which live view fits a thing on the ROS graph."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from rclpy.action.graph import get_action_names_and_types
from rclpy.node import Node

from course.errors import SessionError
from course.messages.yaml_text import short_repr
from course.runtime.requests.graph_queries import full_action, full_node, full_service
from course.views.shared.live_view import LiveView

if TYPE_CHECKING:
    from course.views.action import ActionView
    from course.views.parameters import ParameterPanel
    from course.views.service import ServiceConsole
    from course.views.timeline import Timeline


class ViewMaker(Protocol):
    """The part of a session that makes views; see `course.Session`."""

    @property
    def observer(self) -> Node:
        """The node that looks at the graph."""

    def action(self, name: str) -> ActionView:
        """Return a view of an action."""

    def service(self, name: str) -> ServiceConsole:
        """Return a view of a service."""

    def parameters(self, node: Node | str) -> ParameterPanel:
        """Return a view of a node's parameters."""

    def timeline(self, *topics: str) -> Timeline:
        """Return a view of topics."""


def choose_view(session: ViewMaker, shown: LiveView | Node | str) -> LiveView:
    """Return the view of an action, a service, a node's parameters or a topic, by what has a name.

    A view is returned as it is.

    Raises:
        SessionError: it is none of these, or no name.
        WaitTimeout: nobody uses the name.
    """
    if isinstance(shown, LiveView):
        return shown
    if isinstance(shown, Node):
        return session.parameters(shown)
    if not isinstance(shown, str):
        raise SessionError(
            f"A panel shows names, nodes and views, not {short_repr(shown)}: write "
            'session.panel("drive", "robot/battery").'
        )
    observer = session.observer
    if full_action(observer, shown) in dict(get_action_names_and_types(observer)):
        return session.action(shown)
    if full_service(observer, shown) in dict(observer.get_service_names_and_types()):
        return session.service(shown)
    found = observer.get_node_names_and_namespaces()
    nodes = {f"{space.rstrip('/')}/{name}" for name, space in found}
    return session.parameters(shown) if full_node(shown) in nodes else session.timeline(shown)
