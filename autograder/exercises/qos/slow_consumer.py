"""What is left for a consumer that was busy for a while, and whether it keeps up afterwards.

Depth and history of a queue cannot be read from the ROS graph: they show in what comes out of it.
Readings come in at the sensors' own rates, as on the robot, so that a design may rest on a queue's
depth, on a lifespan, or on the age of a reading. Two pauses are needed for that: a long one shows
what is too old, a short one what must not be lost, in so little time that nothing of it is old.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

from autograder.examination.exam import Failed, NotExaminable
from autograder.exercises.qos.readings import CAMERA, IMU, LIDAR, STOP, Sensor
from autograder.exercises.qos.sensor_paths import CONSUMERS, SensorRig
from autograder.exercises.qos.single_readings import require_each_published, send_singles
from autograder.observe.consumer_lag import ConsumerLag, watch_consumers
from autograder.observe.message_stream import LAG_S, UNLIMITED, MessageStream, hold_streams
from autograder.observe.patience import SETTLE_S
from autograder.observe.sequence_faults import lost_phrase, numbers_phrase

PAUSE_S = 1.5
"""Seconds that the consumer is busy."""
IMU_PAUSE_S = 0.9
"""Seconds of it in which IMU readings come in: nearly twice as many as may be kept."""
EVENTS = 100
"""Stop events in that time."""
LONGEST_S = 60.0
"""Seconds that these may take."""
LULL_S = 0.06
"""Seconds without readings at its end: more than half of the time between two scans, so that a
reading is clearly on this side of a bound or on that one, despite jitter."""
BURST = 5
"""IMU readings that come in while the consumer is busy for 50 ms."""
PROMPT_S, YOUNG_S = 0.15, 0.35
"""Seconds from the end of a short pause in which a burst comes out of an idle machine, and from
its first reading on in which it must: a design that goes by the age of a reading (0.5 s is old) may
rightly find a later one too old, and then it is the machine that is slow."""
TRIES = 8
EXPIRY_TRIES = 3
"""Pauses after which too old a backlog is the consumer's, though its readings expire by LIFESPAN.

