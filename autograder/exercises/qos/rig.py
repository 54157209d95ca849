"""The rig of the QoS exam: plays the robot's hardware and listens to what becomes of each reading.

For each sensor a reading goes in on ``hardware/<sensor>``, through the student's driver node onto
the sensor's topic, through the student's consumer node, and out on ``consumer/<sensor>``. Both
ends belong to the examiner, and so does a witness that listens on the topic between them.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from itertools import count
from typing import Any

from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.topic_endpoint_info import TopicEndpointInfo

from autograder.examination.check_context import CheckContext
from autograder.examination.exam import NotExaminable
from autograder.exercises.qos.readings import IMU, SENSORS, STOP, Heard, Sensor
from autograder.exercises.qos.sensor_examiner import (
    AHEAD,
    LAG,
    ExaminerNode,
    lossless_profile,
    undemanding_profile,
)
from autograder.observe.participants import of_others
from autograder.observe.patience import Patience
from autograder.observe.phrases import callback_raised
from autograder.observe.spinner import Spinner
from autograder.observe.stillness import HANGS_S, RESTLESS_S, Stillness
from autograder.processes.outside.holding import HoldError
from course.errors import WaitTimeout

DRIVERS, CONSUMERS = "SensorDrivers", "SensorConsumers"

ENDLESS = 3600 * 10**9
"""Nanoseconds: a lifespan of an hour or more is as good as none."""
PROBE_PERIOD = 0.1
"""Seconds between two rounds of probes while endpoints find each other."""
FOUND = 2.0
"""Seconds in which the drivers' publishers are found on the graph, if they come with their node."""
NOW = 0.05
"""Seconds in which a busy machine comes to a look at all threads, and another."""
ROUND = 5
"""IMU readings in a round, at their own rate: a consumer may take a lone one for an outlier."""


PRESSES = "presses"
"""The phase of the stop events that bear the words of earlier ones."""


