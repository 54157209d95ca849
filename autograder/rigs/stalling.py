"""The experiments of a slow reader: what is left for a consumer that was busy for a while.

Depth and history of a queue cannot be read from the ROS graph: they show in what comes out of it.
Readings come in at the sensors' own rates, as on the robot, so that a design may rest on a queue's
depth, on a lifespan, or on the age of a reading. Two pauses are needed for that: a long one shows
what is too old, a short one what must not be lost, in so little time that nothing of it is old.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial

from autograder.exam import Failed, NotExaminable
from autograder.rigs.pursuit import Handing, left_behind
from autograder.rigs.readings import IMU, SENSORS, STOP, Sensor
from autograder.rigs.sensor_node import LAG, Stream
from autograder.rigs.sensors import CONSUMERS, SETTLE, SensorRig

PAUSE = 1.5  # s that the consumer is busy
EVENTS = 100  # stop events in that time
LULL = 0.06  # s without readings at its end: more than half of the time between two scans
THINNED = 0.8  # a driver that publishes less than this share of the readings drops some
BURST = 5  # IMU readings that come in while the consumer is busy for 50 ms
PROMPT, YOUNG = 0.15, 0.35
"""Seconds from the end of a short pause in which a burst comes out of an idle machine, and from
its first reading on in which it must: a design that goes by the age of a reading (0.5 s is old) may
rightly find a later one too old, and then it is the machine that is slow."""
TRIES = 8
TURNS = BURST + 2  # of a driver, after which a consumer has had one for each reading of a burst


@dataclass(frozen=True)
class Backlog:
    """One sensor's readings: how many came in during the pause, and what became of them.

    ``published`` is how many of these the driver put on the topic. ``kept`` has the numbers in the
    order in which the consumer passed them on; those from ``count`` on came in after the pause.
    ``oldest`` is how old the first of them was at the end of the pause, in s since its publication.
    ``early`` says that some came out while the consumer was held back, ``behind`` what it handed on
    when it had fallen far behind later on, if it did.
    """

    count: int
    published: int
    kept: list[int]
    oldest: float
    early: bool
    behind: Handing | None


@dataclass(frozen=True)
class Burst:
    """What a consumer passed on of a burst, in order; ``aged`` if a reading may have got old."""

    kept: list[int]
    aged: bool

    @property
    def missing(self) -> int:
        """How many readings were lost."""
        return BURST - len(set(self.kept))


def busy_consumer(rig: SensorRig) -> dict[str, Backlog]:
    """Stall the consumer while readings come in, let it go on, and see what it passes on."""
    phase = "long pause"
    rig.subject.pause(CONSUMERS)
    streams = {s.name: Stream(rig.node, s, phase, _limit(s)) for s in SENSORS}
    rig.wait(lambda: all(stream.sent >= _least(stream.sensor) for stream in streams.values()), 60)
    with ExitStack() as held:
        for stream in streams.values():
            held.enter_context(stream.held())
            stream.spare()
        counts = {name: stream.sent for name, stream in streams.items()}
        published = {s.name: _published(rig, s, phase, counts[s.name]) for s in SENSORS}
        # So that a reading is clearly on this side of a bound or on that one, whatever the jitter.
        rig.wait(lambda: _youngest(rig, phase, counts) >= LULL)
        early = {s.name for s in SENSORS if rig.consumed(s, phase)}
        resumed = time.time_ns()
        rig.subject.resume(CONSUMERS)
    # All but the events go on, as on a robot.
    for sensor in SENSORS:
        _drain(rig, sensor, phase, counts[sensor.name])
    for sensor in SENSORS:
        if sensor is not STOP:
            streams[sensor.name].insist()
    behind = left_behind(rig, phase, resumed)
    for stream in streams.values():
        stream.stop()
    found = {}
    for s in SENSORS:
        kept = rig.consumed(s, phase)
        oldest = (resumed - rig.published(s, phase, min(kept))) / 1e9 if kept else 0.0
        found[s.name] = Backlog(
            counts[s.name], published[s.name], kept, oldest, s.name in early, behind.get(s.name)
        )
    return found


def _youngest(rig: SensorRig, phase: str, counts: Mapping[str, int]) -> float:
    """Return the age of the newest reading of all, in s since its publication."""
    newest = max(rig.published(s, phase, counts[s.name] - 1) for s in SENSORS)
    return (time.time_ns() - newest) / 1e9


def _least(sensor: Sensor) -> int:
    return EVENTS if sensor is STOP else int(sensor.rate * PAUSE)


def _limit(sensor: Sensor) -> int:
    return EVENTS if sensor is STOP else 2**31


def _published(rig: SensorRig, sensor: Sensor, phase: str, count: int) -> int:
    """Return how many of the first ``count`` readings went over the sensor's topic.

    Also the barrier: the last of them (or a later one, where a driver drops some) was seen on the
    wire, so the stalled reader has been sent all before it, too.
    """
    rig.wait(lambda: max(rig.witnessed(sensor, phase), default=-1) >= count - 1)
    return len({number for number in rig.witnessed(sensor, phase) if number < count})


def _drain(rig: SensorRig, sensor: Sensor, phase: str, count: int) -> None:
    """Wait until the consumer has passed on the newest, for as long as it makes progress."""
    newest = max((n for n in rig.witnessed(sensor, phase) if n < count), default=-1)
    passed = -1
    while passed < (now := len(rig.consumed(sensor, phase))):
        passed = now
        if rig.wait(lambda: max(rig.consumed(sensor, phase), default=-1) >= newest):
            break
    if sensor is STOP:  # one that handles the newest first has lost nothing
        rig.wait(lambda: len(set(rig.consumed(sensor, phase))) >= count, PROMPT)


def short_pause(rig: SensorRig) -> Burst:
    """Stall the consumer for as long as a burst of IMU readings takes, and see what it passes on.

    Tried again while readings are missing that a slow machine may have let grow old.
    """
    for number in range(TRIES):
        patience = SETTLE if number == TRIES - 1 else PROMPT
        burst = _burst(rig, f"short pause {number}", patience)
        if not (burst.missing and burst.aged):
            break
    return burst


def _burst(rig: SensorRig, phase: str, patience: float) -> Burst:
    rig.subject.pause(CONSUMERS)
    stream = Stream(rig.node, IMU, phase, BURST)
    _published(rig, IMU, phase, BURST)
    rig.subject.resume(CONSUMERS)
    rig.wait(lambda: BURST - 1 in rig.consumed(IMU, phase), patience)
    stream.stop()
    handed = dict(rig.handed(IMU, phase)).get(BURST - 1)
    decided = _turns_later(rig, f"{phase}, later") if handed is None else handed
    rig.wait(lambda: len(set(rig.consumed(IMU, phase))) == BURST, PROMPT)
    return Burst(rig.consumed(IMU, phase), decided - rig.published(IMU, phase, 0) > YOUNG * 1e9)


def _turns_later(rig: SensorRig, phase: str) -> int:
    """Send readings one by one until one comes out; return when the machine had come to the burst.

    Once a later one has come out, all of the burst has been decided about. But a consumer that
    hands on few or none takes as long as it likes, so what tells of a slow machine is the driver:
    it shares a thread with the consumer, and after as many of its turns (ns) the consumer has had
    its own.
    """
    deadline = time.monotonic() + SETTLE
    number = 0
    while number < TURNS or not (rig.consumed(IMU, phase) or time.monotonic() > deadline):
        rig.node.publish(IMU, phase, number)
        rig.wait(partial(rig.taken, IMU, phase, number), LAG)
        number += 1
    return rig.published(IMU, phase, TURNS - 1) or time.time_ns()


def backlog(rig: SensorRig, sensor: Sensor) -> Backlog:
    """Return what became of one sensor's readings.

    Fail if the driver keeps readings back, or if the consumer cannot be held back.
    """
    backlogs: dict[str, Backlog] = rig.once(busy_consumer)
    found = backlogs[sensor.name]
    if found.early:
        raise Failed(
            expected="Only callbacks of your consumer, which ROS 2 calls, hand readings on.",
            actual="Your consumer went on while its callbacks were held back: does a thread, or "
            "another executor, do its work?",
        )
    if found.published < (found.count if sensor is STOP else (found.count - 1) * THINNED):
        raise Failed(
            expected=f"The driver publishes each {sensor.name} reading as it comes in.",
            actual=f"Of {found.count} that came in, {found.published} went over {sensor.topic}.",
        )
    return found


def require_fresh(rig: SensorRig, sensor: Sensor, expected: str) -> None:
    """Fail unless the consumer goes on with the newest after a long pause, and keeps up then."""
    found = backlog(rig, sensor)
    count, kept, most = found.count, found.kept, sensor.most
    if max(kept, default=-1) < count - 1:
        actual = f"Of {count} readings in a pause the newest never came out: it got {few(kept)}."
    elif min(kept) < count - most and found.oldest > most / sensor.rate:
        actual = f"It then worked through the last {count - min(kept)} of {count} readings."
    elif kept != sorted(kept):
        actual = f"It passed them on out of order: {few(kept)}."
    elif found.behind is not None:
        actual = (
            f"Afterwards it fell further and further behind: while readings came in at "
            f"{sensor.rate:.0f} Hz, it handed on one that was {found.behind.age:.1f} s old, and "
            f"{found.behind.waiting} newer ones were waiting."
        )
    else:
        return
    raise Failed(expected=expected, actual=actual)


def require_burst(rig: SensorRig, expected: str) -> None:
    """Fail unless the consumer passes on every IMU reading of a short pause, in order."""
    found: Burst = rig.once(short_pause)
    if found.missing and found.aged:
        raise NotExaminable(
            "This machine was too busy to tell a short queue from readings that had grown old. A "
            "person will look at it."
        )
    if found.missing:
        passed = BURST - found.missing
        actual = (
            f"Of {BURST} readings that came in while it was busy {lost(found.missing)}, "
            f"{passed or 'none'} {'were' if passed > 1 else 'was'} passed on."
        )
    elif found.kept != sorted(found.kept):
        actual = f"It passed them on out of order: {few(found.kept)}."
    else:
        return
    raise Failed(expected=expected, actual=actual)


def lost(number: int, of: int = 0) -> str:
    """Return a phrase such as "1 was lost", or "2 of 7 were lost"."""
    return f"{number}{f' of {of}' if of else ''} {'was' if number == 1 else 'were'} lost"


def few(numbers: list[int]) -> str:
    """Return the first of some reading numbers, as a phrase."""
    if not numbers:
        return "nothing at all"
    shown = ", ".join(str(number) for number in numbers[:6])
    some = "reading" if len(numbers) == 1 else "readings"
    return f"{some} {shown}{' …' if len(numbers) > 6 else ''}"
