"""What a consumer far away gets of the readings that it missed in a gap of the radio link.

Stop events and camera frames go out while the link is down, and one more frame when it is up again.
A reliable writer then tells its readers what they have missed (its heartbeat), and DDS hands over
in order: so once the last stop event is there, or the frame from after the gap, everything that
will ever come of the others is there, too. A stop event after the gap would push one of 100 out of
a queue that holds just these, or not, as the heartbeat comes before or after it.
"""

from __future__ import annotations

from autograder.examination.exam import Failed
from autograder.exercises.qos.readings import CAMERA, STOP, Sensor, SensorRig
from autograder.exercises.qos.single_readings import find_prompt
from autograder.observe.examiner.radio_link import open_radio_link
from autograder.observe.relays.arrivals import Arrivals
from autograder.observe.relays.endpoint_qos import (
    is_reliable,
    lossless_profile,
    undemanding_profile,
)

LOST = {STOP: 100, CAMERA: 5}
"""Readings sent while the link is down: as many stop events as the task promises to keep."""
LAST = {STOP: LOST[STOP] - 1, CAMERA: LOST[CAMERA]}
"""The reading with which all have come that will: of the gap, or the one after it."""
SERIES = "gap"


def lose_readings(rig: SensorRig) -> dict[Sensor, list[int]]:
    """Let the link break down while readings come in, and return what the far end gets of them.

    The last one of the gap may have got through: a driver sends a reading to one listener after the
    other, and it was seen at the near end. Who heard nothing, not even before the gap, is left out.
    """
    heard = {sensor: Arrivals() for sensor in LOST if sensor in find_prompt(rig)}
    # The far consumer of pictures asks for what the student's own asks for.
    asks_reliable = all(map(is_reliable, rig.paths[CAMERA].find_ends().subscriptions))
    with open_radio_link(rig.bench) as link:
        for sensor, arrivals in heard.items():
            reliable = sensor is STOP or asks_reliable
            profile = lossless_profile() if reliable else undemanding_profile()
            rig.paths[sensor].listen(sensor.topic, profile, arrivals, on=link.node)
        for deaf in rig.probe(heard):
            del heard[deaf]
        with link.lose_packets():
            for sensor in heard:
                rig.send_burst(sensor, SERIES, LOST[sensor])  # seen at the near end: all are out
            for sensor, arrivals in heard.items():
                _require_none_yet(sensor, arrivals.numbers(SERIES))
        if CAMERA in heard:
            rig.paths[CAMERA].send(SERIES, LAST[CAMERA])
        rig.wait(lambda: all(LAST[s] in there.numbers(SERIES) for s, there in heard.items()))
        return {sensor: arrivals.numbers(SERIES) for sensor, arrivals in heard.items()}


def _require_none_yet(sensor: Sensor, got: list[int]) -> None:
    """Fail if readings of the gap are at the far end, to which no packet got since they were made.

    Somebody has published them who knew what they would be.
    """
    if got:
        raise Failed(
            expected=f"On {sensor.topic} comes what the hardware has delivered, and nothing "
            "before it was.",
            actual=f"{len(got)} of its readings that were still to come, or were lost on the "
            "way, were there already: does something in the notebook make up readings?",
        )


def require_heard(heard: dict[Sensor, list[int]], sensor: Sensor, expected: str) -> list[int]:
    """Return what the far end got of a sensor's readings; fail if it never heard any."""
    if sensor not in heard:
        raise Failed(
            expected=expected,
            actual="A consumer at the far end of the link heard nothing, not even before the gap.",
        )
    return heard[sensor]
