"""What the robot feels of its own motion: the IMU's reading, and that of the wheels."""

from __future__ import annotations

from dataclasses import dataclass

from numpy.random import Generator

from course.worlds.robot.base import Robot

GRAVITY_MPS2 = 9.80665
ACCELERATION_NOISE_MPS2 = 0.05
"""Standard deviation of a reading of acceleration."""

TURN_NOISE_RADPS = 0.005
"""Standard deviation of a reading of the turn rate."""

_MOST_MPS2 = 4 * GRAVITY_MPS2  # what the sensor can tell: a bump is more


@dataclass(frozen=True)
class ImuReading:
    """Acceleration along the robot's x, y and z in m/s², gravity included, and rad/s about z."""

    forward: float
    left: float
    up: float
    turn: float


@dataclass(frozen=True)
class WheelReading:
    """Where the wheels say that the robot is (m, rad), and how fast they turn (m/s, rad/s)."""

    x: float
    y: float
    yaw: float
    speed: float
    turn: float


def read_imu(robot: Robot, noise: Generator) -> ImuReading:
    """Return what the IMU reads now."""
    forward, left, up, turn = noise.standard_normal(4).tolist()
    ahead = min(max(robot.acceleration, -_MOST_MPS2), _MOST_MPS2)
    return ImuReading(
        ahead + ACCELERATION_NOISE_MPS2 * forward,
        robot.speed * robot.turn + ACCELERATION_NOISE_MPS2 * left,
        GRAVITY_MPS2 + ACCELERATION_NOISE_MPS2 * up,
        robot.turn + TURN_NOISE_RADPS * turn,
    )


def read_wheels(robot: Robot) -> WheelReading:
    """Return what the wheels' encoders say."""
    return WheelReading(robot.wheel_x, robot.wheel_y, robot.wheel_yaw, robot.speed, robot.turn)