Fast DDS may expire them later than it should: a reading that comes in just as its timer goes off
puts the timer off by the whole LIFESPAN (`DataReaderImpl::on_new_cache_change_added` sets the
interval of the timer that `lifespan_expired` has just set). At 100 Hz that was seen in one pause of
640, with 82 readings left where 50 are young enough.
"""
TURNS = BURST + 2
"""Turns of a driver after which a consumer has had one for each reading of a burst."""
TOO_BUSY = "This machine was too busy to {}. After a hand-in a person looks at it."


@dataclass(frozen=True)
class Backlog:
    """One sensor's readings of a pause, and what became of them.

    Attributes:
        count: how many came in; ``published`` says how many of them went over the topic.
        kept: the numbers in the order in which the consumer handed them on; those from ``count`` on
            came in after the pause.
        replayed: how many were published from the first of them to the end of the pause.
        oldest_s: how old the first of them was at the end of the pause.
        is_early: some came out while the consumer was held back.
    """

    sensor: Sensor
    count: int
    published: int
    kept: list[int]
    replayed: int
    oldest_s: float
    is_early: bool

    @property
    def is_stale(self) -> bool:
        """Whether the consumer acted on what was too old, by number and by age."""
        most = self.sensor.most
        return self.replayed > most and self.oldest_s > most / self.sensor.rate_hz


class LongPause:
    """A pause of the consumer's while readings come in; all but the events go on afterwards.

    Attributes:
        is_jammed: DDS could not receive meanwhile, so that nothing is known.
        lags: whether the consumer keeps up afterwards, of each sensor where that can be seen.
    """

    def __init__(self, rig: SensorRig, series: str) -> None:
        """Keep the consumer busy, let it go on, and watch it."""
        self._rig, self._series = rig, series
        self._streams: dict[Sensor, MessageStream] = {}
        self._counts: dict[Sensor, int] = {}
        self._early: set[Sensor] = set()
        self._resumed_ns = 0
        self.lags: dict[Sensor, ConsumerLag] = {}
        self.is_jammed = self._pause()
        if not self.is_jammed:
            for sensor in rig.paths:
                self._drain(sensor)
            self._watch()
        for stream in self._streams.values():
            stream.stop()

    def _pause(self) -> bool:
        rig, streams = self._rig, self._streams
        with rig.keep_busy(CONSUMERS) as let_go:
            for sensor in (CAMERA, LIDAR, STOP):
                limit = EVENTS if sensor is STOP else UNLIMITED
                streams[sensor] = rig.paths[sensor].stream(self._series, limit=limit)
            before_imu = CAMERA.rate_hz * (PAUSE_S - IMU_PAUSE_S)
            rig.wait(lambda: streams[CAMERA].sent >= before_imu, LONGEST_S, often=False)
            streams[IMU] = rig.paths[IMU].stream(self._series)
            rig.wait(self._is_enough, LONGEST_S, often=False)
            with hold_streams(streams.values()):
                streams[STOP].stop()
                for sensor, stream in streams.items():
                    stream.slow_down()
                    self._counts[sensor] = stream.sent
                    # So the reader that is held has been sent all before it, too.
                    rig.wait_for_driver(sensor, self._series, stream.sent - 1)
                newest_ns = max(max(self._published(s).values(), default=0) for s in rig.paths)
                rig.wait(lambda: time.time_ns() - newest_ns >= LULL_S * 1e9, LAG_S)
                self._early = {sensor for sensor in rig.paths if self._kept(sensor)}
                self._resumed_ns = time.time_ns()
                return let_go()

    def _is_enough(self) -> bool:
        least = {CAMERA: PAUSE_S * CAMERA.rate_hz, LIDAR: PAUSE_S * LIDAR.rate_hz, STOP: EVENTS}
        least[IMU] = IMU_PAUSE_S * IMU.rate_hz
        return all(self._streams[sensor].sent >= int(number) for sensor, number in least.items())

    def _published(self, sensor: Sensor) -> dict[int, int]:
        """Return when the readings of the pause went over the topic: {number: ns}."""
        times = self._rig.paths[sensor].published.first_times(self._series)
        return {number: when for number, when in times.items() if number < self._counts[sensor]}

    def _kept(self, sensor: Sensor) -> list[int]:
        return self._rig.paths[sensor].handed.numbers(self._series)

    def _drain(self, sensor: Sensor) -> None:
        """Wait until the consumer has handed on the newest, for as long as it makes progress.

        One that leaves out what is too old may, on a busy machine, not get through what has piled
        up while more comes in: if nothing comes out, nothing comes in until it has.
        """
        rig, newest = self._rig, max(self._published(sensor), default=-1)

        def is_out() -> bool:
            return max(self._kept(sensor), default=-1) >= newest

        passed = -1
        while passed < (now := len(self._kept(sensor))) and not rig.wait(is_out):
            passed = now
        if sensor is STOP:  # one that handles the newest first has lost nothing
            rig.wait_for_rest()
            rig.wait(lambda: len(set(self._kept(STOP))) >= self._counts[STOP], PROMPT_S)
        elif not is_out():
            with hold_streams(self._streams.values()):
                rig.wait_for_rest(SETTLE_S)
            rig.wait(is_out)

    def _watch(self) -> None:
        """See whether the consumer keeps up while readings come in at their rate.

        Those that a driver drops never do, so that is not waited for.
        """
        singles = self._rig.run_once(send_singles)
        for sensor, path in self._rig.paths.items():
            if sensor is STOP or singles[sensor].is_thinned:
                self._streams[sensor].stop()
                continue
            self._streams[sensor].keep_rate()
            self.lags[sensor] = ConsumerLag(
                path.published, path.handed, self._series, self._resumed_ns,
                rate_hz=sensor.rate_hz, most_waiting=sensor.most, each_counts=sensor is IMU,
                noun="readings",
            )  # fmt: skip
        watch_consumers(self._rig, self.lags, lambda sensor: self._streams[sensor].stop())

    def backlog(self, sensor: Sensor) -> Backlog:
        """Return what has become of a sensor's readings by now."""
        kept, published = self._kept(sensor), self._published(sensor)
        since = [when for number, when in published.items() if number >= min(kept, default=0)]
        oldest_ns = self._resumed_ns - published.get(min(kept, default=-1), self._resumed_ns)
        return Backlog(
            sensor, self._counts[sensor], len(published), kept, len(since), oldest_ns / 1e9,
            sensor in self._early,
        )  # fmt: skip

    @property
    def may_have_expired_late(self) -> bool:
        """Whether what was too old may be DDS's fault, which now and then expires it late."""
        return any(
            path.find_ends().can_expire and self.backlog(sensor).is_stale
            for sensor, path in self._rig.paths.items()
        )


