"""A robot on a line of stations, whose hardware tells and takes plain numbers."""

from __future__ import annotations

from std_msgs.msg import Float64

from course.worlds.interfaces.ports import Ports
from course.worlds.robot.base import STEP_S
from course.worlds.simulation import BATTERY_STEPS, WHEEL_STEPS, Readings

POSITION, CHARGE, SPEED = "hardware/position", "hardware/charge", "hardware/speed"


class LineDrive:
    """Position (m from the first station on), charge (1.0 is full) and speed (m/s), as Float64.

    A speed holds until the next command, also while something stands in the way.
    """

    def __init__(self, ports: Ports) -> None:
        """Offer them on the world's node."""
        self._ports = ports
        self._origin = ports.simulation.plan.stations[0].x
        ports.advertise(POSITION, Float64, 10, 1 / (WHEEL_STEPS * STEP_S))
        ports.advertise(CHARGE, Float64, 10, 1 / (BATTERY_STEPS * STEP_S))
        ports.listen(Float64, SPEED, lambda message: ports.simulation.drive_on(message.data))

    def publish_readings(self, readings: Readings) -> None:
        """Publish what the sensors have to say after a step."""
        if readings.wheels is not None:
            self._ports.publish_value(POSITION, readings.wheels.x - self._origin)
        if readings.charge is not None:
            self._ports.publish_value(CHARGE, readings.charge)
