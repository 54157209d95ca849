"""The readings of the QoS exam: four sensors, and the marks by which their readings are known.

A mark stands in several places of a reading: a driver may set the header, and a consumer may change
it, and clean the content, before it hands on what it acts on. Every other scan has beams that hit
nothing, or failed, as nearly every scan in a warehouse.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from sensor_msgs.msg import Image, Imu, LaserScan
from std_msgs.msg import String

from autograder.observe.relays.marked_messages import Mark
from autograder.observe.relays.observed_relays import ObservedRelays

FAR_M = 2.0**30
"""The range of the LIDAR: what is cleaned by it still has the numbers of its mark."""
OPEN, CLOSED = (math.inf, math.nan), (1.0, 1.0)
"""The last two ranges of a scan in metres: two beams that have no echo, or have one."""


@dataclass(frozen=True)
class Sensor:
    """One sensor of the exercise: see `autograder.observe.relays.marked_messages`."""

    name: str
    topic: str
    type: Any
    rate_hz: float
    most: int
    ahead: int = 4
    probes: int = 1
    noun: str = "reading"

    def __str__(self) -> str:
        """Return its name."""
        return self.name

    @property
    def source(self) -> str:
        """The topic that its readings come in on."""
        return f"hardware/{self.name}"

    @property
    def output(self) -> str:
        """The topic on which the consumer hands on what it acts on."""
        return f"consumer/{self.name}"

    def make_message(self, mark: Mark, stamp_ns: int, number: int) -> Any:
        """Return a reading that bears a mark and a stamp."""
        message = self.type()
        if self.type is String:
            message.data = str(mark)
            return message
        message.header.frame_id = str(mark)
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp_ns, 10**9)
        numbers = [float(number) for number in mark]
        if self.type is Image:
            message.data = str(mark).encode()
            message.height, message.width, message.step = 1, len(message.data), len(message.data)
            message.encoding = "mono8"
        elif self.type is LaserScan:
            message.angle_min, message.angle_max, message.angle_increment = -0.5, 1.5, 0.5
            message.range_min, message.range_max = 0.0, FAR_M
            message.ranges = [*numbers, *(OPEN if number % 2 else CLOSED)]
            message.intensities = [*numbers, 0.0, 0.0]
        else:
            for vector in _imu_vectors(message):
                vector.x, vector.y, vector.z = numbers
        return message

    def find_marks(self, message: Any) -> list[Mark | None]:
        """Return what stands in each place where a mark may stand."""
        if self.type is String:
            return [Mark.from_text(message.data)]
        frame = Mark.from_text(message.header.frame_id)
        if self.type is Image:
            return [frame, Mark.from_text(bytes(message.data).decode(errors="replace"))]
        if self.type is LaserScan:
            threes = [list(message.ranges)[:3], list(message.intensities)[:3]]
        else:
            threes = [[vector.x, vector.y, vector.z] for vector in _imu_vectors(message)]
        return [frame, *map(Mark.from_numbers, threes)]

    def is_same(self, message: Any, other: Any) -> bool:
        """Whether two readings are the same but for the header, which is the driver's to fill."""
        if self.type is not String:
            message.header = other.header
        # A range that is not a number does not equal itself.
        return bool(message == other) or (self.type is LaserScan and repr(message) == repr(other))


def _imu_vectors(imu: Imu) -> tuple[Any, Any, Any]:
    return imu.orientation, imu.angular_velocity, imu.linear_acceleration


SENSORS = (
    Sensor("camera", "camera/image", Image, 10, most=10),  # 1 s
    Sensor("lidar", "scan", LaserScan, 10, most=5),  # 0.5 s
    Sensor("imu", "imu/data", Imu, 100, most=50, probes=5),  # 0.5 s
    Sensor("emergency_stop", "emergency/stop", String, 80, most=100, ahead=1),  # none may get lost
)
CAMERA, LIDAR, IMU, STOP = SENSORS

DRIVERS, CONSUMERS = "SensorDrivers", "SensorConsumers"
SensorRig = ObservedRelays[Sensor]
