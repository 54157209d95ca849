"""The examiner's own node of the resources exam: its endpoints, and the pictures that it got."""

from __future__ import annotations

import re
from typing import Any, NamedTuple

from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import Image
from std_msgs.msg import Int32

from autograder.observe.examiner.lossless_listener import LosslessListener, Published
from autograder.observe.nouns import Topic

IMAGE, ZOOM, SNAPSHOT = "camera/image", "camera/zoom", "camera/snapshot"


class Picture(NamedTuple):
    """What a picture's pixels say: its device, its number since the device was opened, its zoom."""

    device: str
    number: int
    zoom: int


def read_picture(message: Any) -> Picture | None:
    """Return what an image says, or None if no camera has taken it."""
    label = bytes(message.data[:200]).split(b"\n")[0].decode(errors="replace")
    found = re.fullmatch(r"([\w-]{1,100}) (\d{1,9}) (\d{1,3})", label)
    return Picture(found[1], int(found[2]), int(found[3])) if found else None


class ExaminerNode(LosslessListener):
    """The examiner's endpoints, and the pictures that came."""

    def __init__(self) -> None:
        """Listen to the pictures, and offer zooms also to whoever comes later."""
        super().__init__(Topic(IMAGE, Image, read_picture))
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.zoom = self.create_publisher(Int32, ZOOM, latched)

    def pictures_of(self, device: str) -> list[Published]:
        """Return the pictures of ``device``, in order of arrival."""
        return [picture for picture in self.heard() if picture.value.device == device]
