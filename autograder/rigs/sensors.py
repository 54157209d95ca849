"""The rig of the QoS exam: plays the robot's hardware and listens to what becomes of each reading.

For each sensor a reading goes in on ``hardware/<sensor>``, through the student's driver node onto
the sensor's topic, through the student's consumer node, and out on ``consumer/<sensor>``. Both
ends belong to the examiner, and so does a witness that listens on the topic between them.
"""

# mypy: allow-untyped-calls
# rclpy leaves most of its functions untyped.

from __future__ import annotations

import secrets
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

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
"""Nanoseconds: a lifespan of an hour or more changes nothing in an exam of seconds."""
PROBE_PERIOD = 0.1
"""Seconds between two probes while endpoints find each other."""


@dataclass(frozen=True)
class Sensor:
    """One sensor of the exercise: its topic, message type and rate (Hz), and how it is tagged."""

    name: str
    topic: str
    type: Any
    rate: float

    def message(self, tag: str, stamp: Time) -> Any:
        """Return a reading that carries ``tag`` and was taken at ``stamp``."""
        if self.type is String:
            return String(data=tag)
        message = self.type()
        message.header.frame_id = tag
        message.header.stamp = stamp.to_msg()
        return message

    def tag(self, message: Any) -> str:
        """Return the tag of a reading."""
        return str(message.data if self.type is String else message.header.frame_id)


