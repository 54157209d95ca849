"""The robot: a differential drive with limits, its wheel odometry, and a battery.

Within a step speed and turn rate change evenly, so what a drive comes to can be computed by hand:
a start to v m/s takes v / a seconds and v² / 2a metres.
"""

from __future__ import annotations

import math

from course.worlds.floor import Floor
from course.worlds.floor_plan import ROBOT_RADIUS_M, FloorPlan

STEP_S = 0.01
"""Seconds that one step of the simulation takes."""

MAX_SPEED_MPS = 1.0
MAX_TURN_RADPS = 2.0
ACCELERATION_MPS2 = 1.0
TURN_ACCELERATION_RADPS2 = 4.0
EMERGENCY_BRAKE_MPS2 = 4.0
"""The brakes of the emergency stop: from full speed to rest in 0.25 s."""

COMMAND_TIMEOUT_S = 0.5
"""A command holds for this long, as with real bases: a node that has died must not drive on."""

CAPACITY_J = 60_000.0
IDLE_POWER_W = 10.0
DRIVE_POWER_W_PER_MPS = 30.0
TURN_POWER_W_PER_RADPS = 5.0
CHARGE_POWER_W = 200.0
LOW_CHARGE = 0.1
"""Share of the capacity that is left when the battery is set to low."""

_TIMEOUT_STEPS = round(COMMAND_TIMEOUT_S / STEP_S)
_TOUCH_M = 0.002  # m of gap at which the bumper still feels something
_CONTACT_M = 1e-6  # m of gap at which the robot stands at a thing


