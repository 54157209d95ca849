"""The ROS 2 node of a world: what the robot's drivers would publish, hear and serve."""

from __future__ import annotations

import functools
from collections.abc import Collection, Iterable
from typing import Any

from geometry_msgs.msg import PoseArray, Twist
from nav_msgs.msg import Odometry, Path
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import BatteryState, Image, Imu, LaserScan
from std_msgs.msg import Bool, String
from std_srvs.srv import Trigger

from course.worlds import messages
from course.worlds.interfaces.gripper_service import GripperService
from course.worlds.interfaces.line_drive import LineDrive
from course.worlds.interfaces.navigator import Navigator
from course.worlds.interfaces.ports import Deliver, Ports
from course.worlds.pacing import PacedSimulation
from course.worlds.robot.base import STEP_S
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


class WorldNode(Node):
    """Moves a paced simulation on, publishes its readings, and passes commands to it."""

    def __init__(self, name: str, paced: PacedSimulation) -> None:
        """Make the node; the world begins with `paced.start`."""
        super().__init__(name)
        self._paced = paced
        self._simulation = paced.simulation
        self._ports = ports = Ports(self, paced, self.advance)
        for topic, msg_type, qos, rate in _OUTPUTS:
            ports.advertise(topic, msg_type, qos, rate)
        ports.listen(Twist, "cmd_vel", self._on_command)
        ports.listen(Path, "plan", self._on_path)
        ports.listen(PoseArray, "obstacles", self._on_found)
        self.create_service(Trigger, "world/reset", self._on_reset)
        self._gripper = GripperService(ports)
        offered = self._simulation.plan.interfaces
        self._line = LineDrive(ports) if "line" in offered else None
        self._navigator = Navigator(ports) if "navigator" in offered else None
        if "limits" in offered:
            ports.listen(Twist, "wheels/limits", self._on_limits)
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
        if self._ports.has_radio:  # else they wait until it is back
            for kind, value in self._simulation.take_events():
                self._ports.publish_value(_EVENTS[kind], value)

    def reset(self) -> None:
        """Put everything back to where it was; a call of the gripper that waits is not answered."""
        with self._paced.lock:
            self.advance()
            self._simulation.reset()
            self._gripper.reset()
            if self._navigator is not None:
                self._navigator.reset()
            self.publish_events()

    def hand_over(self, deliver: Deliver, cables: Collection[str], motors: str) -> None:
        """Leave the robot's topics to other nodes, which have its cables from now on.

        Args:
            deliver: gets what the world would publish.
            cables: the topics whose messages are worth making; looked at each time.
            motors: the topic that its motors hear, instead of ``cmd_vel``.
        """
        assert self.executor is not None
        with self.executor.hold_still(), self._paced.lock:  # type: ignore[attr-defined]
            self._ports.hand_over(deliver, cables)
            self._ports.listen(Twist, motors, self._on_command)

    def describe_topics(self) -> list[dict[str, Any]]:
        """Return name, type, rate (Hz, 0 for what comes now and then) and last message of each."""
        return self._ports.describe()

    # Inside.

    def _on_command(self, message: Twist) -> None:
        self._simulation.drive(message.linear.x, message.angular.z)

    def _on_limits(self, message: Twist) -> None:
        self._simulation.limit_speeds(message.linear.x, message.angular.z)

    def _on_path(self, message: Path) -> None:
        positions = [pose.pose.position for pose in message.poses]
        self._simulation.show_path([(point.x, point.y) for point in positions])

    def _on_found(self, message: PoseArray) -> None:
        positions = [pose.position for pose in message.poses]
        self._simulation.show_found([(point.x, point.y) for point in positions])

    def _on_reset(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self.reset()
        response.success, response.message = True, "The world is as at first."
        return response

    def _publish_steps(self, steps: Iterable[tuple[int, Readings]]) -> None:
        for stamp_ns, readings in steps:
            if self._ports.has_radio:
                self._publish_readings(stamp_ns, readings)
            self.publish_events()
            self._gripper.after_step()
            if self._navigator is not None:
                self._navigator.after_step()

    def _publish_readings(self, stamp_ns: int, readings: Readings) -> None:
        ports = self._ports
        ports.publish_if_heard(
            "imu/data", functools.partial(messages.make_imu, stamp_ns, readings.imu)
        )
        if readings.scan is not None:
            period_s = SCAN_STEPS * STEP_S
            ports.publish("scan", messages.make_scan(stamp_ns, readings.scan, period_s))
        if readings.picture_due and ports.is_heard("camera/image"):
            picture = self._simulation.render_picture()
            ports.publish("camera/image", messages.make_image(stamp_ns, picture))
        if readings.wheels is not None:
            ports.publish("wheel/odometry", messages.make_odometry(stamp_ns, readings.wheels))
        if readings.charge is not None:
            self._publish_every_second(stamp_ns, readings.charge)
        if self._line is not None:
            self._line.publish_readings(readings)

    def _publish_every_second(self, stamp_ns: int, charge: float) -> None:
        robot = self._simulation.robot
        state = messages.make_battery_state(stamp_ns, charge, charging=robot.charging)
        self._ports.publish("battery_state", state)
        if robot.jammed:  # again, as a node that has come since need not ask for a latched one
            self._ports.publish_value("hardware/jammed", True)
