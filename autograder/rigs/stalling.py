"""The experiment of a slow reader: what is left for a consumer that was busy for a while.

Depth and history of a queue cannot be read from the ROS graph: they show in what comes out of it.
Readings come in at the sensors' own rates, as on the robot, so that a design may rest on a queue's
depth, on a lifespan, or on the age of a reading.
"""

from __future__ import annotations

from dataclasses import dataclass

from autograder.exam import Failed
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


@dataclass(frozen=True)
class Backlog:
    """One sensor's readings: how many came in during the pause, and what became of them.

    ``published`` is how many of these the driver put on the topic. ``kept`` has the numbers in the
    order in which the consumer passed them on; those from ``count`` on came in after the pause.
    """

    count: int
    published: int
    kept: list[int]


def busy_consumer(rig: SensorRig) -> dict[str, Backlog]:
    """Stall the consumer while readings come in, let it go on, and see what it passes on."""
    rig.subject.pause(CONSUMERS)
    streams = {s.name: Stream(rig.node, s, "stall", _limit(s)) for s in SENSORS}
    rig.wait(lambda: all(stream.sent >= _least(stream.sensor) for stream in streams.values()), 60)
    # Camera and LIDAR go on, as on a robot. The IMU stops here: its last readings are counted.
    streams[IMU.name].stop()
    counts = {name: stream.sent for name, stream in streams.items()}
    published = {s.name: _published(rig, s, counts[s.name]) for s in SENSORS}
    rig.subject.resume(CONSUMERS)
    for sensor in SENSORS:
        _drain(rig, sensor, counts[sensor.name])
    for stream in streams.values():
        stream.stop()
    return {
        s.name: Backlog(counts[s.name], published[s.name], rig.consumed(s, "stall"))
        for s in SENSORS
    }


def _least(sensor: Sensor) -> int:
    return EVENTS if sensor is STOP else int(sensor.rate * PAUSE)


def _limit(sensor: Sensor) -> int:
    return EVENTS if sensor is STOP else 2**31


def _published(rig: SensorRig, sensor: Sensor, count: int) -> int:
    """Return how many of the first ``count`` readings went over the sensor's topic.

    Also the barrier: the last of them (or a later one, where a driver drops some) was seen on the
    wire, so the stalled reader has been sent all before it, too.
    """
    rig.wait(lambda: max(rig.witnessed(sensor, "stall"), default=-1) >= count - 1)
    return len({number for number in rig.witnessed(sensor, "stall") if number < count})


def _drain(rig: SensorRig, sensor: Sensor, count: int) -> None:
    """Wait until the consumer has passed on the newest, for as long as it makes progress."""
    passed = -1
    while passed < (now := len(rig.consumed(sensor, "stall"))):
        passed = now
        if rig.wait(lambda: max(rig.consumed(sensor, "stall"), default=-1) >= count - 1):
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
    if max(kept, default=-1) < count - 1:
        actual = f"Of {count} readings in a pause the newest never came out: it got {few(kept)}."
    elif min(kept) < count - most:
        actual = f"It then worked through the last {count - min(kept)} of {count} readings."
    elif missing := [number for number in range(count - least, count) if number not in kept]:
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
