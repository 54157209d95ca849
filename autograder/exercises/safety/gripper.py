"""A gripper that fails on demand, and speed limits' operators: the examiner's side of services."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from geometry_msgs.msg import Twist
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import Executor
from rclpy.task import Future
from std_msgs.msg import Bool, Empty, String
from std_srvs.srv import SetBool

from autograder.exercises.safety.counterpart import Player
from autograder.observe.quiet_node import QuietNode


@dataclass
class Try:
    """One request that reached the gripper: when (simulated s), what, and its answer to come.

    ``crash`` lets the gripper's callback raise: rclpy then sends no answer at all.
    """

    at: float
    close: bool
    reply: Callable[[bool], None]
    crash: Callable[[], None]


class Gripper(QuietNode):
    """The server of `gripper/set`: notes each request, and answers when it is told to."""

    def __init__(self, arrived: Callable[[bool, Callable[[bool], None], Callable[[], None]], None]):
        """Tell ``arrived`` of each request: what it asks for, how to answer it, how to crash."""
        super().__init__("gripper")
        self._arrived = arrived
        group = ReentrantCallbackGroup()
        self.create_service(SetBool, "gripper/set", self._serve_request, callback_group=group)

    async def _serve_request(
        self, request: SetBool.Request, response: SetBool.Response
    ) -> SetBool.Response:
        executor = self.executor
        assert isinstance(executor, Executor)
        answer = Future(executor=executor)

        def reply(success: bool) -> None:
            answer.set_result(success)
            executor.wake()

        def crash() -> None:
            answer.set_exception(RuntimeError("the gripper's server raises"))
            executor.wake()

        self._arrived(request.data, reply, crash)
        response.success = await answer
        return response


class GripUser(Player):
    """Asks for grips, plays the gripper, and listens to outcomes."""

    CLIENT = "GripperClient"

    def __init__(self) -> None:
        """Create everything but the gripper."""
        super().__init__("grip_user")
        self.tries: list[Try] = []
        self.outcomes: list[str] = []
        self.before: list[str] = []  # the outcome of the request before this one, if there was any
        self.beats: list[float] = []
        self.holds = 0
        self._request = self.add_publisher(Bool, "grip/request")
        self.add_listener(
            String, "grip/outcome", lambda message: self.outcomes.append(message.data)
        )
        self.add_listener(Empty, "arm/hold", self._note_hold)
        self.add_listener(Empty, "grip/heartbeat", lambda _: self.beats.append(self.now))

    def _note_hold(self, _message: Empty) -> None:
        self.holds += 1

    def make_gripper(self) -> Gripper:
        """Return a gripper whose requests are noted here; it is for the session to run."""
        return Gripper(lambda *arrived: self.tries.append(Try(self.now, *arrived)))

    def request(self, close: bool) -> None:
        """Ask for a grip, and forget what was before, but for how it ended."""
        self.before = self.outcomes[-1:]
        self.tries, self.outcomes, self.beats, self.holds = [], [], [], 0
        self._request.publish(Bool(data=close))

    def missing_servers(self) -> list[str]:
        """Return whether the client of the gripper is missing."""
        return [] if self.count_clients("gripper/set") else ["no client of gripper/set"]


class Operator(Player):
    """Sets speed limits, jams the wheels, and sees what reaches them."""

    SERVER = "SpeedServer"

    def __init__(self) -> None:
        """Create the operator's client and ends of topics."""
        super().__init__("operator")
        self.limits: list[tuple[float, float]] = []
        self.commands: list[Twist] = []
        self._jam = self.add_publisher(Bool, "hardware/jammed")
        self.add_listener(Twist, "wheels/limits", self._note_limits)
        self.add_listener(Twist, "cmd_vel", lambda message: self.commands.append(message))
        self._client = self.create_client(SetParametersAtomically, "speed/set")
        self.add_used_service("speed/set")

    def _note_limits(self, message: Twist) -> None:
        self.limits.append((message.linear.x, message.angular.z))

    def jam_wheels(self, jammed: bool) -> None:
        """Jam the wheels, or free them."""
        self._jam.publish(Bool(data=jammed))

    def request_limits(self, parameters: list[Parameter]) -> Future:
        """Send a request; return the future of its answer. Forgets what was before."""
        self.limits, self.commands = [], []
        request = SetParametersAtomically.Request(parameters=parameters)
        return self._client.call_async(request)

    def missing_servers(self) -> list[str]:
        """Return whether the server is missing."""
        return [] if self._client.service_is_ready() else ["no server of speed/set"]


def double_parameter(name: str, value: float) -> Parameter:
    """Return a parameter that is a double."""
    kind = ParameterType.PARAMETER_DOUBLE
    return Parameter(name=name, value=ParameterValue(type=kind, double_value=value))


def integer_parameter(name: str, value: int) -> Parameter:
    """Return a parameter that is an integer."""
    kind = ParameterType.PARAMETER_INTEGER
    return Parameter(name=name, value=ParameterValue(type=kind, integer_value=value))


def bool_parameter(name: str, value: bool) -> Parameter:
    """Return a parameter that is a bool."""
    kind = ParameterType.PARAMETER_BOOL
    return Parameter(name=name, value=ParameterValue(type=kind, bool_value=value))


def string_parameter(name: str, value: str) -> Parameter:
    """Return a parameter that is a string."""
    kind = ParameterType.PARAMETER_STRING
    return Parameter(name=name, value=ParameterValue(type=kind, string_value=value))


def untyped_parameter(name: str) -> Parameter:
    """Return a parameter that has no type, and no value."""
    return Parameter(name=name)


def array_parameter(name: str, *values: float) -> Parameter:
    """Return a parameter that is an array of doubles."""
    kind = ParameterType.PARAMETER_DOUBLE_ARRAY
    return Parameter(name=name, value=ParameterValue(type=kind, double_array_value=list(values)))


def done_condition(future: Any) -> Callable[[], bool]:
    """Return a condition: the future is done."""
    return lambda: bool(future.done())
