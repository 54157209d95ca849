"""The experiment of a radio gap: what a consumer far away gets of the readings that it missed.

Stop events and camera frames go out while the link is down, one more of each when it is up again.
That one also tells a reliable reader what it has missed (its heartbeat), and DDS hands over in
order: so once it is there, everything that will ever come of the others is there, too.
"""

from __future__ import annotations

from dataclasses import dataclass

from rclpy.qos import ReliabilityPolicy

from autograder.rigs.radio import radio
from autograder.rigs.readings import CAMERA, STOP, Heard, Sensor
from autograder.rigs.sensor_node import lossless, undemanding
from autograder.rigs.sensors import SensorRig

LOST = {STOP.name: 99, CAMERA.name: 5}
"""Readings sent while the link is down; with the next one 100 stop events, as the task promises."""


@dataclass(frozen=True)
class Aftermath:
    """What the far end heard of one sensor after the gap, in order; ``None``: nothing before it.

    Numbers below ``count`` were sent during the gap, ``count`` itself right after it. The last one
    of the gap, ``count - 1``, may also have got through: a driver sends a reading to one listener
    after the other, so only the next reading proves that it has been sent to the far end, too.
    """

    count: int
    heard: list[int] | None


def radio_gap(rig: SensorRig) -> dict[str, Aftermath]:
    """Let the link break down while readings come in, and see what the far end gets of them."""
    with radio(rig.bench, rig.node) as link:
        link.listen(STOP, lossless())
        # The far consumer of pictures asks for what the student's own asks for.
        asks_reliable = all(
            end.qos_profile.reliability == ReliabilityPolicy.RELIABLE
            for end in rig.requested(CAMERA.topic)
        )
        link.listen(CAMERA, lossless() if asks_reliable else undemanding())
        deaf = [sensor.name for sensor in rig.probe((STOP, CAMERA), link.heard)]
        sensors = [sensor for sensor in (STOP, CAMERA) if sensor.name not in deaf]
        with link.gap():
            for sensor in sensors:
                # Seen at the near end: the driver has sent them all.
                rig.burst(sensor, "gap", LOST[sensor.name])
            _require_silence(rig, link.heard)
        for sensor in sensors:
            rig.node.publish(sensor, "gap", LOST[sensor.name])
        return {
            sensor.name: Aftermath(
                LOST[sensor.name],
                None if sensor.name in deaf else _heard_after(rig, sensor, link.heard),
            )
            for sensor in (STOP, CAMERA)
        }


def _require_silence(rig: SensorRig, heard: Heard) -> None:
    for sensor in (STOP, CAMERA):
        if got := rig.indices(heard, sensor, "gap"):
            raise RuntimeError(f"{len(got)} {sensor.name} readings came through the gap")


def _heard_after(rig: SensorRig, sensor: Sensor, heard: Heard) -> list[int]:
    rig.wait(lambda: LOST[sensor.name] in rig.indices(heard, sensor, "gap"))
    return rig.indices(heard, sensor, "gap")
