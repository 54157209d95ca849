"""Readings that come in one by one: whether a driver publishes each of them, and at once."""

from __future__ import annotations

from functools import partial

from autograder.examination.exam import Failed
from autograder.exercises.qos.readings import SENSORS, Sensor, SensorRig
from autograder.observe.relays.relay_latency import RelayLatency, send_one_by_one

AT_ONCE_S = 0.15
"""From the hardware to the topic: the task says 0.1."""
SERIES = "single"


def send_singles(rig: SensorRig) -> dict[Sensor, RelayLatency]:
    """Send readings of each sensor one by one, and return what became of them."""
    singles = {
        sensor: RelayLatency(
            partial(path.send, SERIES), path.sent, path.published, SERIES, AT_ONCE_S
        )
        for sensor, path in rig.paths.items()
    }
    send_one_by_one(rig, list(singles.values()), AT_ONCE_S)
    return singles


def require_published_at_once(rig: SensorRig) -> None:
    """Fail if a driver keeps a reading back until the next one comes, or for some time."""
    singles = rig.run_once(send_singles)
    expected = "The drivers publish each reading as soon as the hardware delivers it"
    for sensor in SENSORS:
        if singles[sensor].keeps_back:
            raised = rig.error_note()
            why = f"{raised}." if raised else ": does the driver wait for the next one?"
            raise Failed(
                expected=f"{expected}.",
                actual=f"One more {sensor} reading came in, and it was not published on "
                f"{sensor.topic}{why}",
            )
    for sensor in SENSORS:
        if singles[sensor].is_slow:
            late_s = singles[sensor].late_times_s
            raise Failed(
                expected=f"{expected}, within 0.1 s.",
                actual=f"{singles[sensor].counts[1]} {sensor} readings came in one by one, "
                f"and {len(late_s)} of them were published on {sensor.topic} {min(late_s):.2f} s "
                "later or more: what does the driver wait for?",
            )


def require_each_published(rig: SensorRig, sensor: Sensor) -> None:
    """Fail if the driver has changed a reading, or has left out some of those that came alone."""
    require_unaltered(rig, sensor)
    single = rig.run_once(send_singles)[sensor]
    if single.is_thinned:
        came, went = single.counts
        raise Failed(
            expected=f"The driver publishes each {sensor} reading as it comes in.",
            actual=f"Of {came} that came in, {went} went over {sensor.topic}{rig.error_note()}.",
        )


def require_unaltered(rig: SensorRig, sensor: Sensor) -> None:
    """Fail if the driver has changed the content of a reading."""
    if sensor.topic in rig.paths[sensor].altered:
        raise Failed(
            expected="The drivers publish each reading with its content unchanged.",
            actual=f"The {sensor} readings on {sensor.topic} are not what {sensor.source} "
            "delivered: something in the message was changed or left out.",
        )
