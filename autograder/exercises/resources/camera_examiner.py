"""The examiner's own node of the resources exam: its endpoints, and the pictures that it got."""

from __future__ import annotations

import re
import secrets
from typing import Any, NamedTuple

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Image
from std_msgs.msg import Int32

from autograder.observe.publication_times import published_at
from autograder.observe.quiet_node import QuietNode

IMAGE, ZOOM, SNAPSHOT = "camera/image", "camera/zoom", "camera/snapshot"


class Picture(NamedTuple):
    """What a picture's pixels say: its device, its number since the device was opened, its zoom.

    And when it was published, in ns of this machine's time of day.
    """

    device: str
    number: int
    zoom: int
    published: int


def _parse_picture(message: Any, published: int) -> Picture | None:
    label = bytes(message.data[:200]).split(b"\n")[0].decode(errors="replace")
    found = re.fullmatch(r"([\w-]{1,100}) (\d{1,9}) (\d{1,3})", label)
    return Picture(found[1], int(found[2]), int(found[3]), published) if found else None


class ExaminerNode(QuietNode):
    """The examiner's endpoints, and the pictures that its two readers got, in order of arrival.

    A driver may offer either reliability, or have two publishers: only the best-effort reader then
    hears both, while the reliable one loses none.
    """

    def __init__(self) -> None:
        """Listen on the image topic, whichever reliability is offered."""
        super().__init__(f"examiner_{secrets.token_hex(4)}")
        self._pictures: dict[tuple[int, str, int, int], Picture] = {}
        self._strange: set[int] = set()
        self.settled = 0  # see `published_at`
        for reliability in (ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT):
            qos = QoSProfile(history=HistoryPolicy.KEEP_ALL, reliability=reliability)
            self.create_subscription(Image, IMAGE, self._note_picture, qos)
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.zoom = self.create_publisher(Int32, ZOOM, latched)

    def _note_picture(self, message: Any, info: dict[str, int]) -> None:
        # By the writer's stamp it is known when the other reader gets it, too.
        stamp = info["source_timestamp"]
        if (picture := _parse_picture(message, published_at(info, self.settled))) is None:
            self._strange.add(stamp)
        else:
            self._pictures.setdefault((stamp, *picture[:3]), picture)

    def pictures_of(self, device: str) -> list[Picture]:
        """Return the pictures of ``device``; later calls return them first, and then newer ones."""
        return [picture for picture in list(self._pictures.values()) if picture.device == device]

    def count_strange(self) -> int:
        """Return how many images came that are not a camera's."""
        return len(self._strange)
