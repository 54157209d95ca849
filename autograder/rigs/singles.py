"""Readings that come in one by one: whether a driver publishes each of them, and at once.

One of each sensor is sent at a time, the next when all are seen on their topics. So each finds the
driver idle, and whatever keeps a reading back is the driver's own doing.
"""

from __future__ import annotations

from autograder.exam import Failed
from autograder.rigs.readings import SENSORS, Sensor
from autograder.rigs.sensor_node import LAG
from autograder.rigs.sensors import SETTLE, SensorRig

SINGLES = 16
AT_ONCE = 0.15
"""Seconds from the hardware to the topic: the task says 0.1."""
SLOW = 12  # of the singles that must have taken longer: the others may just have been lucky
FORGIVEN = 1  # single that may be missing: a best-effort link may have lost it
_PHASE = "single"


def require_each_at_once(rig: SensorRig) -> None:
    """Fail if a driver keeps a reading back until the next one comes, or for some time."""
    for sensor in _one_by_one(rig):
        raise Failed(
            expected="The drivers publish each reading as soon as the hardware delivers it.",
            actual=f"One more {sensor.name} reading came in, and it was not published on "
            f"{sensor.topic}: does the driver wait for the next one?",
        )
    for sensor in SENSORS:
        times = sorted(_times(rig, sensor))
        if len(times) >= SLOW and (least := times[-SLOW]) > AT_ONCE:
            raise Failed(
                expected="The drivers publish each reading as soon as the hardware delivers it, "
                "within 0.1 s.",
                actual=f"{len(times)} {sensor.name} readings came in one by one, and {SLOW} of "
                f"them were published on {sensor.topic} {least:.2f} s later or more: what does the "
                "driver wait for?",
            )


def _one_by_one(rig: SensorRig) -> list[Sensor]:
    """Send the singles; return the sensors of which two running were not published by themselves.

    A sensor that has missed more than may be is left alone.
    """
    missed: dict[str, list[int]] = {sensor.name: [] for sensor in SENSORS}
    for index in range(SINGLES):
        sensors = [s for s in SENSORS if len(missed[s.name]) <= FORGIVEN]
        for sensor in sensors:
            rig.node.publish(sensor, _PHASE, index)
        rig.wait(lambda i=index, left=sensors: not _unseen(rig, left, i), LAG)  # type: ignore[misc]
        for sensor in _unseen(rig, sensors, index):
            missed[sensor.name].append(index)
    running = {s: m[-1] for s in SENSORS if len(m := missed[s.name]) > 1 and m[-1] - m[-2] == 1}
    # Perhaps it was the machine that did not come to it.
    rig.wait(lambda: not any(_unseen(rig, [s], last) for s, last in running.items()), SETTLE / 2)
    return [s for s, last in running.items() if _unseen(rig, [s], last)]


def _unseen(rig: SensorRig, sensors: list[Sensor], index: int) -> list[Sensor]:
    return [sensor for sensor in sensors if index not in rig.witnessed(sensor, _PHASE)]


def _times(rig: SensorRig, sensor: Sensor) -> list[float]:
    """Return how long each single took from the hardware to its topic, in s."""
    sent = rig.sent(sensor, _PHASE)
    published = rig.publications(sensor, _PHASE)
    return [(when - sent[number]) / 1e9 for number, when in published.items() if number in sent]


def thinned(rig: SensorRig, sensor: Sensor) -> tuple[int, int] | None:
    """Return how many singles came in, and how many of them were published; None if enough."""
    sent, seen = rig.sent(sensor, _PHASE), set(rig.witnessed(sensor, _PHASE))
    return (len(sent), len(seen)) if len(sent) - len(seen) > FORGIVEN else None
