"""The readings of the QoS exam: four sensors, and the tags by which their readings are told apart.

A tag stands in several places of a reading: a driver may set the header, and a consumer may change
it, and clean the content, before it hands on what it acts on. Every other scan has beams that hit
nothing, or failed, as nearly every scan in a warehouse.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Any, NamedTuple

from sensor_msgs.msg import Image, Imu, LaserScan
from std_msgs.msg import String

FAR = 2.0**30
"""The range of the LIDAR: what is cleaned by it still has the numbers of its tag."""


OPEN, CLOSED = (math.inf, math.nan), (1.0, 1.0)
"""The last two ranges of a scan in metres: two beams that have no echo, or have one."""


def is_open(number: int) -> bool:
    """Whether the scan of that number has beams without an echo."""
    return number % 2 == 1


class Tag(NamedTuple):
    """What tells readings apart: a nonce of this run, a phase of the exam, a running number.

    Readings bear others in its place, from which nobody can tell phase and number (`ExaminerNode`).
    """

    nonce: int
    phase: int
    number: int

    def __str__(self) -> str:
        """Return the tag as text of 19 characters, as a rule.

        After a frame of that length DDS needs no bytes to fill a gap before what comes next, of
        which nobody knows what they hold: so readings that are equal are equal when serialized.
        """
        return f"{self.nonce:08}/{self.phase:04}/{self.number:05}"

    @classmethod
    def from_text(cls, text: str) -> Tag | None:
        """Return the tag that ``text`` is, or None."""
        found = re.fullmatch(r"(\d{1,9})/(\d{1,9})/(\d{1,9})", text)
        return cls(*map(int, found.groups())) if found else None


@dataclass(frozen=True)
class Sensor:
    """One sensor of the exercise: its topic, message type and rate (Hz), and how it is tagged.

    ``most`` is how many of its last readings a consumer may go on with after a pause.
    """

    name: str
    topic: str
    type: Any
    rate: float
    most: int

    def make_message(self, tag: Tag, stamp: int = 0) -> Any:
        """Return a reading that carries ``tag`` and was taken at ``stamp`` (ns since 1970)."""
        return self.fill_message(self.type(), tag, stamp)

    def fill_message(self, message: Any, tag: Tag, stamp: int) -> Any:
        """Make a reading, new or filled before, one that carries ``tag``; return it.

        To make a message takes longer than to fill it.
        """
        if self.type is String:
            message.data = str(tag)
            return message
        header = message.header
        header.frame_id = str(tag)
        header.stamp.sec, header.stamp.nanosec = divmod(stamp, 10**9)
        numbers = [float(number) for number in tag]
        if self.type is Image:
            message.data = str(tag).encode()
            message.height, message.width, message.step = 1, len(message.data), len(message.data)
            message.encoding = "mono8"
        elif self.type is LaserScan:
            message.angle_min, message.angle_max, message.angle_increment = -0.5, 1.5, 0.5
            message.range_min, message.range_max = 0.0, FAR
            message.ranges = [*numbers, *(OPEN if is_open(tag.number) else CLOSED)]
            message.intensities = [*numbers, 0.0, 0.0]
        else:
            for vector in _imu_vectors(message):
                vector.x, vector.y, vector.z = numbers
        return message

    def find_tags(self, message: Any) -> list[Tag]:
        """Return all that looks like a tag of a reading.

        What was cleaned may do so, too: a rotation that was brought to length 1, say.
        """
        return list(filter(None, map(Tag.from_text, self._tag_places(message))))

    def _tag_places(self, message: Any) -> list[str]:
        """Return what stands where a tag may stand."""
        if self.type is String:
            return [message.data]
        header = str(message.header.frame_id)
        if self.type is Image:
            return [header, bytes(message.data).decode(errors="replace")]
        if self.type is LaserScan:
            threes = [list(message.ranges)[:3], list(message.intensities)[:3]]
        else:
            threes = [[vector.x, vector.y, vector.z] for vector in _imu_vectors(message)]
        return [header, *("/".join(f"{number:.0f}" for number in three) for three in threes)]

    def is_blank(self, message: Any) -> bool:
        """Whether nothing is left of a reading but its header."""
        nothing = self.type()
        if self.type is not String:
            nothing.header = message.header
        return bool(message == nothing)

    def is_unchanged(self, message: Any, tag: Tag) -> bool:
        """Whether a reading is what the hardware delivered; its header is the driver's to fill."""
        delivered = self.make_message(tag)
        if self.type is not String:
            delivered.header = message.header
        if message == delivered:
            return True
        # A range that is not a number does not equal itself.
        return self.type is LaserScan and repr(message) == repr(delivered)


def _imu_vectors(imu: Imu) -> tuple[Any, Any, Any]:
    return imu.orientation, imu.angular_velocity, imu.linear_acceleration


SENSORS = (
    Sensor("camera", "camera/image", Image, 10, most=10),  # 1 s
    Sensor("lidar", "scan", LaserScan, 10, most=5),  # 0.5 s
    Sensor("imu", "imu/data", Imu, 100, most=50),  # 0.5 s
    Sensor("emergency_stop", "emergency/stop", String, 80, most=100),
)
CAMERA, LIDAR, IMU, STOP = SENSORS

Heard = dict[str, list[Tag]]
"""Tags in the order of their arrival, by sensor name."""
