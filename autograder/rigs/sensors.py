"""The rig of the QoS exam: plays the robot's hardware and listens to what becomes of each reading.

For each sensor a reading goes in on ``hardware/<sensor>``, through the student's driver node onto
the sensor's topic, through the student's consumer node, and out on ``consumer/<sensor>``. Both
ends belong to the examiner, and so does a witness that listens on the topic between them.
"""

# mypy: allow-untyped-calls
# rclpy leaves most of its functions untyped.

from __future__ import annotations

import re
import secrets
import threading
import time
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    QoSCompatibility,
    QoSProfile,
    ReliabilityPolicy,
    qos_check_compatible,
)
from rclpy.time import Time
from rclpy.topic_endpoint_info import TopicEndpointInfo
from sensor_msgs.msg import Image, Imu, LaserScan
from std_msgs.msg import String

from autograder.bench import Bench
from course import WaitTimeout

DRIVERS, CONSUMERS = "SensorDrivers", "SensorConsumers"

SETTLE = 8.0
"""Seconds that something expected may take: discovery takes 0.3 s, on a busy machine a few."""
ENDLESS = 3600 * 10**9
"""Nanoseconds: a lifespan of an hour or more is as good as none."""
AHEAD, LAG = 4, 1.0
"""Readings that may be on their way into a driver, and for how many seconds the next one waits."""
PROBE_PERIOD = 0.1
"""Seconds between two probes while endpoints find each other."""


class Tag(NamedTuple):
    """What tells readings apart: a nonce of this run, a phase of the exam, a running number."""

    nonce: int
    phase: int
    number: int

    def __str__(self) -> str:
        """Return the tag as text."""
        return f"{self.nonce}/{self.phase}/{self.number}"

    @classmethod
    def read(cls, text: str) -> Tag | None:
        """Return the tag that ``text`` is, or None."""
        found = re.fullmatch(r"(\d{1,9})/(\d{1,9})/(\d{1,9})", text)
        return cls(*map(int, found.groups())) if found else None


@dataclass(frozen=True)
class Sensor:
    """One sensor of the exercise: its topic, message type and rate (Hz), and how it is tagged."""

    name: str
    topic: str
    type: Any
    rate: float

    def message(self, tag: Tag, stamp: Time) -> Any:
        """Return a reading that carries ``tag`` and was taken at ``stamp``."""
        if self.type is String:
            return String(data=str(tag))
        message = self.type()
        message.header.frame_id = str(tag)
        message.header.stamp = stamp.to_msg()
        # A driver may well set the frame id, so the tag is in the reading itself, too.
        numbers = [float(number) for number in tag]
        if self.type is Image:
            message.data = str(tag).encode()
            message.height, message.width, message.step = 1, len(message.data), len(message.data)
            message.encoding = "mono8"
        elif self.type is LaserScan:
            message.ranges = numbers
        else:
            message.orientation.x, message.orientation.y, message.orientation.z = numbers
        return message

    def tag(self, message: Any) -> Tag | None:
        """Return the tag of a reading, or None if it is not the examiner's."""
        if self.type is String:
            return Tag.read(message.data)
        if (tag := Tag.read(message.header.frame_id)) is not None:
            return tag
        if self.type is Image:
            return Tag.read(bytes(message.data).decode(errors="replace"))
        if self.type is LaserScan:
            numbers = list(message.ranges)[:3]
        else:
            numbers = [message.orientation.x, message.orientation.y, message.orientation.z]
        return Tag.read("/".join(f"{number:.0f}" for number in numbers))

    def unchanged(self, message: Any, tag: Tag) -> bool:
        """Whether a reading is what the hardware delivered; its header is the driver's to fill."""
        delivered = self.message(tag, Time())
        if self.type is not String:
            delivered.header = message.header
        return bool(message == delivered)


