"""The robot that the views look at.

Browser tests copy this file beside the notebook that they open, so it imports nothing of ours.
"""

from __future__ import annotations

import threading
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor, SetParametersResult
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from std_msgs.msg import String
from std_srvs.srv import SetBool
from test_msgs.action import Fibonacci


class Robot(Node):
    """Serves, acts, and has parameters; `go` lets its goals end. At a rate (Hz) it chatters.

    ``published`` counts its chatter.
    """

    def __init__(self, rate: float = 0.0) -> None:
        super().__init__("robot")
        limits = FloatingPointRange(from_value=0.0, to_value=2.0, step=0.5)
        about = ParameterDescriptor(description="m/s", floating_point_range=[limits])
        self.declare_parameter("speed", 0.5, about)
        self.declare_parameter("name", "r2")
        self.declare_parameter("lights", value=True)
        self.declare_parameter("legs", 4)
        self.add_on_set_parameters_callback(self._judge)
        group = ReentrantCallbackGroup()
        self.published = 0
        if rate:
            self.chatter = self.create_publisher(String, "chatter", 10)
            self.create_publisher(String, "scan", qos_profile_sensor_data)
            self.create_timer(1 / rate, self.talk)
        self.create_service(SetBool, "lamp", self._switch, callback_group=group)
        self.go = threading.Event()
        self._action = ActionServer(
            self, Fibonacci, "count", self._count, callback_group=group,
            goal_callback=self._accept, cancel_callback=lambda _goal: CancelResponse.ACCEPT,
        )  # fmt: skip

    def talk(self) -> None:
        """Chatter once."""
        self.chatter.publish(String(data="hello"))
        self.published += 1

    def _judge(self, parameters: list[Any]) -> SetParametersResult:
        limits = {"speed": (1.5, "too fast for a corridor"), "legs": (8, "no insect has so many")}
        for parameter in parameters:
            most, reason = limits.get(parameter.name, (None, ""))
            if most is not None and parameter.value > most:
                return SetParametersResult(successful=False, reason=reason)
        return SetParametersResult(successful=True)

    def _switch(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        response.success, response.message = request.data, "lamp"
        return response

    def _accept(self, goal: Fibonacci.Goal) -> GoalResponse:
        return GoalResponse.REJECT if goal.order < 0 else GoalResponse.ACCEPT

    def _count(self, goal: Any) -> Fibonacci.Result:
        goal.publish_feedback(Fibonacci.Feedback(sequence=[0, 1]))
        while not self.go.wait(0.01):
            if goal.is_cancel_requested:
                goal.canceled()
                return Fibonacci.Result()
        goal.succeed()
        return Fibonacci.Result(sequence=[0, 1, 1])


class Listener(Node):
    """Reads the chatter, and asks for more than the scan offers."""

    def __init__(self) -> None:
        super().__init__("listener")
        self.heard = 0
        self.create_subscription(String, "chatter", self._hear, 10)
        self.create_subscription(String, "scan", lambda _message: None, 10)

    def _hear(self, message: String) -> None:
        self.heard += 1
        self.get_logger().info(f"heard {message.data}")