def pause_for_long(rig: SensorRig) -> LongPause:
    """Keep the consumer busy for long; again if that tells nothing, or DDS was at fault.

    Raises:
        NotExaminable: DDS could never receive meanwhile.
    """
    for number in range(TRIES):
        pause = LongPause(rig, f"long pause {number}")
        if not pause.is_jammed and (number + 1 >= EXPIRY_TRIES or not pause.may_have_expired_late):
            return pause
        rig.wait_for_rest()
    raise NotExaminable(
        "Your consumer was at work at each moment in which the examiner tried to keep it busy from "
        "outside, so that nothing could be received either. After a hand-in a person looks at it."
    )


def require_backlog(rig: SensorRig, sensor: Sensor) -> Backlog:
    """Return what a long pause left of a sensor's readings.

    Fail if the driver changes or drops readings, or if the consumer cannot be held back.
    """
    found = rig.run_once(pause_for_long).backlog(sensor)
    if found.is_early and not rig.can_hold:
        raise NotExaminable(
            "Your consumer went on while its callbacks were held back: a thread or an executor of "
            "its own does its work, and that cannot be held back here, only where your work is "
            "graded in the sandbox."
        )
    if found.is_early:
        raise Failed(
            expected="While none of its threads runs, your consumer hands nothing on.",
            actual="It went on: does a thread bear a name that those of DDS have?",
        )
    require_each_published(rig, sensor)
    if sensor is STOP and found.count < EVENTS:
        raise NotExaminable(
            f"In {LONGEST_S:.0f} s only {found.count} stop events got through the driver, each "
            "sent when the one before was out: this machine was too busy, or the driver takes its "
            "time. After a hand-in a person looks at it."
        )
    return found


def require_fresh(rig: SensorRig, sensor: Sensor, expected: str) -> None:
    """Fail unless the consumer goes on with the newest after a long pause, and keeps up then."""
    found = require_backlog(rig, sensor)
    lag = rig.run_once(pause_for_long).lags[sensor]
    if max(found.kept, default=-1) < found.count - 1:
        actual = (
            f"Of {found.count} readings in a pause the newest never came out: it got "
            f"{numbers_phrase(found.kept, 'reading')}{rig.error_note()}."
        )
    elif found.is_stale:
        actual = f"It then worked through the last {found.replayed} of {found.published} readings."
    elif found.kept != sorted(found.kept):
        actual = f"It passed them on out of order: {numbers_phrase(found.kept, 'reading')}."
    elif lag.is_undecided:
        raise NotExaminable(
            TOO_BUSY.format(
                f"bring {sensor.name} readings at {sensor.rate_hz:.0f} Hz, and so to see whether "
                "your consumer keeps up with them"
            )
        )
    else:
        actual = lag.lag
    if actual:
        raise Failed(expected=expected, actual=actual)


def require_none_left_out(rig: SensorRig) -> None:
    """Fail if the consumer leaves out IMU readings again and again while they come in."""
    if omission := rig.run_once(pause_for_long).lags[IMU].omission:
        raise Failed(
            expected="While readings come in, the consumer hands on each of them, once.",
            actual=omission,
        )


