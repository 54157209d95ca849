"""The examiner of the QoS exam: it plays the hardware, and hears what becomes of each reading.

A reading goes in on ``hardware/<sensor>``, through the student's driver node onto the sensor's
topic, through the student's consumer node, and out on ``consumer/<sensor>``. Both ends belong to
the examiner, and so does a witness that listens on the topic between them.
"""

from __future__ import annotations

import secrets
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from itertools import count
from typing import Any, TypeVar

from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message, serialize_message
from rclpy.time import Time

from autograder.examination.check_context import CheckContext
from autograder.exercises.qos.readings import IMU, SENSORS, STOP, Mark, Sensor
from autograder.observe.arrivals import Arrivals
from autograder.observe.endpoint_qos import TopicEnds, lossless_profile, undemanding_profile
from autograder.observe.message_stream import AHEAD, LAG_S, UNLIMITED, MessageStream
from autograder.observe.observed_process import ObservedProcess
from autograder.observe.publication_times import published_at, received_at
from autograder.observe.quiet_node import QuietNode

Found = TypeVar("Found")

DRIVERS, CONSUMERS = "SensorDrivers", "SensorConsumers"

CLAIMED_NS = 100_000_000
"""By how much longer what a consumer hands on may be on its way than what it got, as it says."""
FOUND_S = 2.0
"""Seconds in which the drivers' publishers are found on the graph, if they come with their node."""
ROUND, IN_A_ROUND = 10, 5
"""Steps of a round of probes, in so many of which an IMU reading is sent, at its own rate: a
consumer may take a lone one for an outlier."""


