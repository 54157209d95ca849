"""The experiments of a slow reader: what is left for a consumer that was busy for a while.

Depth and history of a queue cannot be read from the ROS graph: they show in what comes out of it.
Readings come in at the sensors' own rates, as on the robot, so that a design may rest on a queue's
depth, on a lifespan, or on the age of a reading. Two pauses are needed for that: a long one shows
what is too old, a short one what must not be lost, in so little time that nothing of it is old.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from functools import partial

from autograder.examination.exam import NotExaminable
from autograder.exercises.qos.backlogs import BURST, Backlog, Burst
from autograder.exercises.qos.consumer_lag import watch_consumers
from autograder.exercises.qos.driver_latency import find_thinning
from autograder.exercises.qos.readings import CAMERA, IMU, SENSORS, STOP, Sensor
from autograder.exercises.qos.rig import CONSUMERS, SensorRig
from autograder.exercises.qos.sensor_examiner import LAG, Stream
from autograder.observe.patience import SETTLE_S

PAUSE = 1.5  # s that the consumer is busy
IMU_PAUSE = 0.9  # s of it in which IMU readings come in: nearly twice as many as may be kept
EVENTS = 100  # stop events in that time
LONGEST = 60  # s that these may take
LULL = 0.06  # s without readings at its end: more than half of the time between two scans
PROMPT, YOUNG = 0.15, 0.35
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
TURNS = BURST + 2  # of a driver, after which a consumer has had one for each reading of a burst


def busy_consumer(rig: SensorRig) -> dict[str, Backlog]:
    """Stall the consumer while readings come in, let it go on, and see what it passes on.

    Tried again if DDS could not receive meanwhile, or may have expired readings late.
    """
    for number in range(TRIES):
        found = _busy_consumer(rig, f"long pause {number}")
        late = found is not None and any(left.may_have_expired_late for left in found.values())
        if found is not None and (not late or number + 1 >= EXPIRY_TRIES):
            return found
        rig.wait_for_rest()
    raise NotExaminable(
        "Your consumer was at work at each moment in which the examiner tried to keep it busy from "
        "outside, so that nothing could be received either. After a hand-in a person looks at it."
    )


def _busy_consumer(rig: SensorRig, phase: str) -> dict[str, Backlog] | None:
    """Return what was found; None if DDS could not receive meanwhile."""
    with rig.keep_busy(CONSUMERS) as let_go:
        streams = {
            s.name: Stream(rig.node, s, phase, _stream_limit(s)) for s in SENSORS if s is not IMU
        }
        before_imu = CAMERA.rate * (PAUSE - IMU_PAUSE)
        rig.wait_in_traffic(lambda: streams[CAMERA.name].sent >= before_imu, LONGEST)
        streams[IMU.name] = Stream(rig.node, IMU, phase)
        rig.wait_in_traffic(
            lambda: all(stream.sent >= _least_count(stream.sensor) for stream in streams.values()),
            LONGEST,
        )
        with _hold_streams(streams.values()):
            for stream in streams.values():
                stream.slow_down()
            streams[STOP.name].stop()
            counts = {name: stream.sent for name, stream in streams.items()}
            published = {s.name: _published_numbers(rig, s, phase, counts[s.name]) for s in SENSORS}
            # So that a reading is clearly on this side of a bound or on that one, despite jitter.
            rig.wait(lambda: _newest_age(rig, phase, counts) >= LULL)
            early = {s.name for s in SENSORS if rig.consumed_indices(s, phase)}
            resumed = time.time_ns()
            jammed = let_go()
    if jammed:
        for stream in streams.values():
            stream.stop()
        return None
    # All but the events go on, as on a robot.
    for sensor in SENSORS:
        _drain_consumer(rig, sensor, phase, counts[sensor.name], streams.values())

    def left(sensor: Sensor) -> Backlog:
        name = sensor.name
        return _make_backlog(
            rig, sensor, phase, counts[name], published[name], resumed, name in early
        )

    # What is decided is not watched any longer, and no more of it comes in.
    open_ones = [s for s in SENSORS if s is not STOP and not _is_decided(rig, left(s))]
    for sensor in SENSORS:
        if sensor in open_ones:
            streams[sensor.name].keep_rate()
        else:
            streams[sensor.name].stop()
    pursuits = watch_consumers(rig, open_ones, phase, resumed, lambda s: streams[s.name].stop())
    for stream in streams.values():
        stream.stop()
    found = {s.name: left(s) for s in SENSORS}
    for name, pursuit in pursuits.items():
        found[name] = replace(found[name], behind=pursuit.behind, omits=pursuit.omits)
    return found


def _is_decided(rig: SensorRig, found: Backlog) -> bool:
    return found.is_decided or find_thinning(rig, found.sensor) is not None


def _make_backlog(
    rig: SensorRig,
    sensor: Sensor,
    phase: str,
    count: int,
    published: set[int],
    resumed: int,
    early: bool,
) -> Backlog:
    """Return what has become of a sensor's readings by now."""
    kept = rig.consumed_indices(sensor, phase)
    return Backlog(
        sensor,
        count=count,
        published=len(published),
        kept=kept,
        replayed=sum(number >= min(kept, default=0) for number in published),
        oldest=(resumed - rig.publication_time(sensor, phase, min(kept))) / 1e9 if kept else 0.0,
        early=early,
        expires=rig.can_expire(sensor),
        altered=sensor.topic in rig.node.altered,
        again=rig.comes_again() if sensor is STOP else 0,
    )


