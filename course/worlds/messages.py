"""Readings as ROS messages, in units and frames of REP 103 and REP 105; and messages in words."""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable
from typing import Any

import numpy as np
from geometry_msgs.msg import Quaternion
from nav_msgs.msg import Odometry
from numpy.typing import NDArray
from sensor_msgs.msg import BatteryState, Image, Imu, LaserScan

from course.messages.values import to_data
from course.messages.yaml_text import format_count, one_line
from course.worlds.robot.camera import HEIGHT, WIDTH
from course.worlds.robot.lidar import BEAMS, RANGE_MAX_M, RANGE_MIN_M
from course.worlds.robot.motion import (
    ACCELERATION_NOISE_MPS2,
    TURN_NOISE_RADPS,
    ImuReading,
    WheelReading,
)

ODOM, BASE, CAMERA = "odom", "base_link", "camera_optical"
"""Frames: the LIDAR and the IMU are in the robot's middle, so their frame is the base's."""

_NS = 1_000_000_000
_STEP_RAD = 2 * math.pi / BEAMS
_MAX_CHARS = 80
_VOLTS_EMPTY, _VOLTS_FULL = 21.0, 25.2  # of six lithium cells


def make_scan(stamp_ns: int, ranges: NDArray[np.float32], period_s: float) -> LaserScan:
    """Return a scan; all its beams are of the same moment."""
    message = _stamped(LaserScan(), stamp_ns, BASE)
    message.angle_max = (BEAMS - 1) * _STEP_RAD  # angle_min is 0: straight ahead
    message.angle_increment = _STEP_RAD
    message.scan_time = period_s
    message.range_min, message.range_max = RANGE_MIN_M, RANGE_MAX_M
    message.ranges = array("f", ranges.tobytes())
    return message


def make_image(stamp_ns: int, pixels: NDArray[np.uint8]) -> Image:
    """Return a picture, encoded as rgb8."""
    message = _stamped(Image(), stamp_ns, CAMERA)
    message.height, message.width, message.step = HEIGHT, WIDTH, 3 * WIDTH
    message.encoding = "rgb8"
    message.data = array("B", pixels.tobytes())
    return message


def make_imu(stamp_ns: int, reading: ImuReading) -> Imu:
    """Return what the IMU reads; it knows no orientation, which -1 in the covariance says."""
    message = _stamped(Imu(), stamp_ns, BASE)
    message.orientation_covariance[0] = -1.0
    message.angular_velocity.z = reading.turn
    message.angular_velocity_covariance[8] = TURN_NOISE_RADPS**2
    acceleration = message.linear_acceleration
    acceleration.x, acceleration.y, acceleration.z = reading.forward, reading.left, reading.up
    message.linear_acceleration_covariance[0::4] = ACCELERATION_NOISE_MPS2**2
    return message


def make_odometry(stamp_ns: int, reading: WheelReading) -> Odometry:
    """Return where the wheels say that the robot is, and how fast it goes."""
    message = _stamped(Odometry(), stamp_ns, ODOM)
    message.child_frame_id = BASE
    pose, twist = message.pose.pose, message.twist.twist
    pose.position.x, pose.position.y = reading.x, reading.y
    pose.orientation = Quaternion(z=math.sin(reading.yaw / 2), w=math.cos(reading.yaw / 2))
    twist.linear.x, twist.angular.z = reading.speed, reading.turn
    return message


def make_battery_state(stamp_ns: int, charge: float, *, charging: bool) -> BatteryState:
    """Return the state of the battery; ``charge`` is 0 to 1."""
    message = _stamped(BatteryState(), stamp_ns, BASE)
    message.percentage = charge
    message.voltage = _VOLTS_EMPTY + charge * (_VOLTS_FULL - _VOLTS_EMPTY)
    message.current = message.charge = message.capacity = message.design_capacity = math.nan
    message.power_supply_status = (
        BatteryState.POWER_SUPPLY_STATUS_CHARGING
        if charging
        else BatteryState.POWER_SUPPLY_STATUS_DISCHARGING
    )
    message.power_supply_technology = BatteryState.POWER_SUPPLY_TECHNOLOGY_LION
    message.present = True
    return message


def _stamped(message: Any, stamp_ns: int, frame: str) -> Any:
    stamp = message.header.stamp
    stamp.sec, stamp.nanosec = divmod(stamp_ns, _NS)
    message.header.frame_id = frame
    return message


def type_name(msg_type: Any) -> str:
    """Return a message class's name as ROS spells it.

    >>> type_name(Twist)
    'geometry_msgs/msg/Twist'
    """
    return f"{msg_type.__module__.split('.')[0]}/msg/{msg_type.__name__}"


def describe_message(message: Any) -> str:
    """Return the gist of a message, at most 80 characters."""
    describe: Callable[[Any], str] = _TEXTS.get(type(message).__name__, _describe_fields)
    return describe(message)[:_MAX_CHARS]


def _describe_fields(message: Any) -> str:
    return one_line(to_data(message))


def _describe_scan(message: Any) -> str:
    seen = [metres for metres in message.ranges if math.isfinite(metres)]
    ahead = message.ranges[0] if message.ranges else math.inf
    return f"ahead {_metres(ahead)}, nearest {_metres(min(seen, default=math.inf))}"


def _metres(value: float) -> str:
    return f"{value:.2f} m" if math.isfinite(value) else "nothing"


def _describe_imu(message: Any) -> str:
    forward, turn = message.linear_acceleration.x, message.angular_velocity.z
    return f"{forward:.2f} m/s² forward, {turn:.2f} rad/s"


def _describe_odometry(message: Any) -> str:
    position, twist = message.pose.pose.position, message.twist.twist
    return (
        f"at ({position.x:.2f}, {position.y:.2f}) m, {twist.linear.x:.2f} m/s, "
        f"{twist.angular.z:.2f} rad/s"
    )


_TEXTS = {
    "LaserScan": _describe_scan,
    "Imu": _describe_imu,
    "Odometry": _describe_odometry,
    "Image": lambda message: f"{message.width}x{message.height} pixels, {message.encoding}",
    "BatteryState": lambda message: f"{message.percentage:.1%} left",
    "Twist": lambda message: f"{message.linear.x:.2f} m/s, {message.angular.z:.2f} rad/s",
    "String": lambda message: repr(message.data),
    "Bool": lambda message: str(message.data).lower(),
    "Float64": lambda message: f"{message.data:.2f}",
    "Path": lambda message: format_count(len(message.poses), "pose"),
    "PoseArray": lambda message: format_count(len(message.poses), "obstacle"),
}
