"""Where to drive next: along a way, and around what is in the way."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from course.design.at_work.driving.floor_grid import CELL_M, FloorGrid
from course.design.at_work.places.place import Place
from course.worlds.floor_plan import ROBOT_RADIUS_M

SPEED_MPS, TURN_RADPS = 0.6, 1.5
"""What is commanded at most."""

LOOK_AHEAD_M, LOOK_AROUND_M = 0.6, 2.2
"""Metres along a way to the place that is steered at, and to where a detour comes back to it."""

HALF_WIDTH_M = ROBOT_RADIUS_M + 0.08
"""Metres to either side that have to be free, or else a detour is looked for."""

_CLEAR_M = 1.2  # m that have to be free ahead
_TIGHT_M = ROBOT_RADIUS_M + 0.02  # m to either side that the robot takes, come what may
_STOP_M = ROBOT_RADIUS_M + 0.12  # m from the robot's middle to a thing before which it stands
_TURN_GAIN = 2.0  # rad/s for a rad
_WINDOW_M = 3.0  # m to each side of the robot in which a detour is looked for

Points = NDArray[np.float64]
_ROBOT = Place(0.0, 0.0)


class Command(NamedTuple):
    """m/s and rad/s."""

    speed: float
    turn: float


STAND = Command(0.0, 0.0)


def steer(way: Sequence[Place], obstacles: Sequence[Place]) -> Command:
    """Return how to drive along a way, around obstacles; both as seen from the robot.

    Before an obstacle of which only the distance is known, it stops.
    """
    points = np.array([(p.x, p.y) for p in obstacles if not p.far_only]).reshape(-1, 2)
    target = _place_ahead(way, LOOK_AHEAD_M)
    reach = min(_CLEAR_M, math.hypot(way[-1].x, way[-1].y) + ROBOT_RADIUS_M)
    if _room_towards(points, _bearing(target), HALF_WIDTH_M) < reach:
        if not (detour := _find_detour(_place_ahead(way, LOOK_AROUND_M), points)):
            return STAND
        target = _place_ahead(detour, LOOK_AHEAD_M)
    heading = _bearing(target)
    gaps = [place.x for place in obstacles if place.far_only]
    room = min([_room_towards(points, 0.0, _TIGHT_M), *gaps]) - _STOP_M
    speed = SPEED_MPS * max(0.0, math.cos(heading)) ** 2
    turn = min(max(_TURN_GAIN * heading, -TURN_RADPS), TURN_RADPS)
    return Command(min(speed, max(0.0, room)), turn)


def guard(asked: Command, obstacles: Sequence[Place]) -> Command:
    """Return a velocity that was asked for, or another one if something is in its way."""
    if asked.speed <= 0.0:
        return asked
    heading = min(max(asked.turn / _TURN_GAIN, -math.pi / 2), math.pi / 2)
    cos, sin = math.cos(heading), math.sin(heading)
    way = [Place(far * cos, far * sin) for far in (LOOK_AHEAD_M, _CLEAR_M, LOOK_AROUND_M)]
    safe = steer(way, obstacles)
    if abs(safe.turn - asked.turn) < 0.01:
        return Command(min(asked.speed, safe.speed), asked.turn)
    return Command(min(asked.speed, safe.speed), safe.turn)


def _place_ahead(way: Sequence[Place], metres: float) -> Place:
    """Return the first place of a way, from the nearest on, that is so far from the robot."""
    far = [math.hypot(place.x, place.y) for place in way]
    nearest = far.index(min(far))
    return next((way[n] for n in range(nearest, len(way)) if far[n] >= metres), way[-1])


def _find_detour(target: Place, points: Points) -> list[Place]:
    cells = round(2 * _WINDOW_M / CELL_M)
    grid = FloorGrid(np.zeros((cells, cells), np.bool_), CELL_M, -_WINDOW_M, -_WINDOW_M)
    return grid.find_way(_ROBOT, target, [Place(x, y) for x, y in points.tolist()])


def _bearing(place: Place) -> float:
    return math.atan2(place.y, place.x)


def _room_towards(points: Points, heading: float, half_width: float) -> float:
    """Return how far it is to the first thing in a direction, in m; infinite if there is none."""
    cos, sin = math.cos(heading), math.sin(heading)
    along = points[:, 0] * cos + points[:, 1] * sin
    aside = np.abs(points[:, 1] * cos - points[:, 0] * sin)
    met = along[(along > 0.0) & (aside < half_width)]
    return float(met.min()) if len(met) else math.inf
