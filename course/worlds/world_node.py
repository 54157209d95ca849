"""The ROS 2 node of a world: what the robot's drivers would publish, hear and serve."""

from __future__ import annotations

import functools
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass
from typing import Any

from geometry_msgs.msg import PoseArray, Twist
from nav_msgs.msg import Odometry, Path
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.subscription import Subscription
from sensor_msgs.msg import BatteryState, Image, Imu, LaserScan
from std_msgs.msg import Bool, String
from std_srvs.srv import SetBool, Trigger

from course.worlds import messages
from course.worlds.pacing import PacedSimulation
from course.worlds.robot.base import STEP_S
from course.worlds.robot.gripper import SLOW_STEPS
from course.worlds.simulation import (
    BATTERY_STEPS,
    CAMERA_STEPS,
    SCAN_STEPS,
    WHEEL_STEPS,
    Readings,
)

WALL_PERIOD_S = 0.02
"""Seconds of wall time between two looks at the clock: two steps at a time take half of the
processor time that one at a time takes. On simulated time it looks at each step."""

_LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
_OUTPUTS: tuple[tuple[str, Any, QoSProfile | int, float], ...] = (
    # All reliable: whoever asks for less gets it, too. An emergency stop must not be lost.
    ("scan", LaserScan, 5, 1 / (SCAN_STEPS * STEP_S)),
    ("camera/image", Image, 5, 1 / (CAMERA_STEPS * STEP_S)),
    ("imu/data", Imu, 50, 1 / STEP_S),
    ("wheel/odometry", Odometry, 10, 1 / (WHEEL_STEPS * STEP_S)),
    ("battery_state", BatteryState, _LATCHED, 1 / (BATTERY_STEPS * STEP_S)),
    ("emergency/stop", String, 100, 0.0),
    ("bumper", Bool, 100, 0.0),
    ("hardware/jammed", Bool, _LATCHED, 0.0),
)
_EVENTS = {"emergency": "emergency/stop", "bumper": "bumper", "jammed": "hardware/jammed"}


Deliver = Callable[[str, Any], None]
"""Takes the name of a sensor's topic and a message, in the world's thread: a cable."""


@dataclass
class _Topic:
    """A topic of the world: its rate in Hz (0 for events), and the last message or its maker."""

    name: str
    msg_type: Any
    rate: float
    last: Any = None

    def describe(self) -> dict[str, Any]:
        last = self.last() if callable(self.last) else self.last
        return {
            "name": self.name,
            "type": messages.type_name(self.msg_type),
            "rate": round(self.rate, 1),
            "last": "" if last is None else messages.describe_message(last),
        }