SENSORS = (
    Sensor("camera", "camera/image", Image, 10),
    Sensor("lidar", "scan", LaserScan, 10),
    Sensor("imu", "imu/data", Imu, 100),
    Sensor("emergency_stop", "emergency/stop", String, 100),
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


Heard = dict[str, list[str]]
"""Tags in the order of their arrival, by sensor name."""


class ExaminerNode(Node):
    """The examiner's endpoints: hardware outputs, a witness a topic, and the consumers' ends."""

    def __init__(self) -> None:
        """Create what does not depend on the student; a nonce of this run tags readings."""
        self.nonce = secrets.token_hex(4)
        super().__init__(
            f"examiner_{self.nonce}", start_parameter_services=False, enable_rosout=False
        )
        self.hardware = {
            s.name: self.create_publisher(s.type, f"hardware/{s.name}", lossless()) for s in SENSORS
        }
        self.consumed: Heard = defaultdict(list)
        self.witnessed: Heard = defaultdict(list)
        for sensor in SENSORS:
            self.listen(sensor, sensor.topic, undemanding(), self.witnessed)

    def listen(
        self,
        sensor: Sensor,
        topic: str,
        qos: QoSProfile,
        heard: Heard,
        on_incompatible: Callable[[Any], None] | None = None,
    ) -> Any:
        """Subscribe to ``topic`` and note the tags of this run's readings in ``heard``."""

        def note(message: Any) -> None:
            nonce, _, tag = sensor.tag(message).partition("/")
            if nonce == self.nonce:
                heard[sensor.name].append(tag)

        # Without a handler of ours rclpy would log an incompatible profile as a warning.
        events = SubscriptionEventCallbacks(
            incompatible_qos=on_incompatible or (lambda _: None), use_default_callbacks=False
        )
        return self.create_subscription(sensor.type, topic, note, qos, event_callbacks=events)

    def send(self, sensor: Sensor, phase: str, count: int = 1) -> None:
        """Feed ``count`` readings, tagged ``phase/0`` onwards, into a sensor's hardware.

        They come at once, but are stamped as at the sensor's rate, the last one now: a consumer
        may judge a reading by its age.
        """
        now = self.get_clock().now()
        for index in range(count):
            age = int((count - 1 - index) / sensor.rate * 1e9)
            stamp = Time(nanoseconds=now.nanoseconds - age, clock_type=now.clock_type)
            self._publish(sensor, f"{phase}/{index}", stamp)

    def stream(self, sensor: Sensor, phase: str, count: int) -> Callable[[], bool]:
        """Feed ``count`` readings at the sensor's rate; return what tells whether all are out."""
        sent: list[int] = []

        def tick() -> None:
            if len(sent) < count:
                self._publish(sensor, f"{phase}/{len(sent)}", self.get_clock().now())
                sent.append(1)
            else:
                timer.cancel()

        timer = self.create_timer(1 / sensor.rate, tick)
        return lambda: len(sent) == count

    def _publish(self, sensor: Sensor, tag: str, stamp: Time) -> None:
        message = sensor.message(f"{self.nonce}/{tag}", stamp)
        self.hardware[sensor.name].publish(message)


class SensorRig:
    """The examiner's view of one subject during the QoS exam."""

    def __init__(self, bench: Bench) -> None:
        """Bring up the examiner's endpoints on the subject's domain."""
        self.subject = bench.subject
        self._session = bench.session
        node = bench.session.run(ExaminerNode)
        assert isinstance(node, ExaminerNode)
        self.node = node
        self._experiments: dict[str, Any] = {}
        self._probes = 0

    def offered(self, topic: str) -> list[TopicEndpointInfo]:
        """Return the publishers on ``topic`` that are not the examiner's."""
        return self._others(self.node.get_publishers_info_by_topic(topic))

    def requested(self, topic: str) -> list[TopicEndpointInfo]:
        """Return the subscriptions on ``topic`` that are not the examiner's."""
        return self._others(self.node.get_subscriptions_info_by_topic(topic))

    def _others(self, endpoints: list[TopicEndpointInfo]) -> list[TopicEndpointInfo]:
        return [e for e in endpoints if e.node_name != self.node.get_name()]

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
                self.node.send(sensor, phase)
            self.wait(partial(_all_heard, silent, heard, phase), PROBE_PERIOD)
            silent = _silent(silent, heard, phase)
            if all(give_up is not None and give_up(sensor) for sensor in silent):
                break
        return silent

    def burst(self, sensor: Sensor, phase: str, count: int) -> bool:
        """Send ``count`` readings; return whether the last was seen on the sensor's topic."""
        self.node.send(sensor, phase, count)
        return self.seen(sensor, phase, count)

    def seen(self, sensor: Sensor, phase: str, count: int) -> bool:
        """Wait for the last of ``count`` readings on the sensor's topic; False if it never came."""
        return self.wait(lambda: f"{phase}/{count - 1}" in self.node.witnessed[sensor.name])

    def expires(self) -> bool:
        """Whether readings of any sensor are dropped when they get old (a lifespan is offered)."""
        ends = [end for sensor in SENSORS for end in self.offered(sensor.topic)]
        return any(0 < end.qos_profile.lifespan.nanoseconds < ENDLESS for end in ends)

    def consumed(self, sensor: Sensor, phase: str) -> list[int]:
        """Return the indices of a phase's readings in the order the consumer passed them on."""
        return indices(self.node.consumed, sensor, phase)

    def once(self, experiment: Callable[[SensorRig], Any]) -> Any:
        """Run an experiment that several checks read, once."""
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


def indices(heard: Heard, sensor: Sensor, phase: str) -> list[int]:
    """Return the indices of a phase's readings in order of arrival."""
    tags = (tag.rpartition("/") for tag in list(heard[sensor.name]))
    return [int(index) for name, _, index in tags if name == phase and index.isdigit()]


def mismatch(offered: TopicEndpointInfo, requested: TopicEndpointInfo) -> str:
    """Return why DDS refuses to connect two endpoints, or an empty string.

    Only an ERROR is a refusal: rmw reports a WARNING for two default profiles, too.
    """
    compatibility, reason = qos_check_compatible(offered.qos_profile, requested.qos_profile)
    return str(reason) if compatibility == QoSCompatibility.ERROR else ""


def _all_heard(sensors: Iterable[Sensor], heard: Heard, phase: str) -> bool:
    return not _silent(sensors, heard, phase)


def _silent(sensors: Iterable[Sensor], heard: Heard, phase: str) -> list[Sensor]:
    return [s for s in sensors if not any(t.startswith(f"{phase}/") for t in list(heard[s.name]))]