@contextmanager
def _hold_streams(streams: Iterable[Stream]) -> Iterator[None]:
    """Let nothing come in for the length of the block."""
    with ExitStack() as held:
        for stream in streams:
            held.enter_context(stream.hold_back())
        yield


def _newest_age(rig: SensorRig, phase: str, counts: Mapping[str, int]) -> float:
    """Return the age of the newest reading of all, in s since its publication."""
    newest = max(rig.publication_time(s, phase, counts[s.name] - 1) for s in SENSORS)
    return (time.time_ns() - newest) / 1e9


def _least_count(sensor: Sensor) -> int:
    if sensor is STOP:
        return EVENTS
    return int(sensor.rate * (IMU_PAUSE if sensor is IMU else PAUSE))


def _stream_limit(sensor: Sensor) -> int:
    return EVENTS if sensor is STOP else 2**31


def _published_numbers(rig: SensorRig, sensor: Sensor, phase: str, count: int) -> set[int]:
    """Return which of the first ``count`` readings went over the sensor's topic.

    Also the barrier: the last of them (or a later one, where a driver drops some) was seen on the
    wire, so the stalled reader has been sent all before it, too.
    """
    rig.wait(lambda: max(rig.witnessed_indices(sensor, phase), default=-1) >= count - 1)
    return {number for number in rig.witnessed_indices(sensor, phase) if number < count}


def _drain_consumer(
    rig: SensorRig, sensor: Sensor, phase: str, count: int, streams: Iterable[Stream]
) -> None:
    """Wait until the consumer has passed on the newest, for as long as it makes progress.

    One that leaves out what is too old may, on a busy machine, not get through what has piled up
    while more comes in: if nothing comes out, nothing comes in until it has.
    """
    newest = max((n for n in rig.witnessed_indices(sensor, phase) if n < count), default=-1)

    def is_out() -> bool:
        return max(rig.consumed_indices(sensor, phase), default=-1) >= newest

    passed = -1
    while passed < (now := len(rig.consumed_indices(sensor, phase))) and not rig.wait(is_out):
        passed = now
    if sensor is STOP:  # one that handles the newest first has lost nothing
        rig.wait_for_rest()
        rig.wait(lambda: len(set(rig.consumed_indices(sensor, phase))) >= count, PROMPT)
    elif not is_out():
        with _hold_streams(streams):
            rig.wait_for_rest(SETTLE_S)
        rig.wait(is_out)


def short_pause(rig: SensorRig) -> Burst:
    """Stall the consumer for as long as a burst of IMU readings takes, and see what it passes on.

    Tried again while readings are missing that a slow machine may have let grow old, or that the
    driver has lost.
    """
    for number in range(TRIES):
        patience = None if number == TRIES - 1 else PROMPT
        burst = _run_burst(rig, f"short pause {number}", patience)
        if burst.is_conclusive:
            break
    return burst


def _run_burst(rig: SensorRig, phase: str, patience: float | None) -> Burst:
    rig.wait_for_rest()  # what still waits for the consumer would be ahead of the burst
    with rig.keep_busy(CONSUMERS) as let_go:
        stream = Stream(rig.node, IMU, phase, BURST)
        published = len(_published_numbers(rig, IMU, phase, BURST))
        jammed = let_go()
    rig.wait(lambda: BURST - 1 in rig.consumed_indices(IMU, phase), patience)
    stream.stop()
    handed = dict(rig.handed_readings(IMU, phase)).get(BURST - 1)
    decided = _decision_time(rig, phase) if handed is None else handed
    rig.wait(lambda: len(set(rig.consumed_indices(IMU, phase))) == BURST, PROMPT)
    # One that hands on a reading again is heard out: how many there are is told.
    rig.wait_for_rest()
    aged = decided - rig.publication_time(IMU, phase, 0) > YOUNG * 1e9
    return Burst(rig.consumed_indices(IMU, phase), published, aged or jammed)


def _decision_time(rig: SensorRig, phase: str) -> int:
    """Return when (ns) the machine had come to all of a burst whose last reading is not out.

    That is the moment in which all is at rest; a subject that never rests is given more to do.
    """
    at_rest, moment = rig.is_at_rest(), time.time_ns()
    turned = _turns_later(rig, f"{phase}, later")
    return min(moment, turned) if at_rest else turned


def _turns_later(rig: SensorRig, phase: str) -> int:
    """Send readings one by one until one comes out; return when the machine had come to the burst.

    Once a later one has come out, all of the burst has been decided about. But a consumer that
    hands on few or none takes as long as it likes, so what tells of a slow machine is the driver:
    it shares a thread with the consumer, and after as many of its turns (ns) the consumer has had
    its own.
    """
    patience = rig.start_patience()
    number = 0
    while number < TURNS or not rig.consumed_indices(IMU, phase):
        if not patience.has_time_left() and number >= TURNS:
            break
        due = time.monotonic() + (0 if number < TURNS else 1 / IMU.rate)
        rig.node.publish(IMU, phase, number)
        rig.wait(partial(rig.is_taken, IMU, phase, number), LAG)
        # A list of the last 0.5 s, which a timer empties, would overflow if they came any faster.
        rig.wait(lambda due=due: time.monotonic() >= due)  # type: ignore[misc]
        number += 1
    return rig.publication_time(IMU, phase, TURNS - 1) or time.time_ns()
