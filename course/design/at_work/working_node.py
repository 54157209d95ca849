"""The real node behind a declaration, at work: it does what its endpoints ask for."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from rclpy.node import Node

from course.design.at_work.driving.sensing import nearest_first
from course.design.at_work.driving.steering import STAND, Command
from course.design.at_work.ends.goals import GoalSender, GoalServer
from course.design.at_work.ends.outlets import Outlets
from course.design.at_work.ends.questions import Questions
from course.design.at_work.meanings import AHEAD, SENSED, Meaning, hands_out_map
from course.design.at_work.places import messages as places
from course.design.at_work.places.place import BASE, MAP, Place
from course.design.at_work.worker import ARRIVED_M, Worker, find_obstacles
from course.design.endpoints import DesignEndpoint, Role

PERIOD_S = 0.1
"""Seconds between two looks at what is to be done."""

IDLE_PERIOD_S = 0.05
"""Seconds between two commands to stand, of a node that is told of nothing to drive by."""

ASK_EVERY, SEND_EVERY, MAP_EVERY = 10, 5, 10
"""Looks between two questions for a way, two goals that tell one, and two sendings of the map."""


class WorkingNode(Node):
    """A node that works with what it hears, and tells what it is declared to tell.

    Attributes:
        worker: what it knows, and makes of it.
    """

    def __init__(
        self, name: str, namespace: str, worker: Worker, meanings: Mapping[str, Meaning],
        frames: Mapping[str, str],
    ) -> None:  # fmt: skip
        """Make the node.

        Args:
            name: its name.
            namespace: its namespace.
            worker: what it knows and makes of it.
            meanings: what each topic and action carries.
            frames: of the topics and actions that say where to drive.
        """
        super().__init__(name, namespace=namespace)
        self.worker = worker
        self._meanings, self._frames = meanings, frames
        self._outlets = Outlets(self)
        self._questions = Questions(self, worker)
        self._senders: list[GoalSender] = []
        self._servers: list[GoalServer] = []
        self._looks = 0
        for end in sorted(worker.part.endpoints, key=lambda end: not end.role.is_writer):
            _MAKERS[end.role](self, end)
        self.create_timer(PERIOD_S, self._look)
        if Meaning.VELOCITY not in worker.part.hears and not worker.needs_way:
            self.create_timer(IDLE_PERIOD_S, lambda: self._command(STAND))

    def take_reading(self, meaning: Meaning, message: Any) -> None:
        """Take a reading from the cable of the sensor whose driver this is, and publish it."""
        self._outlets.hand_on(meaning, message)
        if meaning is Meaning.ODOMETRY and Meaning.POSE in self._outlets:
            self._hear_pose(message)

    @property
    def now_s(self) -> float:
        """What its clock says, in s."""
        return float(self.get_clock().now().nanoseconds) / 1e9

    def _meaning_of(self, end: DesignEndpoint) -> Meaning:
        return self._meanings.get(end.full_name, Meaning.OTHER)

    # Topics.

    def _publish_topic(self, end: DesignEndpoint) -> None:
        self._outlets.add(end, self._meaning_of(end))

    def _subscribe_topic(self, end: DesignEndpoint) -> None:
        meaning, name = self._meaning_of(end), end.full_name

        def hear(message: Any) -> None:
            self.worker.note(meaning, self.now_s)
            self._hear(meaning, name, message)

        self.create_subscription(end.type, name, hear, end.qos)

    def _hear(self, meaning: Meaning, name: str, message: Any) -> None:
        hears = self.worker.part.hears
        if meaning in SENSED:
            self._outlets.hand_on(meaning, message)  # as a filter does
            if self.worker.part.tells & {Meaning.OBSTACLES, Meaning.VELOCITY}:
                self._hear_obstacles(name, (find_obstacles(meaning, message), BASE))
        elif meaning is Meaning.OBSTACLES:
            self._hear_obstacles(name, places.read_places(message, BASE))
        elif meaning is Meaning.POSE or (meaning is Meaning.ODOMETRY and Meaning.POSE not in hears):
            self._hear_pose(message)
        elif meaning is Meaning.MEASURED_SPEED:
            if Meaning.ODOMETRY not in hears and (twist := places.find_twist(message)) is not None:
                self.worker.hear_speed(twist.linear.x, twist.angular.z, self.now_s)
                self._tell_pose()
        elif meaning is Meaning.MAP:
            self.worker.hear_map(message)
        elif meaning in AHEAD:
            self._hear_way(meaning, name, message)
        elif meaning is Meaning.VELOCITY and (twist := places.find_twist(message)) is not None:
            asked = Command(twist.linear.x, twist.angular.z)
            self._command(self.worker.guard(asked, self.now_s))

    def _hear_obstacles(self, name: str, found: tuple[list[Place], str]) -> None:
        self.worker.hear_obstacles(name, found, self.now_s)
        seen = nearest_first(self.worker.obstacles(self.now_s) or [])
        self._outlets.tell_places(Meaning.OBSTACLES, seen, BASE)
        for sender in self._senders:
            if sender.meaning is Meaning.OBSTACLES:
                sender.send(seen, BASE)

    def _hear_pose(self, message: Any) -> None:
        for pose in places.read_places(message)[0][:1]:
            self.worker.hear_pose(pose, self.now_s)
            self._tell_pose()
        if (twist := places.find_twist(message)) is not None:
            self._outlets.tell_velocity(Meaning.MEASURED_SPEED, twist.linear.x, twist.angular.z)

    def _tell_pose(self) -> None:
        if (pose := self.worker.pose(self.now_s)) is not None:
            self._outlets.tell_places(Meaning.POSE, [pose], MAP)

    def _hear_way(self, meaning: Meaning, name: str, message: Any) -> None:
        way = places.read_places(message, self._frames.get(name, MAP))
        if way[0]:
            self.worker.hear_way(meaning, way, self.now_s)

    def _command(self, command: Command) -> None:
        self._outlets.tell_velocity(Meaning.VELOCITY, command.speed, command.turn)

    # Services.

    def _serve_requests(self, end: DesignEndpoint) -> None:
        answer = self._answer_map if hands_out_map(end.type) else self._answer_plan
        self.create_service(end.type, end.full_name, answer, qos_profile=end.qos)

    def _answer_map(self, _request: Any, response: Any) -> Any:
        if self.worker.grid is not None:
            self.worker.grid.write_message(response.map)
        return response

    def _answer_plan(self, request: Any, response: Any) -> Any:
        asked = [places.read_places(field)[0][0] for field in places.place_fields(request)]
        start, goal = asked[0] if asked[1:] else None, asked[-1] if asked else None
        way = self.worker.plan(start, goal, self.now_s)
        if way:
            places.write_places(response, way, MAP)
        if hasattr(response, "success"):
            response.success = bool(way)
        return response

    # Actions.

    def _send_goals(self, end: DesignEndpoint) -> None:
        sender = GoalSender(self, end.type, end.full_name, self._meaning_of(end))
        self._senders.append(sender)

    def _carry_out_goals(self, end: DesignEndpoint) -> None:
        meaning = self._meaning_of(end)
        self._servers.append(GoalServer(self, end.type, end.full_name, meaning, self._begin_goal))

    def _begin_goal(self, name: str, request: Any) -> None:
        meaning = self._meanings.get(name, Meaning.OTHER)
        if meaning is Meaning.GOAL:
            self.worker.forget_way()
        self.worker.note(meaning, self.now_s)
        self._hear(meaning, name, request)
        self._questions.ask_for_way()

    def _follow_goals(self) -> None:
        left = self.worker.distance_left(self.now_s)
        for server in self._servers:
            if server.is_busy:
                arrived = left is not None and left < ARRIVED_M
                if server.report(left) or arrived:
                    server.finish(arrived=arrived)
                    self.worker.forget_way()

    # What it does ten times a second.

    def _look(self) -> None:
        self._looks += 1
        if self._looks % ASK_EVERY == 1:
            self._questions.ask_for_map()
            self._questions.ask_for_way()
            self._plan_by_itself()
        if self._looks % MAP_EVERY == 1 and self.worker.grid is not None:
            self._outlets.tell_map(self.worker.grid.write_message)
        self._follow_goals()
        self._tell_ways()
        if Meaning.VELOCITY not in self.worker.part.hears and self.worker.needs_way:
            self._command(self.worker.command(self.now_s))

    def _plan_by_itself(self) -> None:
        worker = self.worker
        plans = Meaning.PATH in worker.part.tells and not worker.needs_path
        if plans and (way := worker.plan(None, None, self.now_s)):
            worker.hear_way(Meaning.PATH, (way, MAP), self.now_s)

    def _tell_ways(self) -> None:
        for meaning in AHEAD:
            for name in self._outlets.names_of(meaning):
                frame = self._frames.get(name, MAP)
                if way := self.worker.way_in(frame, self.now_s):
                    end = way if meaning is Meaning.PATH else way[-1:]
                    self._outlets.tell_places(meaning, end, frame, name)
        for sender in self._senders if self._looks % SEND_EVERY == 1 else ():
            frame = self._frames.get(sender.name, MAP)
            if sender.meaning in AHEAD and (way := self.worker.way_in(frame, self.now_s)):
                sender.send(way, frame)


_MAKERS: dict[Role, Callable[[WorkingNode, DesignEndpoint], None]] = {
    Role.PUBLISHES: WorkingNode._publish_topic,
    Role.SUBSCRIBES: WorkingNode._subscribe_topic,
    Role.CALLS: lambda node, end: node._questions.add(end),
    Role.SERVES: WorkingNode._serve_requests,
    Role.ACTION_CLIENT: WorkingNode._send_goals,
    Role.ACTION_SERVER: WorkingNode._carry_out_goals,
}