class WorldNode(Node):
    """Moves a paced simulation on, publishes its readings, and passes commands to it."""

    def __init__(self, name: str, paced: PacedSimulation) -> None:
        """Make the node; the world begins with `paced.start`."""
        super().__init__(name)
        self._paced = paced
        self._simulation = paced.simulation
        self._topics: dict[str, _Topic] = {}
        self._outputs: dict[str, Publisher] = {}
        self._inputs: dict[str, Subscription] = {}
        self._deliver: Deliver = _drop_message
        self._cables: Collection[str] = ()
        for topic, msg_type, qos, rate in _OUTPUTS:
            self._outputs[topic] = publisher = self.create_publisher(msg_type, topic, qos)
            self._topics[topic] = _Topic(publisher.topic_name, msg_type, rate)
        self._listen(Twist, "cmd_vel", self._on_command)
        self._listen(Path, "plan", self._on_path)
        self._listen(PoseArray, "obstacles", self._on_found)
        self.create_service(Trigger, "world/reset", self._on_reset)
        self._gripper = self.create_service(SetBool, "gripper/set", self._on_gripper)
        # A service of rclpy answers when its callback returns. This one may answer late, or never.
        self._reply = self._gripper.send_response
        self._gripper.send_response = self._send_gripper_reply  # type: ignore[method-assign]
        self._late_replies: list[list[Any]] = []  # steps left, response, header
        self.create_timer(STEP_S if paced.exact else WALL_PERIOD_S, self.advance)

    @property
    def now_ns(self) -> int:
        """What the node's clock says."""
        return int(self.get_clock().now().nanoseconds)

    def advance(self) -> None:
        """Take all steps that are due, and publish what they have to say."""
        with self._paced.lock:
            self._publish_steps(self._paced.steps_due(self.now_ns))

    def take_one_look(self) -> None:
        """Take 0.1 s of steps at once, also while paused."""
        with self._paced.lock:
            self._publish_steps(self._paced.steps_of_one_look(self.now_ns))

    def publish_events(self) -> None:
        """Publish what has happened since: stops, bumps, jams."""
        if self._has_radio:  # else they wait until it is back
            for kind, value in self._simulation.take_events():
                topic = _EVENTS[kind]
                self._publish(topic, self._topics[topic].msg_type(data=value))

    def hand_over(self, deliver: Deliver, cables: Collection[str], motors: str) -> None:
        """Leave the robot's topics to other nodes, which have its cables from now on.

        Args:
            deliver: gets what the world would publish.
            cables: the topics whose messages are worth making; looked at each time.
            motors: the topic that its motors hear, instead of ``cmd_vel``.
        """
        assert self.executor is not None
        with self.executor.hold_still(), self._paced.lock:  # type: ignore[attr-defined]
            self._deliver, self._cables = deliver, cables
            for publisher in self._outputs.values():
                self.destroy_publisher(publisher)
            self._outputs.clear()
            for topic, subscription in self._inputs.items():
                del self._topics[topic]
                self.destroy_subscription(subscription)
            self._inputs.clear()
            self._listen(Twist, motors, self._on_command)

    def describe_topics(self) -> list[dict[str, Any]]:
        """Return name, type, rate (Hz, 0 for what comes now and then) and last message of each."""
        return [topic.describe() for topic in self._topics.values()]

    # Inside.

    @property
    def _has_radio(self) -> bool:
        return self._simulation.faults["radio"] == "there"

    def _listen(self, msg_type: Any, topic: str, handle: Callable[[Any], None]) -> None:
        def receive(message: Any) -> None:
            with self._paced.lock:
                self.advance()  # a command holds from now on, whether or not the timer came first
                if self._has_radio:
                    entry.last = message
                    handle(message)

        subscription = self.create_subscription(msg_type, topic, receive, 10)
        entry = self._topics[topic] = _Topic(subscription.topic_name, msg_type, 0.0)
        self._inputs[topic] = subscription

    def _on_command(self, message: Twist) -> None:
        self._simulation.drive(message.linear.x, message.angular.z)

    def _on_path(self, message: Path) -> None:
        positions = [pose.pose.position for pose in message.poses]
        self._simulation.show_path([(point.x, point.y) for point in positions])

    def _on_found(self, message: PoseArray) -> None:
        positions = [pose.position for pose in message.poses]
        self._simulation.show_found([(point.x, point.y) for point in positions])

    def _on_reset(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        with self._paced.lock:
            self.advance()
            self._simulation.reset()
            self._late_replies.clear()
            self.publish_events()
        response.success, response.message = True, "The world is as at first."
        return response

    def _on_gripper(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        with self._paced.lock:
            self.advance()
            response.success = self._has_radio and self._simulation.command_gripper(request.data)
        done = "closed" if request.data else "opened"
        response.message = done if response.success else "refused"
        return response

    def _send_gripper_reply(self, response: SetBool.Response, header: Any) -> None:
        state = self._simulation.faults["gripper"]
        if state == "dead" or not self._has_radio:
            return
        if state == "slow":
            self._late_replies.append([SLOW_STEPS, response, header])
        else:
            self._reply(response, header)

    def _send_late_replies(self) -> None:
        for waiting in self._late_replies:
            waiting[0] -= 1
            if waiting[0] <= 0 and self._has_radio:
                self._reply(waiting[1], waiting[2])
        self._late_replies = [waiting for waiting in self._late_replies if waiting[0] > 0]

    def _publish_steps(self, steps: Iterable[tuple[int, Readings]]) -> None:
        for stamp_ns, readings in steps:
            self._publish_readings(stamp_ns, readings)
            self.publish_events()
            if self._late_replies:
                self._send_late_replies()

    def _publish_readings(self, stamp_ns: int, readings: Readings) -> None:
        if not self._has_radio:
            return
        imu = functools.partial(messages.make_imu, stamp_ns, readings.imu)
        if self._is_heard("imu/data"):  # at 100 Hz a message that nobody gets is worth saving
            self._publish("imu/data", imu())
        self._topics["imu/data"].last = imu
        if readings.scan is not None:
            period_s = SCAN_STEPS * STEP_S
            self._publish("scan", messages.make_scan(stamp_ns, readings.scan, period_s))
        if readings.picture_due and self._is_heard("camera/image"):
            picture = self._simulation.render_picture()
            self._publish("camera/image", messages.make_image(stamp_ns, picture))
        if readings.wheels is not None:
            self._publish("wheel/odometry", messages.make_odometry(stamp_ns, readings.wheels))
        if readings.charge is not None:
            charging = self._simulation.robot.charging
            state = messages.make_battery_state(stamp_ns, readings.charge, charging=charging)
            self._publish("battery_state", state)

    def _is_heard(self, topic: str) -> bool:
        if topic in self._outputs:
            return self._outputs[topic].get_subscription_count() > 0
        return topic in self._cables

    def _publish(self, topic: str, message: Any) -> None:
        self._topics[topic].last = message
        if topic in self._outputs:
            self._outputs[topic].publish(message)
        else:
            self._deliver(topic, message)


def _drop_message(_topic: str, _message: Any) -> None:
    """Have no cables."""
