"""The real node behind a declaration: it passes dye from what it reads to what it writes."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Sequence
from functools import partial
from itertools import cycle
from typing import Any

from nav_msgs.msg import OccupancyGrid
from rclpy.action.client import ActionClient
from rclpy.action.server import ActionServer, ServerGoalHandle
from rclpy.client import Client
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.task import Future
from sensor_msgs.msg import Imu

from course.design import message_tags
from course.design.endpoints import DesignEndpoint, Role
from course.design.lifelike import lifelike_message

REMEMBERED = 1000
"""How many tags a node knows again; so many can be on their way at a time."""
OF_ITSELF = (Imu, OccupancyGrid)
"""What a node that reads nothing sends unasked: others may do nothing before they have it."""
PERIOD_S = 0.5
"""Seconds until it sends that again."""


class DesignNode(Node):
    """A node with the endpoints of a declaration.

    A tag that comes in for the first time, by whatever endpoint, goes out by all of them: as a
    message, a request or a goal. Each tag passes a node once, so a cycle in the graph is no loop.
    What is sent is filled with something to work on, for the nodes of a student's own. They may
    wait for a map or an IMU, where no tag comes in: a node that reads nothing sends those unasked.
    """

    def __init__(self, name: str, namespace: str, endpoints: Sequence[DesignEndpoint]) -> None:
        """Make the node; its outlets first, so that nothing comes in before there is a way out."""
        super().__init__(name, namespace=namespace)
        self._lock = threading.Lock()
        self._known: deque[int] = deque(maxlen=REMEMBERED)
        self._outlets: list[Callable[[int], None]] = []
        self._unanswered: list[deque[int]] = []
        self._is_source = not any(end.role is Role.SUBSCRIBES for end in endpoints)
        for end in sorted(endpoints, key=lambda end: not end.role.is_writer):
            _MAKERS[end.role](self, end)

    def take_message(self, message: Any) -> None:
        """Pass on what a message is marked with, unless it has been here before."""
        for tag in message_tags.read_all(message):
            self._take_tag(tag)

    def _take_tag(self, tag: int) -> None:
        with self._lock:
            if tag in self._known:
                return
            self._known.append(tag)
            for queue in self._unanswered:
                queue.append(tag)
        for let_out in self._outlets:
            let_out(tag)

    # Topics.

    def _publish_topic(self, end: DesignEndpoint) -> None:
        publisher = self.create_publisher(end.type, end.full_name, end.qos)
        self._outlets.append(partial(self._send_message, publisher, end.type))
        if self._is_source and end.type in OF_ITSELF:
            self.create_timer(PERIOD_S, lambda: publisher.publish(lifelike_message(end.type)))

    def _send_message(self, publisher: Publisher, msg_type: Any, tag: int) -> None:
        message = lifelike_message(msg_type)
        if message_tags.mark(message, tag):
            publisher.publish(message)

    def _subscribe_topic(self, end: DesignEndpoint) -> None:
        self.create_subscription(end.type, end.full_name, self.take_message, end.qos)

    # Services.

    def _call_service(self, end: DesignEndpoint) -> None:
        client = self.create_client(end.type, end.full_name, qos_profile=end.qos)
        self._outlets.append(partial(self._send_request, client, end.type))

    def _send_request(self, client: Client, srv_type: Any, tag: int) -> None:
        if client.service_is_ready():
            request = lifelike_message(srv_type.Request)
            message_tags.mark(request, tag)
            client.call_async(request).add_done_callback(self._take_outcome)

    def _take_outcome(self, future: Future) -> None:
        if not future.cancelled() and future.exception() is None:
            self.take_message(future.result())

    def _serve_requests(self, end: DesignEndpoint) -> None:
        unanswered: deque[int] = deque(maxlen=REMEMBERED)
        self._unanswered.append(unanswered)

        turns = cycle((False, True))

        def answer(request: Any, _: Any) -> Any:
            self.take_message(request)
            response = lifelike_message(end.type.Response)
            asked = message_tags.read_all(request)
            with self._lock:
                others = [tag for tag in unanswered if tag not in asked]
                unanswered.clear()
                # A client may wait for its own mark, or for what else came in here. Where there is
                # room for one only, they take turns.
                own_first = bool(others and asked) and next(turns)
                told = message_tags.mark(
                    response, *([*asked, *others] if own_first else [*others, *asked])
                )
                unanswered.extend(tag for tag in others if tag not in told)
            return response

        self.create_service(end.type, end.full_name, answer, qos_profile=end.qos)

    # Actions.

    def _send_goals(self, end: DesignEndpoint) -> None:
        client = ActionClient(self, end.type, end.full_name)
        self._outlets.append(partial(self._send_goal, client, end.type))

    def _send_goal(self, client: ActionClient, action_type: Any, tag: int) -> None:
        goal = lifelike_message(action_type.Goal)
        if client.server_is_ready() and message_tags.mark(goal, tag):
            client.send_goal_async(
                goal, feedback_callback=lambda message: self.take_message(message.feedback)
            ).add_done_callback(self._follow_goal)

    def _follow_goal(self, future: Future) -> None:
        handle = None if future.exception() is not None else future.result()
        if handle is not None and handle.accepted:
            handle.get_result_async().add_done_callback(self._take_result)

    def _take_result(self, future: Future) -> None:
        if future.exception() is None and (answer := future.result()) is not None:
            self.take_message(answer.result)

    def _carry_out_goals(self, end: DesignEndpoint) -> None:
        ActionServer(self, end.type, end.full_name, partial(self._execute_goal, end.type))

    def _execute_goal(self, action_type: Any, goal: ServerGoalHandle) -> Any:
        self.take_message(goal.request)
        feedback, result = (
            lifelike_message(action_type.Feedback),
            lifelike_message(action_type.Result),
        )
        if message_tags.carry(goal.request, feedback):
            goal.publish_feedback(feedback)
        message_tags.carry(goal.request, result)
        goal.succeed()
        return result


_MAKERS: dict[Role, Callable[[DesignNode, DesignEndpoint], None]] = {
    Role.PUBLISHES: DesignNode._publish_topic,
    Role.SUBSCRIBES: DesignNode._subscribe_topic,
    Role.CALLS: DesignNode._call_service,
    Role.SERVES: DesignNode._serve_requests,
    Role.ACTION_CLIENT: DesignNode._send_goals,
    Role.ACTION_SERVER: DesignNode._carry_out_goals,
}