class SensorPath:
    """The way of one sensor's readings, through the driver and the consumer.

    Attributes:
        sent: what the hardware delivered; ``published``: what the driver put on the topic;
        ``handed``: what the consumer handed on.
        altered: topics with readings that the hardware did not deliver so; ``blank``: with readings
            of which only the header is left; ``foreign``: with messages that are no readings.
    """

    def __init__(self, node: Node, sensor: Sensor, run: int) -> None:
        """Bring up the hardware's end, and the witness; ``run`` is a number of this run."""
        self.sensor, self._node, self._run = sensor, node, run
        self.hardware = node.create_publisher(sensor.type, sensor.hardware, lossless_profile())
        self.sent, self.published, self.handed = Arrivals(), Arrivals(), Arrivals()
        self.altered: set[str] = set()
        self.foreign: set[str] = set()
        self.blank: set[str] = set()
        self._stand_in: Any = None
        self._offer: QoSProfile | None = None  # of the stand-in
        self._entry = self.hardware
        self._marks: dict[tuple[str, int], Mark] = {}
        self._readings: dict[Mark, tuple[str, int]] = {}  # series and number
        self._stamps: dict[int, Mark] = {}
        # As they went out, serialized. One that comes back like that is told by it, and need not be
        # taken apart: most are, and each is heard at least twice.
        self._marks_sent: dict[bytes, Mark] = {}
        self._bytes_sent: dict[Mark, bytes] = {}
        self.listen(sensor.topic, undemanding_profile(), self.published)

    def find_ends(self) -> TopicEnds:
        """Return the student's endpoints on the sensor's topic."""
        return TopicEnds(self._node, self.sensor.topic)

    def listen_to_consumer(self) -> None:
        """Listen to the consumer's end, with what it offers."""
        request = TopicEnds(self._node, self.sensor.output).matching_request
        self.listen(self.sensor.output, request, self.handed)

    def send(self, series: str, number: int) -> None:
        """Feed one reading, taken now, into the hardware, or stand in for its driver.

        It reads like the one that had this series and number before, if there was one.
        """
        now_ns = time.time_ns()
        if (mark := self._marks.get((series, number))) is None:
            mark = Mark.draw(self._run)
            while mark in self._readings:
                mark = Mark.draw(self._run)
            self._marks[series, number] = mark
            self._readings[mark] = series, number
        self._stamps[now_ns] = mark
        reading = serialize_message(self.sensor.make_message(mark, now_ns, is_open=is_open(number)))
        self._bytes_sent[mark] = reading
        self._marks_sent[reading] = mark
        self.sent.note(series, number, now_ns, now_ns)
        self._entry.publish(reading)

    def stream(self, series: str, *, limit: int = UNLIMITED) -> MessageStream:
        """Begin to send readings at the sensor's rate.

        Of stop events, of which none may get lost, only one is ever on its way into a driver.
        """
        ahead = 1 if self.sensor is STOP else AHEAD
        return MessageStream(
            self._node, self.sensor.rate_hz, lambda number: self.send(series, number),
            lambda: self.published.newest(series), ahead=ahead, limit=limit,
        )  # fmt: skip

    def listen(
        self, topic: str, qos: QoSProfile, arrivals: Arrivals, on: Node | None = None
    ) -> Any:
        """Subscribe to ``topic`` and note this run's readings; ``on`` another node, if given."""

        def note(serialized: bytes, info: Any) -> None:
            mark = self._recognise(topic, serialized)
            if mark is not None:
                series, number = self._readings[mark]
                published_ns, received_ns = published_at(info), received_at(info)
                if arrivals is self.handed:
                    earliest_ns = self._earliest_handing(series, number, received_ns)
                    published_ns = max(published_ns, earliest_ns)
                arrivals.note(series, number, published_ns, received_ns)

        called: Callable[..., None] = note  # rclpy's stubs know nothing of the second argument
        node = on or self._node
        return node.create_subscription(self.sensor.type, topic, called, qos, raw=True)

    def _earliest_handing(self, series: str, number: int, received_ns: int) -> int:
        """Return when a reading can have been handed on, whatever the consumer says.

        It came by the same way as what was published: whoever is late here is so with both.
        """
        for arrival in self.published.of(series):
            if arrival.number == number:
                transit_ns = arrival.received_ns - arrival.published_ns
                return received_ns - transit_ns - CLAIMED_NS
        return 0

    def _recognise(self, topic: str, serialized: bytes) -> Mark | None:
        """Return the mark of a reading, by its stamp if nothing else is left of it."""
        if (mark := self._marks_sent.get(serialized)) is not None:
            return mark
        message = deserialize_message(serialized, self.sensor.type)
        if (mark := self.find_mark(message)) is None:
            found = self.sensor.find_marks(message)
            if self.sensor is not STOP or all(other.run == self._run for other in found):
                self.foreign.add(topic)  # else it is of an earlier run
            return None
        sent = deserialize_message(self._bytes_sent[mark], self.sensor.type)
        if not self.sensor.is_same(message, sent):
            self.altered.add(topic)
            if self.sensor.is_same(message, self.sensor.type()):
                self.blank.add(topic)
        return mark

    def find_mark(self, message: Any) -> Mark | None:
        """Return the mark of one of this run's readings, or None."""
        for mark in self.sensor.find_marks(message):
            if mark in self._readings:
                return mark
        if self.sensor is STOP:
            return None
        return self._stamps.get(Time.from_msg(message.header.stamp).nanoseconds)

    def renew_stand_in(self) -> None:
        """Have a publisher that offers what the driver does by now, to publish in its stead."""
        ends = self.find_ends()
        if not ends.publishers:
            return
        offer, before = ends.strongest_offer, self._offer
        if offer != before:
            if before is not None:
                self._node.destroy_publisher(self._stand_in)
            self._stand_in = self._node.create_publisher(self.sensor.type, self.sensor.topic, offer)
            self._offer = offer

    @contextmanager
    def standing_in(self) -> Iterator[None]:
        """Send by the stand-in, if there is one, for the length of the block."""
        self._entry = self._stand_in or self.hardware
        try:
            yield
        finally:
            self._entry = self.hardware


def is_open(number: int) -> bool:
    """Whether the scan of that number has beams without an echo."""
    return number % 2 == 1


