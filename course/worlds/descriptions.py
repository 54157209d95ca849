"""The world as JSON of bounded size, for whoever draws it: lengths in m, angles in rad."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from course.worlds.floor import Floor
from course.worlds.floor_plan import ROBOT_RADIUS_M, FloorPlan
from course.worlds.robot.base import Robot
from course.worlds.robot.gripper import Gripper

MAX_TRAIL, MAX_POINTS, MAX_BEAMS, MAX_NEWS = 300, 200, 90, 5
"""Points of the trail, points of what nodes publish, beams, and sentences, at most."""

TRAIL_GAP_M = 0.05
"""Metres between two points of the trail."""

Points = list[tuple[float, float]]


class Shown:
    """What is shown beside the robot itself.

    Attributes:
        news: the last sentences about what happened.
        path: what a node plans.
        found: where a node has found obstacles.
    """

    def __init__(self, x: float, y: float) -> None:
        """Begin the trail."""
        self._trail = deque([(x, y)], maxlen=MAX_TRAIL)
        self.news: deque[str] = deque(maxlen=MAX_NEWS)
        self.path: Points = []
        self.found: Points = []

    def follow(self, x: float, y: float) -> None:
        """Go on with the trail."""
        if math.dist(self._trail[-1], (x, y)) >= TRAIL_GAP_M:
            self._trail.append((x, y))

    def describe(self) -> dict[str, Any]:
        """Return the fields ``trail``, ``path``, ``found`` and ``news``."""
        return {
            "trail": [_rounded(*point) for point in self._trail],
            "path": [_rounded(*point) for point in self.path],
            "found": [_rounded(*point) for point in self.found],
            "news": list(self.news),
        }


def thin_points(points: Sequence[tuple[float, float]]) -> Points:
    """Return points to show: of many, every so many; without those that are no numbers."""
    sound = [(x, y) for x, y in points if math.isfinite(x) and math.isfinite(y)]
    return sound[:: max(1, math.ceil(len(sound) / MAX_POINTS))]


def describe_floor(plan: FloorPlan) -> dict[str, Any]:
    """Return what never changes; the charger is the station ``charger``."""
    stations = [{"name": s.name, "x": s.x, "y": s.y} for s in plan.stations]
    if plan.charger is not None:
        stations.append({"name": "charger", "x": plan.charger.x, "y": plan.charger.y})
    return {
        "name": plan.name,
        "width": plan.size[0],
        "height": plan.size[1],
        "walls": [list(wall) for wall in plan.all_walls],
        "shelves": [list(shelf) for shelf in plan.shelves],
        "stations": stations,
        "robot_radius": ROBOT_RADIUS_M,
    }


def describe_robot(robot: Robot, gripper: Gripper) -> dict[str, Any]:
    """Return where the robot is, and what it does."""
    return {
        "x": round(robot.x, 3),
        "y": round(robot.y, 3),
        "yaw": round(robot.yaw, 4),
        "speed": round(robot.speed, 3),
        "turn": round(robot.turn, 3),
        "battery": round(robot.charge, 4),
        "gripper": "closed" if gripper.closed else "open",
        "holding": gripper.holding,
        "stopped": robot.stopped,
        "touching": robot.touching,
    }


def describe_beams(scan: NDArray[np.float32] | None) -> list[float | None]:
    """Return every so many beam of a scan, None for those that met nothing."""
    if scan is None:
        return []
    thinned = scan[:: math.ceil(len(scan) / MAX_BEAMS)]
    return [round(metres, 3) if math.isfinite(metres) else None for metres in thinned.tolist()]


def describe_things(floor: Floor) -> dict[str, Any]:
    """Return the fields ``people`` and ``obstacles``."""
    return {
        "people": [_rounded(person.x, person.y, person.radius) for person in floor.people],
        "obstacles": [
            [number, *_rounded(thing.x, thing.y, thing.radius)]
            for number, thing in floor.obstacles.items()
        ],
    }


def _rounded(*values: float) -> list[float]:
    return [round(value, 3) for value in values]