class Robot:
    """A disc that drives.

    Attributes:
        x, y, yaw: where it is in truth, in m and rad, in the frame ``map``.
        wheel_x, wheel_y, wheel_yaw: where its wheels say that it is, in the frame ``odom``, which
            is the frame ``map`` as long as nothing slips.
        speed, turn: of its wheels, in m/s and rad/s.
        acceleration: m/s² forward, in the last step.
        stopped: whether the emergency stop is pressed.
        jammed: whether its wheels are.
        touching: whether its bumper feels something.
        charge: share of the battery's capacity that is left, 0 to 1.
        charging: whether it stands at its charger.
    """

    def __init__(self, plan: FloorPlan) -> None:
        """Stand at the start with a full battery."""
        self.x, self.y, self.yaw = plan.start.x, plan.start.y, _wrap_angle(plan.start.yaw)
        self.wheel_x, self.wheel_y, self.wheel_yaw = self.x, self.y, self.yaw
        self.speed = self.turn = self.acceleration = 0.0
        self.stopped = self.jammed = self.touching = self.charging = False
        self._energy_j = CAPACITY_J
        self._command = (0.0, 0.0)
        self._command_steps = _TIMEOUT_STEPS  # since it was given
        self._grip = 1.0 - plan.slip
        self._most = (MAX_SPEED_MPS, MAX_TURN_RADPS)

    @property
    def charge(self) -> float:
        """Share of the capacity that is left, 0 to 1."""
        return self._energy_j / CAPACITY_J

    @charge.setter
    def charge(self, share: float) -> None:
        self._energy_j = share * CAPACITY_J

    def drive(self, speed: float, turn: float) -> None:
        """Take a command: m/s and rad/s, cut to what the base can do, and to its limits."""
        fastest, sharpest = self._most
        self._command = (
            min(max(speed, -fastest), fastest),
            min(max(turn, -sharpest), sharpest),
        )
        self._command_steps = 0

    def limit_speeds(self, speed: float, turn: float) -> None:
        """Limit later commands to m/s and rad/s, at most what the base can do."""
        self._most = (min(speed, MAX_SPEED_MPS), min(turn, MAX_TURN_RADPS))

    def step(self, floor: Floor, *, at_charger: bool) -> None:
        """Move on by one step."""
        if self.jammed or self._energy_j <= 0.0:
            self.speed = self.turn = 0.0
        speed, turn = self._next_speeds()
        before = self.speed
        forward, angle = (self.speed + speed) / 2 * STEP_S, (self.turn + turn) / 2 * STEP_S
        share = self._free_share(floor, forward, angle) if forward else 1.0
        self.wheel_x, self.wheel_y, self.wheel_yaw = _move_along_arc(
            self.wheel_x, self.wheel_y, self.wheel_yaw, forward * share, angle
        )
        self.x, self.y, self.yaw = self._reach(forward * share, angle)
        self.speed, self.turn = (speed if share == 1.0 else 0.0), turn
        self.acceleration = (self.speed - before) / STEP_S
        self.touching = floor.clearance(self.x, self.y) - ROBOT_RADIUS_M < _TOUCH_M
        self._use_energy(abs(forward * share), abs(angle), at_charger=at_charger)
        self._command_steps += 1

    def _next_speeds(self) -> tuple[float, float]:
        if self.jammed or self._energy_j <= 0.0:
            return 0.0, 0.0
        wanted = (0.0, 0.0)
        if not self.stopped and self._command_steps < _TIMEOUT_STEPS:
            wanted = self._command
        brakes = EMERGENCY_BRAKE_MPS2 if self.stopped else ACCELERATION_MPS2
        faster = 2 * TURN_ACCELERATION_RADPS2 if self.stopped else TURN_ACCELERATION_RADPS2
        return (
            _approach(self.speed, wanted[0], brakes * STEP_S),
            _approach(self.turn, wanted[1], faster * STEP_S),
        )

    def _reach(self, forward: float, angle: float) -> tuple[float, float, float]:
        grip = self._grip
        return _move_along_arc(self.x, self.y, self.yaw, forward * grip, angle * grip)

    def _free_share(self, floor: Floor, forward: float, angle: float) -> float:
        """Return how much of a step's way is free: 1 for all of it.

        Something that has been put upon the robot does not hold it, if it drives away from there.
        """
        x, y, _ = self._reach(forward, angle)
        gap = floor.clearance(x, y) - ROBOT_RADIUS_M
        if gap >= 0.0:
            return 1.0
        here = floor.clearance(self.x, self.y) - ROBOT_RADIUS_M
        if gap >= here:
            return 1.0
        if here < _CONTACT_M:
            return 0.0
        free, blocked = 0.0, 1.0
        while (blocked - free) * abs(forward) > _CONTACT_M / 10:
            middle = (free + blocked) / 2
            x, y, _ = self._reach(forward * middle, angle)
            if floor.clearance(x, y) >= ROBOT_RADIUS_M:
                free = middle
            else:
                blocked = middle
        return free

    def _use_energy(self, metres: float, radians: float, *, at_charger: bool) -> None:
        self.charging = at_charger and not metres and self._energy_j < CAPACITY_J
        used = IDLE_POWER_W * STEP_S + DRIVE_POWER_W_PER_MPS * metres
        used += TURN_POWER_W_PER_RADPS * radians
        gained = CHARGE_POWER_W * STEP_S if self.charging else 0.0
        self._energy_j = min(max(self._energy_j - used + gained, 0.0), CAPACITY_J)


def _move_along_arc(
    x: float, y: float, yaw: float, forward: float, angle: float
) -> tuple[float, float, float]:
    """Return where an arc of a length (m) ends that turns by an angle (rad): exactly."""
    half = angle / 2
    chord = forward * (math.sin(half) / half if half else 1.0)
    heading = yaw + half
    return x + chord * math.cos(heading), y + chord * math.sin(heading), _wrap_angle(yaw + angle)


def _wrap_angle(angle: float) -> float:
    """Return the same angle within -pi to pi."""
    return math.remainder(angle, math.tau)


def _approach(value: float, wanted: float, most: float) -> float:
    return wanted if abs(wanted - value) <= most else value + math.copysign(most, wanted - value)
