"""The experiment of a slow reader: what is left for a consumer that was busy for a while.

Depth and history of a queue cannot be read from the ROS graph: they show in what comes out of it.
"""

from __future__ import annotations

from autograder.exam import Failed
from autograder.rigs.sensors import (
    CAMERA,
    CONSUMERS,
    IMU,
    LIDAR,
    SENSORS,
    STOP,
    Sensor,
    SensorRig,
    indices,
)

STALL = 60  # readings sent to each sensor while the consumer is busy
STREAM = 1.5  # s that readings come in at their own rates instead, where they expire

Stalled = dict[str, tuple[int, list[int]]]
"""By sensor: how many readings came in during the pause, and which the consumer then passed on."""


def busy_consumer(rig: SensorRig) -> Stalled:
    """Stall the consumer, feed every sensor, let it go on, and see what it then passes on.

    The barrier is a last emergency stop: it takes the same road into the subject as everything
    before it, so once it is seen on the wire the stalled readers have received all they will.
    """
    rig.subject.pause(CONSUMERS)
    counts = _feed(rig)
    for sensor in SENSORS:
        if not rig.seen(sensor, "stall", counts[sensor.name]):
            raise Failed(
                expected=f"The driver publishes each {sensor.name} reading that comes in.",
                actual=f"After {len(set(indices(rig.node.witnessed, sensor, 'stall')))} of "
                f"{counts[sensor.name]} it fell silent.",
            )
    rig.burst(STOP, "barrier", 1)
    rig.subject.resume(CONSUMERS)
    for sensor in SENSORS:
        last = counts[sensor.name] - 1
        rig.wait(lambda s=sensor, n=last: n in rig.consumed(s, "stall"))  # type: ignore[misc]
    return {s.name: (counts[s.name], rig.consumed(s, "stall")) for s in SENSORS}


def _feed(rig: SensorRig) -> dict[str, int]:
    """Send each sensor's readings for a pause; return how many.

    All at once, which is quick and the same on every machine; but where readings expire, age is
    what the design rests on, and they come at the sensors' own rates.
    """
    counts = {sensor.name: STALL for sensor in SENSORS}
    if not rig.expires():
        for sensor in SENSORS:
            rig.node.send(sensor, "stall", STALL)
        return counts
    counts |= {s.name: int(s.rate * STREAM) for s in (CAMERA, LIDAR, IMU)}  # all end together
    streams = [rig.node.stream(sensor, "stall", counts[sensor.name]) for sensor in SENSORS]
    rig.wait(lambda: all(complete() for complete in streams))
    return counts


def require_kept(rig: SensorRig, sensor: Sensor, least: int, most: int, expected: str) -> None:
    """Fail unless the consumer then acts on the newest readings: ``least`` to ``most`` of them."""
    stalled: Stalled = rig.once(busy_consumer)
    count, kept = stalled[sensor.name]
    if count - 1 not in kept:
        actual = f"Of {count} readings in a pause the newest never came out: it got {few(kept)}."
    elif min(kept) < count - most:
        actual = f"It then worked through the last {count - min(kept)} of {count} readings."
    elif missing := [index for index in range(count - least, count) if index not in kept]:
        actual = f"Of the last {least} of {count} readings {len(missing)} were lost."
    elif kept != sorted(kept):
        actual = f"It passed them on out of order: {few(kept)}."
    else:
        return
    raise Failed(expected=expected, actual=actual)


def few(numbers: list[int]) -> str:
    """Return the first of some reading numbers, as a phrase."""
    shown = ", ".join(str(n) for n in numbers[:6])
    return f"readings {shown}{' …' if len(numbers) > 6 else ''}" if numbers else "nothing at all"