class SensorRig(ObservedProcess):
    """The student's two nodes, and the ways of the readings through them."""

    def __init__(self, bench: CheckContext) -> None:
        """Bring up the examiner's endpoints on the subject's domain."""
        super().__init__(bench)
        run = secrets.randbelow(2**24)  # that a float32 still holds exactly
        self.node = QuietNode(f"examiner_{run}", bench.session.context)
        self.paths = {sensor: SensorPath(self.node, sensor, run) for sensor in SENSORS}
        self.spinner.add_node(self.node)
        self._probes = 0  # how often probed
        self._experiments: dict[Any, Any] = {}

    @contextmanager
    def keep_busy(self, name: str) -> Iterator[Callable[[], bool]]:
        """Keep the node of a class busy; where the drivers are held with it, stand in for them."""
        with super().keep_busy(name) as let_go, ExitStack() as standing_in:
            if name == CONSUMERS:
                standing_in.enter_context(self._standing_in())
            yield let_go

    @contextmanager
    def _standing_in(self) -> Iterator[None]:
        with ExitStack() as standing_in:
            for path in self.paths.values():
                standing_in.enter_context(path.standing_in())
            yield

    def have_stand_ins(self) -> None:
        """Be ready to publish in the drivers' stead while these are held with the consumers.

        For that there are publishers of the examiner's from the time on when there are drivers:
        whoever saw them come would know that a consumer is about to be held.
        """
        paths = self.paths.values()
        if self.can_hold:
            self.wait(lambda: all(path.find_ends().publishers for path in paths), FOUND_S)
            for path in paths:
                path.renew_stand_in()

    def probe_stand_ins(self) -> None:
        """See the consumers hear the stand-ins, which offer what the drivers do by now."""
        self.have_stand_ins()
        if self.can_hold:
            with self._standing_in():
                self.probe({sensor: path.handed for sensor, path in self.paths.items()})

    def probe(
        self,
        heard: Mapping[Sensor, Arrivals],
        give_up: Callable[[Sensor], Any] = lambda _: False,
    ) -> list[Sensor]:
        """Send readings until each of these has been heard; return the sensors never heard from.

        Endpoints find each other in their own time, and what is sent before is lost: so the first
        readings are probes. ``give_up`` says that waiting for a sensor is pointless. No two probes
        are alike: what becomes of repeated words is another check's question.
        """
        self._probes += 1
        series, patience = self._probe_series, self.start_patience()

        def silent() -> list[Sensor]:
            return [sensor for sensor, there in heard.items() if not there.numbers(series)]

        for number in count():
            begins_round = number % ROUND == 0
            if number and begins_round and not patience.has_time_left():
                break
            if number and begins_round and all(map(give_up, silent())):
                break
            for sensor in silent():
                if number % ROUND < (IN_A_ROUND if sensor is IMU else 1):
                    self.paths[sensor].send(series, number)
            if self.wait(lambda: not silent(), 1 / IMU.rate_hz):
                break
        return silent()

    @property
    def _probe_series(self) -> str:
        return f"probe {self._probes}"

    def describe_probes(self, sensor: Sensor) -> str:
        """Return what the driver did with the newest probes of a sensor, as a phrase."""
        path, series = self.paths[sensor], self._probe_series
        passed, came = (len(ends.first_times(series)) for ends in (path.published, path.sent))
        return f"while the driver published {passed} of the {came} that came in"

    def send_burst(self, sensor: Sensor, series: str, count: int) -> bool:
        """Send ``count`` readings; return whether the last was seen on the sensor's topic.

        No faster than the driver takes them: its queue for the hardware need not be longer.
        """
        takes = True
        for number in range(count):
            self.paths[sensor].send(series, number)
            takes = takes and self.wait_for_driver(sensor, series, number + 1 - AHEAD, LAG_S)
        return self.wait_for_driver(sensor, series, count - 1)

    def wait_for_driver(
        self, sensor: Sensor, series: str, number: int, timeout_s: float | None = None
    ) -> bool:
        """Wait until the driver has published a reading, or a later one; return whether it has."""
        published = self.paths[sensor].published
        return self.wait(lambda: published.newest(series) >= number, timeout_s)

    def send_alone(self, sensor: Sensor, series: str, number: int) -> bool:
        """Send one reading; return whether the driver has published it within `LAG_S`."""
        path = self.paths[sensor]
        before = len(path.published.numbers(series))
        path.send(series, number)
        return self.wait(lambda: len(path.published.numbers(series)) > before, LAG_S)

    def send_until(
        self, done: Callable[[], Any], sensor: Sensor, series: str, numbers: Iterable[int]
    ) -> bool:
        """Send readings at the sensor's rate until ``done``; return whether it came to that."""
        for number in numbers:
            self.paths[sensor].send(series, number)
            if self.wait(done, 1 / sensor.rate_hz):
                return True
        return self.wait(done)

    def run_once(self, experiment: Callable[[SensorRig], Found]) -> Found:
        """Run an experiment that several checks read, once a sitting."""
        if experiment not in self._experiments:
            self._experiments[experiment] = experiment(self)
        found: Found = self._experiments[experiment]
        return found


@contextmanager
def sensor_rig(bench: CheckContext) -> Iterator[SensorRig]:
    """Give a rig, and take the examiner's endpoints down afterwards."""
    rig = SensorRig(bench)
    try:
        yield rig
    finally:
        rig.close()