@dataclass(frozen=True)
class Burst:
    """What a consumer passed on of a burst, in order; ``is_aged`` if a reading may have got old.

    ``published`` is how many of the burst the driver put on the topic.
    """

    kept: list[int]
    published: int
    is_aged: bool

    @property
    def missing_count(self) -> int:
        """How many readings were lost."""
        return BURST - len(set(self.kept))


def pause_for_burst(rig: SensorRig) -> Burst:
    """Keep the consumer busy while a burst of IMU readings comes in, and see what it passes on.

    Tried again while readings are missing that a slow machine may have let grow old, or that the
    driver has lost.
    """
    for number in range(TRIES):
        patience_s = None if number == TRIES - 1 else PROMPT_S
        burst = _send_burst(rig, f"short pause {number}", patience_s)
        if not burst.missing_count or (burst.published == BURST and not burst.is_aged):
            break
    return burst


def _send_burst(rig: SensorRig, series: str, patience_s: float | None) -> Burst:
    path = rig.paths[IMU]
    rig.wait_for_rest()  # what still waits for the consumer would be ahead of the burst
    with rig.keep_busy(CONSUMERS) as let_go:
        stream = path.stream(series, limit=BURST)
        rig.wait_for_driver(IMU, series, BURST - 1)
        published = path.published.first_times(series)
        is_jammed = let_go()
    rig.wait(lambda: BURST - 1 in path.handed.numbers(series), patience_s)
    stream.stop()
    handed_ns = path.handed.first_times(series).get(BURST - 1)
    decided_ns = _decision_ns(rig, f"{series}, later") if handed_ns is None else handed_ns
    rig.wait(lambda: len(set(path.handed.numbers(series))) == BURST, PROMPT_S)
    rig.wait_for_rest()  # one that hands on a reading again is heard out: how many is told
    is_aged = decided_ns - published.get(0, 0) > YOUNG_S * 1e9
    return Burst(path.handed.numbers(series), len(published), is_aged or is_jammed)


def _decision_ns(rig: SensorRig, series: str) -> int:
    """Return when the machine had come to all of a burst whose last reading is not out.

    That is the moment in which all is at rest. A subject that never rests is given more readings:
    once one of them has come out, all of the burst has been decided about. But a consumer that
    hands on few or none takes as long as it likes, so what tells of a slow machine is the driver:
    it shares a thread with the consumer, and after as many of its turns the consumer has had its
    own.
    """
    is_at_rest, now_ns = rig.is_at_rest(), time.time_ns()
    path = rig.paths[IMU]
    stream = path.stream(series)
    stream.slow_down()
    rig.wait(lambda: stream.sent >= TURNS and path.handed.numbers(series))
    stream.stop()
    turned_ns = path.published.first_times(series).get(TURNS - 1, time.time_ns())
    return min(now_ns, turned_ns) if is_at_rest else turned_ns


def require_burst(rig: SensorRig, expected: str) -> None:
    """Fail unless the consumer passes on every IMU reading of a short pause, once and in order."""
    found = rig.run_once(pause_for_burst)
    missing = found.missing_count
    if missing and found.published < BURST:
        actual = f"Of {BURST} that came in, {found.published} went over {IMU.topic}."
    elif missing and found.is_aged:
        raise NotExaminable(TOO_BUSY.format("tell a short queue from readings that had grown old"))
    elif missing:
        passed = BURST - missing
        oldest = bool(passed) and set(found.kept) == set(range(missing, BURST))
        actual = (
            f"Of {BURST} readings that came in while it was busy "
            f"{lost_phrase(missing, oldest=oldest)}, {passed or 'none'} "
            f"{'were' if passed > 1 else 'was'} passed on{rig.error_note()}."
        )
    elif len(found.kept) > BURST:
        actual = (
            f"It passed on {BURST} readings as {len(found.kept)}: some came out more than once, "
            "and an estimator that adds them up turns too far."
        )
    elif found.kept != sorted(found.kept):
        actual = f"It passed them on out of order: {numbers_phrase(found.kept, 'reading')}."
    else:
        return
    raise Failed(expected=expected, actual=actual)