class SensorRig:
    """The examiner's view of one subject during the QoS exam."""

    def __init__(self, bench: CheckContext) -> None:
        """Bring up the examiner's endpoints on the subject's domain."""
        self.bench = bench
        self.subject = bench.subject
        self.spinner = Spinner(bench.session.context)
        self.node = ExaminerNode(bench.session.context, bench.draws)
        self.spinner.add_node(self.node)
        self._experiments = bench.memory
        self._probes = 0  # how often probed
        self._still = Stillness(bench.outside)

    def find_publishers(self, topic: str) -> list[TopicEndpointInfo]:
        """Return the publishers on ``topic`` that are not the examiner's."""
        return of_others(self.node.get_publishers_info_by_topic(topic))

    def find_subscriptions(self, topic: str) -> list[TopicEndpointInfo]:
        """Return the subscriptions on ``topic`` that are not the examiner's."""
        return of_others(self.node.get_subscriptions_info_by_topic(topic))

    def listen_to_consumers(self) -> None:
        """Listen to the consumers' ends, with what they offer: lossless wherever it is possible."""
        for sensor in SENSORS:
            topic = f"consumer/{sensor.name}"
            reliable = all(
                e.qos_profile.reliability == ReliabilityPolicy.RELIABLE
                for e in self.find_publishers(topic)
            )
            qos = lossless_profile() if reliable else undemanding_profile()
            self.node.listen(sensor, topic, qos, self.node.consumed)

    @contextmanager
    def keep_busy(self, name: str) -> Iterator[Callable[[], bool]]:
        """Keep the node of a class busy for the length of the block; its endpoints go on.

        What is yielded lets it go on before the end of the block. It returns whether its endpoints
        did not receive, by an accident that `Held.is_jammed` tells of.
        Where all its threads are held, the drivers are busy as well: see `have_stand_ins`.
        """
        if self.can_hold:
            with self._hold_subject() as let_go, ExitStack() as standing_in:
                if name == CONSUMERS:
                    standing_in.enter_context(self.node.standing_in())
                yield let_go
            return
        with ExitStack() as paused:
            self.subject.pause(name)
            paused.callback(self.subject.resume, name)

            def let_go() -> bool:
                paused.close()
                return False

            yield let_go

    @property
    def can_hold(self) -> bool:
        """Whether the subject is in a sandbox, where all its threads can be held from outside."""
        return self.bench.outside.own_network

    @contextmanager
    def _hold_subject(self) -> Iterator[Callable[[], bool]]:
        """Hold the subject's threads for the length of the block; it is not asked."""
        outside = self.bench.outside
        try:
            outside.ask("hold")
        except HoldError as error:
            raise NotExaminable(f"{error} After a hand-in a person looks at it.") from None
        with ExitStack() as held:
            held.callback(outside.ask, "release")

            def let_go() -> bool:
                held.pop_all()
                return bool(outside.ask("release"))

            yield let_go

    def have_stand_ins(self) -> None:
        """Be ready to publish in the drivers' stead while these are held with the consumers.

        For that there are publishers of the examiner's from the time on when there are drivers:
        whoever saw them come would know that a consumer is about to be held.
        """
        if not self.can_hold:
            return
        self.wait(lambda: all(self.find_publishers(sensor.topic) for sensor in SENSORS), FOUND)
        there = [sensor for sensor in SENSORS if self.find_publishers(sensor.topic)]
        self.node.have_stand_ins({sensor.name: self._offered_profile(sensor) for sensor in there})

    def probe_stand_ins(self) -> None:
        """See the consumers hear the stand-ins, which offer what the drivers do by now."""
        if not self.can_hold:
            return
        self.have_stand_ins()
        with self.node.standing_in():
            self.probe(SENSORS, self.node.consumed)

    def _offered_profile(self, sensor: Sensor) -> QoSProfile:
        """Return what the driver of a sensor offers: of several, the one that most can hear.

        How many readings a publisher keeps cannot be seen; a consumer's queue does not rest on it.
        """
        offers = [end.qos_profile for end in self.find_publishers(sensor.topic)]
        best = max(offers, key=lambda qos: (-qos.reliability.value, -qos.durability.value))
        return QoSProfile(
            history=HistoryPolicy.KEEP_ALL, reliability=best.reliability,
            durability=best.durability, lifespan=best.lifespan, deadline=best.deadline,
            liveliness=best.liveliness,
            liveliness_lease_duration=best.liveliness_lease_duration,
        )  # fmt: skip

    def wait(self, condition: Callable[[], Any], timeout: float | None = None) -> bool:
        """Wait until ``condition`` holds; return whether it did before the deadline.

        Without ``timeout`` (s) that is when it would have come: see `Patience`.
        """
        if timeout is None:
            return self.start_patience().wait(self.spinner, condition)
        return self._wait_until(condition, timeout)

    def wait_in_traffic(self, condition: Callable[[], Any], timeout: float) -> bool:
        """Do the same while readings come in at their rate: 20 ms more or less do not matter."""
        return self._wait_until(condition, timeout, often=False)

    def _wait_until(
        self, condition: Callable[[], Any], timeout: float, *, often: bool = True
    ) -> bool:
        with suppress(WaitTimeout):
            self.spinner.until(condition, timeout, "an observation", often=often)
            return True
        return False

    def start_patience(self) -> Patience:
        """Return for how long something is waited for that may never come."""
        return Patience(self._still)

    def wait_for_rest(self, patience: float = RESTLESS_S) -> None:
        """Return when all that was sent has been dealt with, or after ``patience`` s of work."""
        self._still.wait_for_rest(patience, max(patience, HANGS_S))

    def is_at_rest(self) -> bool:
        """Return whether all is at rest just now."""
        return self._still.wait_for_rest(timeout=NOW)

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
        patience = self.start_patience()
        for attempt in count():
            self._send_probes(silent, heard, phase, attempt)
            silent = self._silent_sensors(silent, heard, phase)
            hopeless = all(give_up is not None and give_up(sensor) for sensor in silent)
            if hopeless or not patience.has_time_left():
                break
        return silent

    def _send_probes(self, sensors: list[Sensor], heard: Heard, phase: str, attempt: int) -> None:
        """Send a reading of each sensor, of the IMU a few at its rate, until all were heard from.

        No two alike: what becomes of repeated words is another check's question.
        """
        end = time.monotonic() + PROBE_PERIOD
        everyone = partial(self._all_heard, sensors, heard, phase)
        for number in range(attempt * ROUND, (attempt + 1) * ROUND):
            silent = self._silent_sensors(sensors, heard, phase)
            for sensor in silent:
                if sensor is IMU or number % ROUND == 0:
                    self.node.publish(sensor, phase, number)
            if IMU in silent:
                self.wait(everyone, 1 / IMU.rate)
        self.wait(everyone, max(0.0, end - time.monotonic()))

    def describe_probes(self, sensor: Sensor) -> str:
        """Return what the driver did with the newest probes of a sensor, as a phrase."""
        phase = f"probe{self._probes}"
        passed, sent = (
            len(set(self.witnessed_indices(sensor, phase))),
            len(self.delivery_times(sensor, phase)),
        )
        return f"while the driver published {passed} of the {sent} that came in"

    def _all_heard(self, sensors: Iterable[Sensor], heard: Heard, phase: str) -> bool:
        return not self._silent_sensors(sensors, heard, phase)

    def _silent_sensors(self, sensors: Iterable[Sensor], heard: Heard, phase: str) -> list[Sensor]:
        return [sensor for sensor in sensors if not self.heard_indices(heard, sensor, phase)]

    def send_burst(self, sensor: Sensor, phase: str, count: int) -> bool:
        """Send ``count`` readings; return whether the last was seen on the sensor's topic.

        No faster than the driver takes them: its queue for the hardware need not be longer.
        """
        takes = True
        for index in range(count):
            self.node.publish(sensor, phase, index)
            if takes:
                takes = self.wait(partial(self.is_taken, sensor, phase, index + 1 - AHEAD), LAG)
        return self.wait(partial(self.is_taken, sensor, phase, count - 1))

    def is_taken(self, sensor: Sensor, phase: str, index: int) -> bool:
        """Whether the driver has published a reading of a phase, or a later one."""
        return max(self.publication_times(sensor, phase), default=-1) >= index

    def witnessed_indices(self, sensor: Sensor, phase: str) -> list[int]:
        """Return the indices of a phase's readings as they went over the sensor's topic."""
        return self.heard_indices(self.node.witnessed, sensor, phase)

    def publication_times(self, sensor: Sensor, phase: str) -> dict[int, int]:
        """Return when the driver published the readings of a phase: {index: ns since 1970}."""
        return self.node.published.get(self._phase_key(sensor, phase), {}).copy()

    def delivery_times(self, sensor: Sensor, phase: str) -> dict[int, int]:
        """Return when the hardware delivered the readings of a phase: {index: ns since 1970}."""
        return self.node.sent.get(self._phase_key(sensor, phase), {}).copy()

    def publication_time(self, sensor: Sensor, phase: str, index: int) -> int:
        """Return when the driver published a reading, in ns since 1970; 0 if it was not seen."""
        return self.node.published.get(self._phase_key(sensor, phase), {}).get(index, 0)

    def handed_readings(self, sensor: Sensor, phase: str) -> list[tuple[int, int]]:
        """Return which readings of a phase the consumer passed on, and when (ns since 1970)."""
        return self.node.handed.get(self._phase_key(sensor, phase), []).copy()

    def _phase_key(self, sensor: Sensor, phase: str) -> tuple[str, int]:
        # What is read with `get` is not made: the executor's thread may be making it just now.
        return sensor.name, self.node.phase_number(phase)

    def consumed_indices(self, sensor: Sensor, phase: str) -> list[int]:
        """Return the indices of a phase's readings in the order the consumer passed them on."""
        return self.heard_indices(self.node.consumed, sensor, phase)

    def heard_indices(self, heard: Heard, sensor: Sensor, phase: str) -> list[int]:
        """Return the indices of a phase's readings in order of arrival."""
        number = self.node.phase_number(phase)
        return [tag.number for tag in list(heard[sensor.name]) if tag.phase == number]

    def can_expire(self, sensor: Sensor) -> bool:
        """Whether readings of a sensor are dropped when they get old: by a lifespan, at any end."""
        ends = [*self.find_publishers(sensor.topic), *self.find_subscriptions(sensor.topic)]
        return any(0 < end.qos_profile.lifespan.nanoseconds < ENDLESS for end in ends)

    def error_note(self) -> str:
        """Return which error a callback raised last, as a phrase in brackets, or nothing."""
        raised = self.subject.errors()
        return f" ({callback_raised(raised[-1])})" if raised else ""

    def comes_again(self) -> int:
        """Return how many stop events the consumer has handed on more than once so far.

        Those that were sent with the words of earlier ones (`PRESSES`) do not count.
        """
        presses = self.node.phase_number(PRESSES)
        numbers = Counter(t for t in list(self.node.consumed[STOP.name]) if t.phase != presses)
        return sum(number > 1 for number in numbers.values())

    def run_once(self, experiment: Callable[[SensorRig], Any]) -> Any:
        """Run an experiment that several checks, or parts, read, once a sitting."""
        name = experiment.__name__
        if name not in self._experiments:
            self._experiments[name] = experiment(self)
        return self._experiments[name]


@contextmanager
def sensor_rig(bench: CheckContext) -> Iterator[SensorRig]:
    """Give a rig, and take the examiner's endpoints down afterwards."""
    rig = SensorRig(bench)
    try:
        yield rig
    finally:
        rig.spinner.close()
