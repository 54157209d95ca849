"""The examiner's endpoints of the pattern exam: the robot's hardware, and listeners."""

from __future__ import annotations

import secrets
from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import BatteryState, Image
from std_msgs.msg import Float64

from autograder.exercises.patterns.merged_subscriptions import Ears
from autograder.observe.publication_times import published_at
from autograder.observe.quiet_node import QuietNode

T = TypeVar("T")


class Picture(NamedTuple):
    """What is kept of a picture: when it was published (ns), and what its fields say.

    Not its pixels: a camera of 640 x 480 sends nearly 10 MB a second. ``number`` is the writer's
    count, which goes on where a picture is lost on the way; 0 if the middleware has none.
    """

    published: int
    number: int
    height: int
    width: int
    step: int
    size: int  # bytes


class ExaminerNode(QuietNode):
    """The examiner's endpoints: the hardware, and listeners on what the robot tells everybody."""

    def __init__(self) -> None:
        """Create what does not depend on the student."""
        super().__init__(f"examiner_{secrets.randbelow(2**24)}")
        # It serves every subscription, and one that asks for the last value gets it.
        qos = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.hardware = {
            what: self.create_publisher(Float64, f"hardware/{what}", qos)
            for what in ("position", "charge")
        }
        self.speeds = Ears[float]()
        self.levels = Ears[float]()
        self.pictures = Ears[Picture]()
        self._listen_twice(Float64, "hardware/speed", self.speeds, lambda msg, _: msg.data)
        self._listen_twice(
            BatteryState, "robot/battery", self.levels, lambda msg, _: msg.percentage
        )
        self._listen_twice(Image, "robot/camera", self.pictures, _make_picture)

    def _listen_twice(
        self, msg_type: Any, topic: str, ears: Ears[T], value: Callable[..., T]
    ) -> None:
        """Listen with two subscriptions; ``value`` says what is kept of a message and its info."""

        def note(message: Any, info: dict[str, Any]) -> None:
            ears.add_message(
                published_at(info), value(message, info), int(info["source_timestamp"])
            )

        for reliable in (False, True):
            self.listen(msg_type, topic, note, reliable=reliable)

    def listen(
        self,
        msg_type: Any,
        topic: str,
        heard: Callable[..., None],
        *,
        durable: bool = False,
        reliable: bool = False,
    ) -> Any:
        """Subscribe so that every writer matches (every durable, reliable one), and keep all."""
        lossless = durable or reliable
        qos = QoSProfile(
            history=HistoryPolicy.KEEP_ALL,
            reliability=ReliabilityPolicy.RELIABLE if lossless else ReliabilityPolicy.BEST_EFFORT,
            durability=DurabilityPolicy.TRANSIENT_LOCAL if durable else DurabilityPolicy.VOLATILE,
        )
        return self.create_subscription(msg_type, topic, heard, qos)


def _make_picture(image: Image, info: dict[str, Any]) -> Picture:
    published, number = published_at(info), int(info["publication_sequence_number"] or 0)
    return Picture(published, number, image.height, image.width, image.step, len(image.data))