SENSORS = (
    Sensor("camera", "camera/image", Image, 10),
    Sensor("lidar", "scan", LaserScan, 10),
    Sensor("imu", "imu/data", Imu, 100),
    Sensor("emergency_stop", "emergency/stop", String, 80),
)
CAMERA, LIDAR, IMU, STOP = SENSORS


def lossless(durability: DurabilityPolicy = DurabilityPolicy.VOLATILE) -> QoSProfile:
    """Return the profile of a cable: every reading, in order."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_ALL,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=durability,
    )


def undemanding() -> QoSProfile:
    """Return the profile of a reader that matches every writer and keeps all it gets."""
    return QoSProfile(history=HistoryPolicy.KEEP_ALL, reliability=ReliabilityPolicy.BEST_EFFORT)


Heard = dict[str, list[Tag]]
"""Tags in the order of their arrival, by sensor name."""


class ExaminerNode(Node):
    """The examiner's endpoints: hardware outputs, a witness a topic, and the consumers' ends."""

    def __init__(self) -> None:
        """Create what does not depend on the student; a nonce of this run tags readings."""
        self.nonce = secrets.randbelow(2**24)  # that a float32 still holds exactly
        super().__init__(
            f"examiner_{self.nonce}", start_parameter_services=False, enable_rosout=False
        )
        self._phases: dict[str, int] = {}
        self.hardware = {
            s.name: self.create_publisher(s.type, f"hardware/{s.name}", lossless()) for s in SENSORS
        }
        self.consumed: Heard = defaultdict(list)
        self.witnessed: Heard = defaultdict(list)
        self.altered: set[str] = set()  # topics with readings that the hardware did not deliver so
        self.published: dict[tuple[str, Tag], int] = {}  # when the driver did, in ns since 1970
        for sensor in SENSORS:
            self.listen(sensor, sensor.topic, undemanding(), self.witnessed)

    def listen(
        self,
        sensor: Sensor,
        topic: str,
        qos: QoSProfile,
        heard: Heard,
        on_incompatible: Callable[[Any], None] | None = None,
        on: Node | None = None,
    ) -> Any:
        """Subscribe to ``topic`` and note the tags of this run's readings in ``heard``.

        ``on`` is the node that gets the subscription, if not this one.
        """

        def keep(message: Any, info: Any) -> None:
            tag = sensor.tag(message)
            if tag is not None and tag.nonce == self.nonce:
                heard[sensor.name].append(tag)
                if not sensor.unchanged(message, tag):
                    self.altered.add(topic)
                if heard is self.witnessed:
                    self.published.setdefault((sensor.name, tag), info["source_timestamp"])

        note: Callable[..., None] = keep  # rclpy's stubs know nothing of the second argument
        # Without a handler of ours rclpy would log an incompatible profile as a warning.
        events = SubscriptionEventCallbacks(
            incompatible_qos=on_incompatible or (lambda _: None), use_default_callbacks=False
        )
        node = on or self
        return node.create_subscription(sensor.type, topic, note, qos, event_callbacks=events)

    def phase(self, name: str) -> int:
        """Return the number of a phase of the exam."""
        return self._phases.setdefault(name, len(self._phases) + 1)

    def publish(self, sensor: Sensor, phase: str, index: int) -> None:
        """Feed one reading, taken now, into a sensor's hardware."""
        tag = Tag(self.nonce, self.phase(phase), index)
        self.hardware[sensor.name].publish(sensor.message(tag, self.get_clock().now()))


