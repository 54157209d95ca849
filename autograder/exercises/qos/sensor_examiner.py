"""The examiner's node of the QoS exam: it feeds readings in, and hears what becomes of them."""

from __future__ import annotations

import secrets
import threading
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from itertools import count
from typing import Any

from rclpy.context import Context
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message, serialize_message
from rclpy.time import Time

from autograder.examination.draws import USUAL_SEED, Draws
from autograder.exercises.qos.readings import SENSORS, STOP, Heard, Sensor, Tag
from autograder.observe.publication_times import published_at, received_at
from autograder.observe.quiet_node import QuietNode

AHEAD, LAG = 4, 1.0
"""Readings that may be on their way into a driver, and for how many seconds the next one waits."""

MOST_PHASES, MOST_PAIRS = 9999, 49999
"""The highest phase, and half of the highest number, that fit a tag's usual length."""
CLAIMED_NS = 100_000_000
"""By how much longer what a consumer hands on may be on its way than what it got, as it says."""

INSISTENT = 0.25
"""Seconds whose readings may be on their way in when they are to come in at their rate."""


def lossless_profile(durability: DurabilityPolicy = DurabilityPolicy.VOLATILE) -> QoSProfile:
    """Return the profile of a cable: every reading, in order."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_ALL,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=durability,
    )


def undemanding_profile() -> QoSProfile:
    """Return the profile of a reader that matches every writer and keeps all it gets."""
    return QoSProfile(history=HistoryPolicy.KEEP_ALL, reliability=ReliabilityPolicy.BEST_EFFORT)


class ExaminerNode(QuietNode):
    """The examiner's endpoints: hardware outputs, a witness a topic, and the consumers' ends."""

    def __init__(self, context: Context | None = None, draws: Draws | None = None) -> None:
        """Create what does not depend on the student; a nonce of this run tags readings.

        ``draws`` give what readings bear in place of their tags; the usual ones if left out.
        """
        self.nonce = secrets.randbelow(2**24)  # that a float32 still holds exactly
        super().__init__(f"examiner_{self.nonce}", context)
        self._phases: dict[str, int] = {}
        self._draws = draws or Draws(USUAL_SEED)
        self._words: dict[tuple[str, Tag], Tag] = {}  # what a sensor's readings bear, by their tags
        self._tags: dict[tuple[str, Tag], Tag] = {}  # and the other way round
        self.hardware = {
            s.name: self.create_publisher(s.type, f"hardware/{s.name}", lossless_profile())
            for s in SENSORS
        }
        self._stand_ins: dict[str, Any] = {}
        self._offers: dict[str, QoSProfile] = {}  # of the stand-ins
        self._ends: Mapping[str, Any] = self.hardware  # that readings are fed into
        self.consumed: Heard = defaultdict(list)
        self.witnessed: Heard = defaultdict(list)
        self.altered: set[str] = set()  # topics with readings that the hardware did not deliver so
        self.foreign: set[str] = set()  # topics with messages that cannot be told to be readings
        self.blank: set[str] = set()  # topics with readings of which only the header is left
        # When the hardware delivered a sensor's readings of a phase, when the driver published
        # them, and when the consumer handed them on, in order: by number, in ns since 1970.
        self.sent: dict[tuple[str, int], dict[int, int]] = defaultdict(dict)
        self.published: dict[tuple[str, int], dict[int, int]] = defaultdict(dict)
        self.handed: dict[tuple[str, int], list[tuple[int, int]]] = defaultdict(list)
        self._transits: dict[tuple[str, int], dict[int, int]] = defaultdict(dict)  # ns
        self._stamps: dict[tuple[str, int], Tag] = {}  # ns since 1970
        # As they went out, serialized. One that comes back like that is told by it, and need not be
        # taken apart: most are, and each is heard at least twice.
        self._delivered: dict[str, dict[bytes, Tag]] = defaultdict(dict)
        self._readings = {s.name: s.type() for s in SENSORS}  # one message a sensor, reused
        self._filling = threading.Lock()  # a stream may publish while a check does
        for sensor in SENSORS:
            self.listen(sensor, sensor.topic, undemanding_profile(), self.witnessed)

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

        delivered = self._delivered[sensor.name]

        def keep(serialized: bytes, info: Any) -> None:
            tag, message = delivered.get(serialized), None
            if tag is None:
                message = deserialize_message(serialized, sensor.type)
                tag = self._find_tag(sensor, message)
            if tag is None:
                self.foreign.add(topic)
            elif tag.nonce == self.nonce:
                heard[sensor.name].append(tag)
                when, kind = published_at(info), (sensor.name, tag.phase)
                if message is not None and not sensor.is_unchanged(
                    message, self._words[sensor.name, tag]
                ):
                    self.altered.add(topic)
                    if sensor.is_blank(message):
                        self.blank.add(topic)
                if heard is self.witnessed:
                    self.published[kind].setdefault(tag.number, when)
                    self._transits[kind].setdefault(tag.number, received_at(info) - when)
                elif heard is self.consumed:
                    # Both come in by the same way: whoever is late here is so with both.
                    if (transit := self._transits[kind].get(tag.number)) is not None:
                        when = max(when, received_at(info) - transit - CLAIMED_NS)
                    self.handed[kind].append((tag.number, when))

        note: Callable[..., None] = keep  # rclpy's stubs know nothing of the second argument
        events = SubscriptionEventCallbacks(
            incompatible_qos=on_incompatible, use_default_callbacks=False
        )
        node = on or self
        return node.create_subscription(
            sensor.type, topic, note, qos, event_callbacks=events, raw=True
        )

    @contextmanager
    def temporary_listeners(self) -> Iterator[None]:
        """Let whoever begins to listen in the block stop at its end, and cost nobody time then."""
        before = set(self.subscriptions)
        try:
            yield
        finally:
            for guest in set(self.subscriptions) - before:
                self.destroy_subscription(guest)

    def have_stand_ins(self, offers: Mapping[str, QoSProfile]) -> None:
        """Have publishers that offer what the drivers of these sensors do, from now on."""
        types = {sensor.name: (sensor.type, sensor.topic) for sensor in SENSORS}
        for name, qos in offers.items():
            if self._offers.get(name) == qos:
                continue
            if name in self._stand_ins:
                self.destroy_publisher(self._stand_ins[name])
            self._stand_ins[name] = self.create_publisher(*types[name], qos)
            self._offers[name] = qos

    @contextmanager
    def standing_in(self) -> Iterator[None]:
        """Publish by the stand-ins, as far as there are any, for the length of the block."""
        self._ends = {**self.hardware, **self._stand_ins}
        try:
            yield
        finally:
            self._ends = self.hardware

    def phase_number(self, name: str) -> int:
        """Return the number of a phase of the exam."""
        return self._phases.setdefault(name, len(self._phases) + 1)

    def publish(self, sensor: Sensor, phase: str, index: int) -> None:
        """Feed one reading, taken now, into a sensor's hardware, or stand in for its driver."""
        tag = Tag(self.nonce, self.phase_number(phase), index)
        now = time.time_ns()
        self._stamps[sensor.name, now] = tag
        self.sent[sensor.name, tag.phase][index] = now
        with self._filling:
            reading = sensor.fill_message(
                self._readings[sensor.name], self.replacement_tag(sensor, tag), now
            )
            serialized = serialize_message(reading)
        self._delivered[sensor.name][serialized] = tag
        self._ends[sensor.name].publish(serialized)

    def replacement_tag(self, sensor: Sensor, tag: Tag) -> Tag:
        """Return what a reading bears in place of its tag: drawn, the same each time.

        Its phase would tell who has seen an examination what comes next, and by its number those
        before it could be made up.
        """
        key = sensor.name, tag
        for attempt in count():
            if key in self._words:
                break
            purpose = f"{sensor.name} reading {tag.number} of phase {tag.phase}, {attempt}"
            phase = self._draws.whole(f"the phase of {purpose}", tag.phase, 1, MOST_PHASES)
            half = self._draws.whole(f"the number of {purpose}", tag.number // 2, 0, MOST_PAIRS)
            # An odd number says that a scan has beams without an echo, which can be seen anyway.
            words = Tag(tag.nonce, phase, 2 * half + tag.number % 2)
            if (sensor.name, words) not in self._tags:
                self._words[key], self._tags[sensor.name, words] = words, tag
        return self._words[key]

    def _find_tag(self, sensor: Sensor, message: Any) -> Tag | None:
        """Return the tag of a reading, by its stamp if nothing else is left of it.

        A stop event may be one of an earlier run, whose nonce is another.
        """
        found = sensor.find_tags(message)
        known = (self._tags.get((sensor.name, words)) for words in found)
        own = next(filter(None, known), None)
        if own is not None or sensor is STOP:
            return own or next((other for other in found if other.nonce != self.nonce), None)
        return self._stamps.get((sensor.name, Time.from_msg(message.header.stamp).nanoseconds))


class Stream:
    """Readings that come in at the sensor's rate until it is stopped or ``limit`` are out.

    No faster than the driver gets its turn: on a busy machine it would lose what it could not take.
    Of stop events, of which none may get lost, only one is ever on its way into a driver.
    """

    def __init__(self, node: ExaminerNode, sensor: Sensor, phase: str, limit: int = 2**31) -> None:
        """Begin at once."""
        self.sensor = sensor
        self.sent = 0
        self._node, self._phase, self._limit = node, phase, limit
        self._ahead = 1 if sensor is STOP else AHEAD
        self._drops = False
        self._on_time: tuple[float, int] | None = None
        self._since = time.monotonic()
        self._turn = threading.Lock()
        self._timer = node.create_timer(1 / sensor.rate, self._send_due)

    def slow_down(self) -> None:
        """Send the next only when the driver has published the one before, from now on.

        On a busy machine readings would keep the thread that it shares with the consumer from what
        waits there.
        """
        with self._turn:
            self._ahead = 1

    def keep_rate(self) -> None:
        """Keep to the sensor's rate on average from now on, though the driver may lose some.

        A busy machine skips turns of a timer, so that readings come in more slowly than on a robot,
        and a consumer that is too slow would keep up. What was skipped is caught up with.
        """
        with self._turn:
            self._ahead = max(AHEAD, int(INSISTENT * self.sensor.rate))
            self._on_time = time.monotonic(), self.sent

    def _send_due(self) -> None:
        with self._turn:
            for _ in range(self._count_due()):
                if self.sent >= self._limit or self._is_waiting():
                    break
                self._node.publish(self.sensor, self._phase, self.sent)
                self.sent += 1
                self._since = time.monotonic()

    def _count_due(self) -> int:
        """Return how many readings are to be sent in this turn."""
        if self._on_time is None:
            return 1
        since, sent = self._on_time
        return int((time.monotonic() - since) * self.sensor.rate) + sent - self.sent

    def _is_waiting(self) -> bool:
        """Whether the driver has not yet come to what was sent; one that drops it is not it."""
        phase = self._node.phase_number(self._phase)
        heard = self._node.witnessed[self.sensor.name]
        newest = heard[-1].number if heard and heard[-1].phase == phase else -1
        if time.monotonic() - self._since > LAG:
            seen = {tag.number for tag in heard if tag.phase == phase}
            self._drops = self.sensor is STOP and len(seen) <= newest
            return False
        return not self._drops and self.sent - newest > self._ahead

    @contextmanager
    def hold_back(self) -> Iterator[None]:
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
