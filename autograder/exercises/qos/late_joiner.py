"""What nodes that start late are handed of a sensor's past."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

from rclpy.qos import DurabilityPolicy

from autograder.examination.exam import Failed
from autograder.exercises.qos.readings import Heard, Sensor
from autograder.exercises.qos.rig import DRIVERS, SensorRig
from autograder.exercises.qos.sensor_examiner import lossless_profile, undemanding_profile

BEFORE = 5  # readings of each sensor
REPEATED = 0.3  # s in which a driver that repeats its last reading shows itself


def require_no_past(rig: SensorRig, sensors: Sequence[Sensor]) -> None:
    """Fail if late readers hear anything, one that asks for the past, and one that does not.

    Nothing is sent once they have begun: all that they hear is old, from whichever check.
    """
    for sensor in sensors:
        rig.send_burst(sensor, "before", BEFORE)
    known = _count_readers(rig, sensors)
    asking: Heard = defaultdict(list)
    plain: Heard = defaultdict(list)
    refused: dict[str, list[object]] = {sensor.name: [] for sensor in sensors}
    with rig.node.temporary_listeners():
        for sensor in sensors:
            profile = lossless_profile(DurabilityPolicy.TRANSIENT_LOCAL)
            rig.node.listen(sensor, sensor.topic, profile, asking, refused[sensor.name].append)
            rig.node.listen(sensor, sensor.topic, undemanding_profile(), plain)
        # Either DDS refuses to hand out the past, or the writer replays it at once.
        rig.wait(lambda: all(refused[s.name] or asking[s.name] for s in sensors))
        # A driver of which each reader is known has its chance to greet it, until all is at rest.
        rig.wait(lambda: all(n >= known[t] + 2 for t, n in _count_readers(rig, sensors).items()))
        rig.wait_for_rest()
        rig.wait(lambda: any(plain.values()), REPEATED)
    for sensor in sensors:
        if asking[sensor.name] and not plain[sensor.name]:
            raise Failed(
                expected=f"A late reader of {sensor.topic} gets new readings only, even if it asks "
                "for the past (TRANSIENT_LOCAL).",
                actual=f"It was handed {sensor.name} readings from before it started.",
            )
        if plain[sensor.name]:
            raise Failed(
                expected=f"A late reader of {sensor.topic} gets new readings only.",
                actual=f"It was handed {sensor.name} readings from before it started, though it "
                "did not ask for any: does the driver publish a reading again?",
            )


def _count_readers(rig: SensorRig, sensors: Sequence[Sensor]) -> dict[str, int]:
    """Return how many subscriptions to each topic the driver's process knows of."""
    topics = [f"/{sensor.topic}" for sensor in sensors]
    return rig.subject.sees(DRIVERS, {"subscribers": topics})["subscribers"]
