"""The experiment of a radio gap: what a consumer far away gets of the readings that it missed.

Stop events and camera frames go out while the link is down, and one more frame when it is up again.
A reliable writer then tells its readers what they have missed (its heartbeat), and DDS hands over
in order: so once the last stop event is there, or the frame from after the gap, everything that
will ever come of the others is there, too. A stop event after the gap would push one of 100 out of
a queue that holds just these, or not, as the heartbeat comes before or after it.
"""

from __future__ import annotations

from dataclasses import dataclass

from rclpy.qos import ReliabilityPolicy

from autograder.examination.exam import Failed
from autograder.exercises.qos.radio_link import open_radio
from autograder.exercises.qos.readings import CAMERA, STOP, Heard, Sensor
from autograder.exercises.qos.rig import SensorRig
from autograder.exercises.qos.sensor_examiner import lossless_profile, undemanding_profile

LOST = {STOP.name: 100, CAMERA.name: 5}
"""Readings sent while the link is down: as many stop events as the task promises to keep."""
LAST = {STOP.name: LOST[STOP.name] - 1, CAMERA.name: LOST[CAMERA.name]}
"""The reading with which all have come that will: of the gap, or the one after it."""


@dataclass(frozen=True)
class Aftermath:
    """What the far end heard of one sensor after the gap, in order; ``None``: nothing before it.

    Numbers below ``count`` were sent during the gap, a frame ``count`` right after it. The last one
    of the gap, ``count - 1``, may also have got through: a driver sends a reading to one listener
    after the other, and it was seen at the near end.
    """

    count: int
    heard: list[int] | None


def radio_gap(rig: SensorRig) -> dict[str, Aftermath]:
    """Let the link break down while readings come in, and see what the far end gets of them."""
    with open_radio(rig.bench, rig.node) as link:
        link.listen(STOP, lossless_profile())
        # The far consumer of pictures asks for what the student's own asks for.
        asks_reliable = all(
            end.qos_profile.reliability == ReliabilityPolicy.RELIABLE
            for end in rig.find_subscriptions(CAMERA.topic)
        )
        link.listen(CAMERA, lossless_profile() if asks_reliable else undemanding_profile())
        deaf = [sensor.name for sensor in rig.probe((STOP, CAMERA), link.heard)]
        sensors = [sensor for sensor in (STOP, CAMERA) if sensor.name not in deaf]
        with link.lose_packets():
            for sensor in sensors:
                # Seen at the near end: the driver has sent them all.
                rig.send_burst(sensor, "gap", LOST[sensor.name])
            _require_silence(rig, link.heard)
        if CAMERA in sensors:
            rig.node.publish(CAMERA, "gap", LAST[CAMERA.name])
        return {
            sensor.name: Aftermath(
                LOST[sensor.name],
                None if sensor.name in deaf else _heard_after(rig, sensor, link.heard),
            )
            for sensor in (STOP, CAMERA)
        }


def _require_silence(rig: SensorRig, heard: Heard) -> None:
    """Fail if readings of the gap are at the far end, to which no packet got since they were made.

    Somebody has published them who knew what they would be.
    """
    for sensor in (STOP, CAMERA):
        if got := rig.heard_indices(heard, sensor, "gap"):
            raise Failed(
                expected=f"On {sensor.topic} comes what the hardware has delivered, and nothing "
                "before it was.",
                actual=f"{len(got)} of its readings that were still to come, or were lost on the "
                "way, were there already: does something in the notebook make up readings?",
            )


def _heard_after(rig: SensorRig, sensor: Sensor, heard: Heard) -> list[int]:
    rig.wait(lambda: LAST[sensor.name] in rig.heard_indices(heard, sensor, "gap"))
    return rig.heard_indices(heard, sensor, "gap")
