"""Readings that come in one by one: whether a driver publishes each of them, and at once."""

from __future__ import annotations

from functools import partial

from autograder.examination.exam import Failed
from autograder.exercises.qos.readings import Sensor, SensorRig
from autograder.observe.relays.relay_latency import RelayLatency, send_one_by_one

AT_ONCE_S = 0.15
"""From the hardware to the topic: the task says 0.1."""
SERIES = "single"


def send_singles(rig: SensorRig) -> dict[Sensor, RelayLatency]:
    """Send readings of each sensor that flow one by one, and return what became of them."""
    singles = {
        sensor: RelayLatency(
            partial(path.send, SERIES), path.sent, path.published, SERIES, AT_ONCE_S
        )
        for sensor, path in rig.paths.items()
        if sensor not in rig.find_silences()
    }
    send_one_by_one(rig, list(singles.values()), AT_ONCE_S)
    return singles


def find_prompt(rig: SensorRig) -> list[Sensor]:
    """Return the sensors whose readings flow, and at once: only of these more can be seen."""
    singles = rig.run_once(send_singles)
    return [sensor for sensor, one in singles.items() if not (one.keeps_back or one.is_slow)]


def require_published_at_once(rig: SensorRig, sensor: Sensor) -> None:
    """Fail if a driver keeps a reading back until the next one comes, or for some time."""
    single = rig.run_once(send_singles)[sensor]
    expected = "The drivers publish each reading as soon as the hardware delivers it"
    if single.keeps_back:
        raised = rig.error_note()
        why = f"{raised}." if raised else ": does the driver wait for the next one?"
        raise Failed(
            expected=f"{expected}.",
            actual=f"One more {sensor} reading came in, and it was not published on "
            f"{sensor.topic}{why}",
        )
    if single.is_slow:
        late_s = single.late_times_s
        raise Failed(
            expected=f"{expected}, within 0.1 s.",
            actual=f"{single.counts[1]} {sensor} readings came in one by one, and {len(late_s)} of "
            f"them were published on {sensor.topic} {min(late_s):.2f} s later or more: what does "
            "the driver wait for?",
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
