"""The readings of the QoS exam: four sensors, and the marks by which their readings are known.

A mark stands in several places of a reading: a driver may set the header, and a consumer may change
it, and clean the content, before it hands on what it acts on. Every other scan has beams that hit
nothing, or failed, as nearly every scan in a warehouse.
"""

from __future__ import annotations

import math
import re
import secrets
from dataclasses import dataclass
from typing import Any, NamedTuple

from sensor_msgs.msg import Image, Imu, LaserScan
from std_msgs.msg import String

FAR_M = 2.0**30
"""The range of the LIDAR: what is cleaned by it still has the numbers of its mark."""
OPEN, CLOSED = (math.inf, math.nan), (1.0, 1.0)
"""The last two ranges of a scan in metres: two beams that have no echo, or have one."""


class Mark(NamedTuple):
    """Three numbers that a reading bears: one of this run, and two that nobody can foresee.

    Whoever could tell from them what comes next, or what came before, could make it up.
    """

    run: int
    first: int
    second: int

    @classmethod
    def draw(cls, run: int) -> Mark:
        """Return a new one."""
        return cls(run, secrets.randbelow(10**4), secrets.randbelow(10**5))

    def __str__(self) -> str:
        """Return it as text of 19 characters.

        After a frame of that length DDS needs no bytes to fill a gap before what comes next, of
        which nobody knows what they hold: so readings that are equal are equal when serialized.
        """
        return f"{self.run:08}/{self.first:04}/{self.second:05}"

    @classmethod
    def from_text(cls, text: str) -> Mark | None:
        """Return the mark that ``text`` is, or None."""
        found = re.fullmatch(r"(\d{1,9})/(\d{1,9})/(\d{1,9})", text)
        return cls(*map(int, found.groups())) if found else None


@dataclass(frozen=True)
class Sensor:
    """One sensor of the exercise: its topic and type, and how many readings a second it has.

    ``most`` is how many of its last readings a consumer may go on with after a pause.
    """

    name: str
    topic: str
    type: Any
    rate_hz: float
    most: int

    @property
    def hardware(self) -> str:
        """The topic that its readings come in on."""
        return f"hardware/{self.name}"

    @property
    def output(self) -> str:
        """The topic on which the consumer hands on what it acts on."""
        return f"consumer/{self.name}"

    def make_message(self, mark: Mark, stamp_ns: int, *, is_open: bool = False) -> Any:
        """Return a reading that bears a mark; ``is_open``: with beams that have no echo."""
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
            message.ranges = [*numbers, *(OPEN if is_open else CLOSED)]
            message.intensities = [*numbers, 0.0, 0.0]
        else:
            for vector in _imu_vectors(message):
                vector.x, vector.y, vector.z = numbers
        return message

    def find_marks(self, message: Any) -> list[Mark]:
        """Return all that looks like a mark; what was cleaned may, too."""
        if self.type is String:
            places = [message.data]
        elif self.type is Image:
            places = [message.header.frame_id, bytes(message.data).decode(errors="replace")]
        else:
            if self.type is LaserScan:
                threes = [list(message.ranges)[:3], list(message.intensities)[:3]]
            else:
                threes = [[vector.x, vector.y, vector.z] for vector in _imu_vectors(message)]
            numbers = ["/".join(f"{number:.0f}" for number in three) for three in threes]
            places = [message.header.frame_id, *numbers]
        return [mark for place in places if (mark := Mark.from_text(place))]

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
    Sensor("imu", "imu/data", Imu, 100, most=50),  # 0.5 s
    Sensor("emergency_stop", "emergency/stop", String, 80, most=100),
)
CAMERA, LIDAR, IMU, STOP = SENSORS