class Stream:
    """Readings that come in at the sensor's rate until it is stopped or ``limit`` are out.

    No faster than the driver gets its turn: on a busy machine it would lose what it could not take.
    """

    def __init__(self, node: ExaminerNode, sensor: Sensor, phase: str, limit: int = 2**31) -> None:
        """Begin at once."""
        self.sensor = sensor
        self.sent = 0
        self._node, self._phase, self._limit = node, phase, limit
        self._since = time.monotonic()
        self._turn = threading.Lock()
        self._timer = node.create_timer(1 / sensor.rate, self._tick)

    def _tick(self) -> None:
        with self._turn:
            if self.sent < self._limit and not self._ahead():
                self._node.publish(self.sensor, self._phase, self.sent)
                self.sent += 1
                self._since = time.monotonic()

    def _ahead(self) -> bool:
        """Whether the driver has not yet come to what was sent; one that drops it is not it."""
        if time.monotonic() - self._since > LAG:
            return False
        phase = self._node.phase(self._phase)
        heard = self._node.witnessed[self.sensor.name]
        newest = heard[-1].number if heard and heard[-1].phase == phase else -1
        return self.sent - newest > AHEAD

    @contextmanager
    def held(self) -> Iterator[None]:
        """Send nothing for the length of the block."""
        with self._turn:
            limit, self._limit = self._limit, 0
        try:
            yield
        finally:
            self._limit = limit

    def stop(self) -> None:
        """Send no more."""
        self._limit = 0
        self._timer.cancel()


