"""The session as learners know it: it runs nodes, and shows and explains what they do."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from rclpy.action.graph import get_action_names_and_types
from rclpy.node import Node
from rclpy.qos import QoSProfile

from course.errors import SessionError
from course.messages.types import load_type
from course.runtime.core_session import CoreSession
from course.runtime.domains.leases import require_reachable
from course.runtime.requests.graph_queries import full_action, full_node, full_service
from course.util import argument_checks
from course.util.close_matches import close_match

if TYPE_CHECKING:
    from course.diagnosis import Diagnosis
    from course.views.action import ActionView
    from course.views.graph import GraphView
    from course.views.log import LogPanel
    from course.views.panel import Panel
    from course.views.parameters import ParameterPanel
    from course.views.qos_lab import QoSLab
    from course.views.service import ServiceConsole
    from course.views.shared.live_view import LiveView
    from course.views.timeline import Timeline
    from course.views.world import World


class Session(CoreSession):
    """One private rclpy Context on one domain, the nodes that it runs, and views of them.

    The views are imported when one is asked for. Attributes are those of `CoreSession`.
    """

    _world: World | None = None

    def world(self, name: str | Path = "warehouse", *, seed: int = 0) -> World:
        """Return a live view of a simulated floor with a robot on it, a node of this session.

        The node publishes the robot's sensors and drives by ``cmd_vel``. It follows the session's
        clock, and ends with the session, or when you ask for a world again.

        Args:
            name: "warehouse", "aisle", "corridor", "hall", or the path of your floor plan (YAML).
            seed: decides on the noise of the sensors: the same seed makes the same noise.

        Raises:
            FloorPlanError: there is no such floor plan, or it is not sound.
            SessionError: the session is closed.
        """
        from course.views.world import World
        from course.worlds.floor_plan import load_floor_plan
        from course.worlds.running_world import RunningWorld

        self.require_open()
        plan = load_floor_plan(name)
        if self._world is not None:
            self._world.close()
        self._world = World(self, RunningWorld(self, plan, seed))
        return self._world

    def panel(self, *shown: LiveView | Node | str) -> Panel:
        """Return live views side by side, as an operator has them: of each thing the one that fits.

        For example, ``session.panel(session.world("aisle"), "drive", "robot/battery")``.

        Args:
            shown: names of actions, services, nodes (their parameters) and topics; nodes; or views.

        Raises:
            SessionError: nothing to show, or too much; or the session is closed.
            WaitTimeout: a name that nobody uses.
        """
        from course.learner_session.view_choice import choose_view
        from course.views.panel import Panel

        self.require_open()
        return Panel([choose_view(self, each) for each in shown])

    def graph(self, *, everything: bool = False) -> GraphView:
        """Return a live view of the ROS graph as this session sees it.

        Args:
            everything: show what the ROS tools hide, too: /rosout, parameter services and the like.

        Raises:
            SessionError: the session is closed.
        """
        from course.views.graph import GraphView

        self.require_open()
        return GraphView(self, everything=everything)

    def log_panel(self, *, level: str = "DEBUG") -> LogPanel:
        """Return a live view of what all nodes log and print, of at least this level.

        Raises:
            SessionError: the session is closed, or there is no such level.
        """
        from course.views.log import LogPanel

        self.require_open()
        return LogPanel(self, level)

    def service(
        self, name: str, srv_type: Any | None = None, *, timeout: float = 5.0
    ) -> ServiceConsole:
        """Return a console that calls a service by a form made from its type.

        Args:
            name: the service.
            srv_type: its class; None takes it from the graph.
            timeout: seconds that an answer may take.

        Raises:
            SessionError: nobody offers it, so its type is unknown; or the session is closed.
        """
        from course.views.service import ServiceConsole

        if srv_type is not None:
            argument_checks.ros_type(srv_type, "service")
        timeout = argument_checks.check_seconds(timeout)
        full = full_service(self.observer, name)
        known = self.observer.get_service_names_and_types()
        found = srv_type or self._type_of("service", full, known)
        return ServiceConsole(self, found, full, timeout)

    def action(self, name: str, action_type: Any | None = None) -> ActionView:
        """Return a live view of an action's goals, with a form that sends one.

        Args:
            name: the action.
            action_type: its class; None takes it from the graph.

        Raises:
            SessionError: nobody offers it, so its type is unknown; or the session is closed.
        """
        from course.views.action import ActionView

        if action_type is not None:
            argument_checks.ros_type(action_type, "action")
        full = full_action(self.observer, name)
        known = get_action_names_and_types(self.observer)
        found = action_type or self._type_of("action", full, known)
        return ActionView(self, found, full)

    def parameters(self, node: Node | str) -> ParameterPanel:
        """Return a live panel of a node's parameters.

        Raises:
            WaitTimeout: there is no such node, or it does not answer.
            SessionError: the session is closed.
        """
        from course.views.parameters import ParameterPanel

        self.require_open()
        return ParameterPanel(self, full_node(node))

    def timeline(self, *topics: str | tuple[str, Any], window: float = 10.0) -> Timeline:
        """Return a live view of when messages were published, received and worked on.

        Args:
            topics: names, or (name, message class) where nobody uses the topic yet; 1 to 6.
            window: how many seconds it shows, up to 60; of a topic with more than 20000 messages
                in that time, the latest.

        Raises:
            SessionError: no topic, too many, a window out of range, or a closed session.
            WaitTimeout: a topic that nobody uses.
        """
        from course.views.timeline import Timeline

        self.require_open()
        named = [_check_topic(topic) for topic in topics]
        return Timeline(self, named, argument_checks.check_seconds(window, "window"))

    def qos_lab(
        self, offered: QoSProfile | int | None = None, requested: QoSProfile | int | None = None
    ) -> QoSLab:
        """Return the QoS lab: predict what two profiles do together, then see it happen.

        Args:
            offered: the writer's profile to begin with; a number is the depth of a default one,
                None the default itself.
            requested: the reader's.

        Raises:
            ProfileError: a policy that the lab does not know (SYSTEM_DEFAULT, say).
            SessionError: the session is closed.
        """
        from course.views.qos_lab import QoSLab

        self.require_open()
        return QoSLab(
            self, argument_checks.check_qos(offered), argument_checks.check_qos(requested)
        )

    def diagnose(self) -> Diagnosis:
        """Return what is wrong, or may be, with the nodes here: in plain words, with the mend.

        It looks for callbacks that do not return, nodes that nobody spins or that were taken away,
        constructors and lifecycle transitions that failed, managed nodes that are not active,
        endpoints that do not fit or have nobody on the other side, names that two nodes bear,
        nodes that do not answer, and domains that differ. A wait that times out says the same.

        Raises:
            SessionError: the session is closed.
        """
        from course.diagnosis import diagnose

        self.require_open()
        return diagnose(self)

    def _further_hints(self, *, vague: bool, sought: str) -> list[str]:
        from course.diagnosis import likely_reasons

        try:
            found = likely_reasons(self, vague=vague, sought=sought)
        except Exception:  # noqa: BLE001 - the session may end meanwhile; the wait has its own error
            return []
        return [f"{finding.message} {finding.mend}" for finding in found]

    def _check_domain(self, domain_id: object) -> int:
        domain = super()._check_domain(domain_id)
        require_reachable(domain)
        return domain

    def _type_of(self, what: str, name: str, known: list[tuple[str, list[str]]]) -> Any:
        types = dict(known)
        if name not in types:
            close = close_match(name, types)
            guess = f" Is it {close}?" if close else ""
            raise SessionError(f"Nobody offers the {what} {name}, so its type is unknown.{guess}")
        return load_type(types[name][0], name, "srv" if what == "service" else what)


def _check_topic(topic: Any) -> tuple[str, Any | None]:
    """Return the name of a topic and, if it was given, its message class.

    Raises:
        SessionError: it is neither a name nor such a pair.
    """
    if not isinstance(topic, tuple) or len(topic) != 2:
        return argument_checks.check_text(topic, "A topic", "/scan"), None
    name, msg_type = topic
    if msg_type is not None:
        argument_checks.ros_type(msg_type, "message")
    return argument_checks.check_text(name, "A topic", "/scan"), msg_type
