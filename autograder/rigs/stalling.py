"""The experiment of a slow reader: what is left for a consumer that was busy for a while.

Depth and history of a queue cannot be read from the ROS graph: they show in what comes out of it.
Readings come in at the sensors' own rates, as on the robot, so that a design may rest on a queue's
depth, on a lifespan, or on the age of a reading.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

from autograder.exam import Failed, NotExaminable
from autograder.rigs.sensors import (
    CONSUMERS,
    IMU,
    SENSORS,
    STOP,
    Sensor,
    SensorRig,
    Stream,
)

PAUSE = 1.5  # s that the consumer is busy
EVENTS = 100  # stop events in that time
THINNED = 0.8  # a driver that publishes less than this share of the readings drops some
IMU_BURST = 5  # readings that come in while the consumer is busy for 50 ms
TRIES = 4
LATE = 0.2
"""Seconds from the last IMU reading to the end of the pause, beyond which a design that goes by the
age of a reading (0.5 s is old) may rightly find it too old: then it is the machine that is slow."""


@dataclass(frozen=True)
class Backlog:
    """One sensor's readings: how many came in during the pause, and what became of them.

    ``published`` is how many of these the driver put on the topic. ``kept`` has the numbers in the
    order in which the consumer passed them on; those from ``count`` on came in after the pause,
    which ended ``late`` seconds after the last IMU reading.
    """

    count: int
    published: int
    kept: list[int]
    late: float

    def missing(self, least: int) -> list[int]:
        """Return which of the last ``least`` readings the consumer did not pass on."""
        return [n for n in range(self.count - least, self.count) if n not in self.kept]


def busy_consumer(rig: SensorRig) -> dict[str, Backlog]:
    """Stall the consumer while readings come in, let it go on, and see what it passes on."""
    backlogs: dict[str, Backlog] = {}
    for number in range(TRIES):
        backlogs = _stall(rig, f"stall {number}")
        imu = backlogs[IMU.name]
        if imu.late <= LATE or not imu.missing(IMU_BURST):
            break
    return backlogs


def _stall(rig: SensorRig, phase: str) -> dict[str, Backlog]:
    rig.subject.pause(CONSUMERS)
    streams = {s.name: Stream(rig.node, s, phase, _limit(s)) for s in SENSORS}
    rig.wait(lambda: all(stream.sent >= _least(stream.sensor) for stream in streams.values()), 60)
    # Camera and LIDAR go on, as on a robot. The IMU stops here, and last: its last readings are
    # counted, and must not grow old meanwhile.
    others = [sensor for sensor in SENSORS if sensor is not IMU]
    counts = {s.name: streams[s.name].sent for s in others}
    published = {s.name: _published(rig, s, phase, counts[s.name]) for s in others}
    streams[IMU.name].stop()
    stopped = time.monotonic()
    counts[IMU.name] = streams[IMU.name].sent
    published[IMU.name] = _published(rig, IMU, phase, counts[IMU.name])
    rig.subject.resume(CONSUMERS)
    late = time.monotonic() - stopped
    for sensor in SENSORS:
        _drain(rig, sensor, phase, counts[sensor.name])
    for stream in streams.values():
        stream.stop()
    return {
        s.name: Backlog(counts[s.name], published[s.name], rig.consumed(s, phase), late)
        for s in SENSORS
    }


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
    passed = -1
    while passed < (now := len(rig.consumed(sensor, phase))):
        passed = now
        if rig.wait(lambda: max(rig.consumed(sensor, phase), default=-1) >= count - 1):
            return


def backlog(rig: SensorRig, sensor: Sensor) -> Backlog:
    """Return what became of one sensor's readings; fail if the driver keeps readings back."""
    backlogs: dict[str, Backlog] = rig.once(busy_consumer)
    found = backlogs[sensor.name]
    if found.published < (found.count if sensor is STOP else (found.count - 1) * THINNED):
        raise Failed(
            expected=f"The driver publishes each {sensor.name} reading as it comes in.",
            actual=f"Of {found.count} that came in, {found.published} went over {sensor.topic}.",
        )
    return found


def require_kept(rig: SensorRig, sensor: Sensor, least: int, most: int, expected: str) -> None:
    """Fail unless the consumer then acts on the newest readings: ``least`` to ``most`` of them."""
    found = backlog(rig, sensor)
    count, kept = found.count, found.kept
    if sensor is IMU and found.late > LATE and found.missing(least):
        raise NotExaminable(
            "This machine was too busy to tell a short queue from readings that had grown old. A "
            "person will look at it."
        )
    if max(kept, default=-1) < count - 1:
        actual = f"Of {count} readings in a pause the newest never came out: it got {few(kept)}."
    elif min(kept) < count - most:
        actual = f"It then worked through the last {count - min(kept)} of {count} readings."
    elif missing := found.missing(least):
        actual = f"Of the last {least} of {count} readings {len(missing)} were lost."
    elif kept != sorted(kept):
        actual = f"It passed them on out of order: {few(kept)}."
    else:
        return
    raise Failed(expected=expected, actual=actual)


def few(numbers: list[int]) -> str:
    """Return the first of some reading numbers, as a phrase."""
    shown = ", ".join(str(number) for number in numbers[:6])
    return f"readings {shown}{' …' if len(numbers) > 6 else ''}" if numbers else "nothing at all"
