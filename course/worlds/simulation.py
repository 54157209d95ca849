"""The simulated world, without ROS: same plan, same seed and same commands give the same bits."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from course.worlds import descriptions
from course.worlds.descriptions import Shown, thin_points
from course.worlds.floor import Floor
from course.worlds.floor_plan import FloorPlan
from course.worlds.robot.base import LOW_CHARGE, STEP_S, Robot
from course.worlds.robot.camera import render_camera
from course.worlds.robot.faults import check_fault, possible_faults
from course.worlds.robot.gripper import Gripper
from course.worlds.robot.lidar import read_lidar
from course.worlds.robot.motion import ImuReading, WheelReading, read_imu, read_wheels

SCAN_STEPS, CAMERA_STEPS, WHEEL_STEPS, BATTERY_STEPS = 10, 10, 5, 100
"""Steps between two readings: 10 Hz, 10 Hz, 20 Hz, 1 Hz. The IMU reads in every step."""

AT_PLACE_M = 0.4
"""Whoever is nearer to a station or the charger than this is there."""

_MAX_EVENTS = 100


@dataclass(frozen=True)
class Readings:
    """What the sensors say after a step; None for those whose turn it is not."""

    imu: ImuReading
    scan: NDArray[np.float32] | None
    wheels: WheelReading | None
    charge: float | None
    picture_due: bool


class Simulation:
    """A robot on a floor.

    >>> simulation = Simulation(load_floor_plan("warehouse"), seed=1)
    >>> simulation.drive(0.5, 0.0)
    >>> readings = simulation.step()

    Attributes:
        plan: the floor plan.
        possible_faults: what can fail, with its states; the first is the sound one.
        time_s: simulated seconds since it began, or since the last reset.
        robot: where it is, and what it does.
        floor: what is around it.
        scan: the newest scan in m, or None before the first.
    """

    def __init__(self, plan: FloorPlan, seed: int = 0) -> None:
        """Begin; ``seed`` decides on the noise of the sensors."""
        self.plan = plan
        self.possible_faults = possible_faults(plan)
        self._seed = seed
        self._events: deque[tuple[str, Any]] = deque(maxlen=_MAX_EVENTS)
        self._begin()

    def _begin(self) -> None:
        self._steps = 0
        self.robot = Robot(self.plan)
        self.floor = Floor(self.plan)
        self.gripper = Gripper()
        self.faults = {what: states[0] for what, states in self.possible_faults.items()}
        self._speed_on = 0.0
        self.scan: NDArray[np.float32] | None = None
        self._lidar_noise = np.random.default_rng([self._seed, 1])
        self._imu_noise = np.random.default_rng([self._seed, 2])
        self._shown = Shown(self.robot.x, self.robot.y)

    @property
    def time_s(self) -> float:
        """Simulated seconds since it began, or since the last reset."""
        return self._steps * STEP_S

    def step(self) -> Readings:
        """Move on by `STEP_S`; return what the sensors read then."""
        robot, touched = self.robot, self.robot.touching
        if self._speed_on:
            robot.drive(self._speed_on, 0.0)
        self.floor.step(STEP_S, robot.x, robot.y)
        charger = self.plan.charger
        robot.step(
            self.floor, at_charger=charger is not None and self._is_near(charger.x, charger.y)
        )
        self._steps += 1
        if (moved := self.gripper.step(at_station=self._is_at_station())) is not None:
            self.tell(f"The gripper {'closed' if moved else 'opened'}")
        if robot.touching != touched:
            self._events.append(("bumper", robot.touching))
            if robot.touching:
                self.tell(f"The robot touched {self.floor.nearest_kind(robot.x, robot.y)}")
        self._shown.follow(robot.x, robot.y)
        return self._read_sensors()

    def _read_sensors(self) -> Readings:
        robot, number = self.robot, self._steps
        imu, scan = read_imu(robot, self._imu_noise), None
        if number % SCAN_STEPS == 0:
            self.scan = scan = read_lidar(
                self.floor, robot.x, robot.y, robot.yaw, self._lidar_noise
            )
        return Readings(
            imu,
            scan,
            read_wheels(robot) if number % WHEEL_STEPS == 0 else None,
            robot.charge if number % BATTERY_STEPS == 0 else None,
            number % CAMERA_STEPS == 0 and self.faults["camera"] == "works",
        )

    def render_picture(self) -> NDArray[np.uint8]:
        """Return what the camera sees now: (120, 160, 3), RGB."""
        return render_camera(self.floor, self.robot.x, self.robot.y, self.robot.yaw)

    def take_events(self) -> list[tuple[str, Any]]:
        """Return what has happened since this was asked last, oldest first.

        ``("emergency", "pressed" or "released")``, ``("bumper", touching)``, ``("jammed", is)``.
        """
        events = list(self._events)
        self._events.clear()
        return events

    # Controls.

    def drive(self, speed: float, turn: float) -> None:
        """Command m/s and rad/s; it holds for 0.5 s. What is no number stops the robot."""
        if not (math.isfinite(speed) and math.isfinite(turn)):
            speed = turn = 0.0
        self._speed_on = 0.0
        self.robot.drive(speed, turn)

    def drive_on(self, speed: float) -> None:
        """Command m/s straight on; it holds until the next command of any kind."""
        self.drive(speed, 0.0)
        self._speed_on = speed if math.isfinite(speed) and not self.robot.stopped else 0.0

    def limit_speeds(self, speed: float, turn: float) -> None:
        """Limit m/s and rad/s, in both directions, from now on. What is no limit is left alone."""
        if all(math.isfinite(limit) and limit >= 0.0 for limit in (speed, turn)):
            self.robot.limit_speeds(speed, turn)
            self.tell(f"The speed limits became {speed:g} m/s and {turn:g} rad/s")

    def command_gripper(self, closed: bool) -> bool:
        """Close or open the gripper; return False if it refuses."""
        return self.gripper.command(closed, self.faults["gripper"])

    def press_stop(self) -> None:
        """Press the emergency stop: the robot brakes, and takes no commands until the release."""
        if not self.robot.stopped:
            self.tell("The emergency stop was pressed")
        self.robot.stopped = True
        self._events.append(("emergency", "pressed"))

    def release_stop(self) -> None:
        """Release the emergency stop; the next command moves the robot again."""
        if self.robot.stopped:
            self.tell("The emergency stop was released")
            self.drive(0.0, 0.0)
            self.robot.stopped = False
            self._events.append(("emergency", "released"))

    def add_obstacle(self, x: float, y: float, radius: float = 0.2) -> int:
        """Put a round obstacle on the floor (m); return its id."""
        return self.floor.add_obstacle(x, y, radius)

    def move_obstacle(self, number: int, x: float, y: float) -> None:
        """Move an obstacle to another place on the floor."""
        self.floor.move_obstacle(number, x, y)

    def remove_obstacle(self, number: int) -> None:
        """Take an obstacle away."""
        self.floor.remove_obstacle(number)

    def set_fault(self, what: str, state: str) -> None:
        """Let something fail, or work again; see `possible_faults`.

        Raises:
            SessionError: there is no such thing, or no such state.
        """
        check_fault(self.possible_faults, what, state)
        if self.faults[what] == state:
            return
        self.faults[what] = state
        if what == "wheels":
            self.robot.jammed = state == "jammed"
            self._events.append(("jammed", self.robot.jammed))
        elif what == "battery":
            self.robot.charge = LOW_CHARGE if state == "low" else 1.0
        self.tell(f"Now {what}: {state},")

    def reset(self) -> None:
        """Begin anew: robot, people, noise, faults and time are as at first, obstacles are gone."""
        released, jammed = self.robot.stopped, self.robot.jammed
        self._begin()
        self._events += [("emergency", "released")] if released else []
        self._events += [("jammed", False)] if jammed else []

    def show_path(self, points: Sequence[tuple[float, float]]) -> None:
        """Show a planned path, in m; of a long one, points at even distances."""
        self._shown.path = thin_points(points)

    def show_found(self, points: Sequence[tuple[float, float]]) -> None:
        """Show where somebody has found obstacles, in m."""
        self._shown.found = thin_points(points)

    # Looking.

    def describe_floor(self) -> dict[str, Any]:
        """Return what never changes, as JSON: lengths in m; and what can fail, with its states."""
        possible = {what: list(states) for what, states in self.possible_faults.items()}
        return {**descriptions.describe_floor(self.plan), "faults": possible}

    def describe_moment(self) -> dict[str, Any]:
        """Return what is now, as JSON of bounded size: m, rad, s."""
        return {
            "time": round(self.time_s, 2),
            "robot": descriptions.describe_robot(self.robot, self.gripper),
            "beams": descriptions.describe_beams(self.scan),
            **descriptions.describe_things(self.floor),
            **self._shown.describe(),
            "faults": dict(self.faults),
        }

    def tell(self, what: str) -> None:
        """Add to the news what has happened now."""
        self._shown.news.append(f"{what} at {self.time_s:.1f} s.")

    def _is_near(self, x: float, y: float) -> bool:
        return math.hypot(self.robot.x - x, self.robot.y - y) < AT_PLACE_M

    def _is_at_station(self) -> bool:
        return any(self._is_near(station.x, station.y) for station in self.plan.stations)