class SensorRig:
    """The examiner's view of one subject during the QoS exam."""

    def __init__(self, bench: Bench) -> None:
        """Bring up the examiner's endpoints on the subject's domain."""
        self.bench = bench
        self.subject = bench.subject
        self._session = bench.session
        node = bench.session.run(ExaminerNode)
        assert isinstance(node, ExaminerNode)
        self.node = node
        self._experiments = bench.memory
        self._probes = 0

    def offered(self, topic: str) -> list[TopicEndpointInfo]:
        """Return the publishers on ``topic`` that are not the examiner's."""
        return self._others(self.node.get_publishers_info_by_topic(topic))

    def requested(self, topic: str) -> list[TopicEndpointInfo]:
        """Return the subscriptions on ``topic`` that are not the examiner's."""
        return self._others(self.node.get_subscriptions_info_by_topic(topic))

    def _others(self, endpoints: list[TopicEndpointInfo]) -> list[TopicEndpointInfo]:
        return [e for e in endpoints if not e.node_name.startswith(self.node.get_name())]

    def attend(self) -> None:
        """Listen to the consumers' ends, with what they offer: lossless wherever it is possible."""
        for sensor in SENSORS:
            topic = f"consumer/{sensor.name}"
            reliable = all(
                e.qos_profile.reliability == ReliabilityPolicy.RELIABLE for e in self.offered(topic)
            )
            qos = lossless() if reliable else undemanding()
            self.node.listen(sensor, topic, qos, self.node.consumed)

    def wait(self, condition: Callable[[], Any], timeout: float = SETTLE) -> bool:
        """Wait until ``condition`` holds; return whether it did before the deadline."""
        with suppress(WaitTimeout):
            self._session.until(condition, timeout=timeout, what="an observation")
            return True
        return False

    def probe(
        self,
        sensors: Iterable[Sensor],
        heard: Heard,
        give_up: Callable[[Sensor], Any] | None = None,
    ) -> list[Sensor]:
        """Send readings until each sensor was heard from; return those that never were.

        Endpoints find each other in their own time, and what is sent before is lost: so the first
        readings are probes. ``give_up`` says that waiting for a sensor is pointless.
        """
        self._probes += 1
        phase = f"probe{self._probes}"
        silent = list(sensors)
        for _ in range(int(SETTLE / PROBE_PERIOD)):
            for sensor in silent:
                self.node.publish(sensor, phase, 0)
            self.wait(partial(self._all_heard, silent, heard, phase), PROBE_PERIOD)
            silent = self._silent(silent, heard, phase)
            if all(give_up is not None and give_up(sensor) for sensor in silent):
                break
        return silent

    def _all_heard(self, sensors: Iterable[Sensor], heard: Heard, phase: str) -> bool:
        return not self._silent(sensors, heard, phase)

    def _silent(self, sensors: Iterable[Sensor], heard: Heard, phase: str) -> list[Sensor]:
        return [sensor for sensor in sensors if not self.indices(heard, sensor, phase)]

    def withheld(self, sensors: Iterable[Sensor]) -> list[Sensor]:
        """Send one reading of each sensor; return those whose driver does not publish it by itself.

        Tried once more for these: a best-effort link may have lost it.
        """
        missing = list(sensors)
        for index in range(2):
            for sensor in missing:
                self.node.publish(sensor, "single", index)
            self.wait(partial(self._all_witnessed, missing, index), SETTLE / 2)
            missing = [s for s in missing if not self._all_witnessed([s], index)]
        return missing

    def _all_witnessed(self, sensors: Iterable[Sensor], index: int) -> bool:
        return all(index in self.witnessed(sensor, "single") for sensor in sensors)

    def burst(self, sensor: Sensor, phase: str, count: int) -> bool:
        """Send ``count`` readings; return whether the last was seen on the sensor's topic.

        No faster than the driver takes them: its queue for the hardware need not be longer.
        """
        takes = True
        for index in range(count):
            self.node.publish(sensor, phase, index)
            if takes:
                takes = self.wait(partial(self._taken, sensor, phase, index - AHEAD), LAG)
        return self.wait(partial(self._taken, sensor, phase, count - 1))

    def _taken(self, sensor: Sensor, phase: str, index: int) -> bool:
        return max(self.witnessed(sensor, phase), default=-1) >= index

    def witnessed(self, sensor: Sensor, phase: str) -> list[int]:
        """Return the indices of a phase's readings as they went over the sensor's topic."""
        return self.indices(self.node.witnessed, sensor, phase)

    def published(self, sensor: Sensor, phase: str, index: int) -> int:
        """Return when the driver published a reading, in ns since 1970; 0 if it was not seen."""
        tag = Tag(self.node.nonce, self.node.phase(phase), index)
        return self.node.published.get((sensor.name, tag), 0)

    def consumed(self, sensor: Sensor, phase: str) -> list[int]:
        """Return the indices of a phase's readings in the order the consumer passed them on."""
        return self.indices(self.node.consumed, sensor, phase)

    def indices(self, heard: Heard, sensor: Sensor, phase: str) -> list[int]:
        """Return the indices of a phase's readings in order of arrival."""
        number = self.node.phase(phase)
        return [tag.number for tag in list(heard[sensor.name]) if tag.phase == number]

    def expires(self, sensor: Sensor) -> bool:
        """Whether readings of a sensor are dropped when they get old (a lifespan is offered)."""
        lifespans = [end.qos_profile.lifespan.nanoseconds for end in self.offered(sensor.topic)]
        return any(0 < lifespan < ENDLESS for lifespan in lifespans)

    def once(self, experiment: Callable[[SensorRig], Any]) -> Any:
        """Run an experiment that several checks read, once a sitting."""
        name = experiment.__name__
        if name not in self._experiments:
            self._experiments[name] = experiment(self)
        return self._experiments[name]


@contextmanager
def sensor_rig(bench: Bench) -> Iterator[SensorRig]:
    """Give a rig, and take the examiner's endpoints down afterwards."""
    rig = SensorRig(bench)
    try:
        yield rig
    finally:
        bench.session.stop(rig.node)


def mismatch(offered: TopicEndpointInfo, requested: TopicEndpointInfo) -> str:
    """Return why DDS refuses to connect two endpoints, or an empty string.

    Only an ERROR is a refusal: rmw reports a WARNING for two default profiles, too.
    """
    compatibility, reason = qos_check_compatible(offered.qos_profile, requested.qos_profile)
    if compatibility != QoSCompatibility.ERROR:
        return ""
    parts = (part.strip().removeprefix("ERROR: ") for part in str(reason).split(";"))
    return f"{'; '.join(part for part in parts if part)}."
