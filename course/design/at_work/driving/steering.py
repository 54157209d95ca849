"""Where to drive next: along a way, and around what is in the way."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from course.design.at_work.driving.floor_grid import CELL_M, FloorGrid
from course.design.at_work.places.place import Place, distance_between
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
_LONGEST_DETOUR = 1.5  # times the way itself: what is longer takes a planner and its map

Points = NDArray[np.float64]
_ROBOT = Place(0.0, 0.0)


class Command(NamedTuple):
    """m/s and rad/s."""

    speed: float
    turn: float


STAND = Command(0.0, 0.0)


def steer(
    way: Sequence[Place], obstacles: Sequence[Place], detour: Sequence[Place] = ()
) -> tuple[Command, Sequence[Place]]:
    """Return how to drive along a way, around obstacles, and the detour that is taken, if any.

    All places are as seen from the robot. A detour that was taken before is stayed with as long as
    it is free: of two that are as good, the better one changes with each look. Before an obstacle
    of which only the distance is known, the robot stops.
    """
    points = np.array([(p.x, p.y) for p in obstacles if not p.far_only]).reshape(-1, 2)
    target = _choose_target(way, points)
    reach = min(_CLEAR_M, math.hypot(way[-1].x, way[-1].y) + ROBOT_RADIUS_M)
    if not _is_free(_rest_of(detour), points):
        detour = ()
        if _room_towards(points, _bearing(target), HALF_WIDTH_M) < reach:
            detour = _find_detour(_part_ahead(way, LOOK_AROUND_M), points)
            if not detour:
                return STAND, ()
    if detour:
        target = _choose_target(detour, points)
    heading = _bearing(target)
    gaps = [place.x for place in obstacles if place.far_only]
    room = min([_room_towards(points, 0.0, _TIGHT_M), *gaps]) - _STOP_M
    speed = SPEED_MPS * max(0.0, math.cos(heading)) ** 2
    turn = min(max(_TURN_GAIN * heading, -TURN_RADPS), TURN_RADPS)
    return Command(min(speed, max(0.0, room)), turn), detour


def guard(asked: Command, obstacles: Sequence[Place]) -> Command:
    """Return a velocity that was asked for, or another one if something is in its way."""
    if asked.speed <= 0.0:
        return asked
    heading = min(max(asked.turn / _TURN_GAIN, -math.pi / 2), math.pi / 2)
    cos, sin = math.cos(heading), math.sin(heading)
    way = [Place(far * cos, far * sin) for far in (LOOK_AHEAD_M, _CLEAR_M, LOOK_AROUND_M)]
    safe, _ = steer(way, obstacles)
    if abs(safe.turn - asked.turn) < 0.01:
        return Command(min(asked.speed, safe.speed), asked.turn)
    return Command(min(asked.speed, safe.speed), safe.turn)


def _choose_target(way: Sequence[Place], points: Points) -> Place:
    """Return the place to steer at: of those ahead, the farthest to which it is free straight on.

    A robot that cuts a corner of its way stands before it in the end, its nose at what is there.
    """
    first, *ahead = _part_ahead(way, LOOK_AHEAD_M)
    for place in reversed(ahead):
        far = math.hypot(place.x, place.y)
        if _room_towards(points, _bearing(place), _TIGHT_M) > far:
            return place
    return ahead[0] if ahead else first


def _part_ahead(way: Sequence[Place], metres: float) -> Sequence[Place]:
    """Return a way from the nearest place to the first that is so far from the robot."""
    rest = _rest_of(way)
    far = (n for n, place in enumerate(rest, 1) if math.hypot(place.x, place.y) >= metres)
    return rest[: next(far, None)]


def _rest_of(way: Sequence[Place]) -> Sequence[Place]:
    """Return a way from the place on that is nearest to the robot."""
    far = [math.hypot(place.x, place.y) for place in way]
    return way[far.index(min(far)) :] if way else way


def _is_free(way: Sequence[Place], points: Points) -> bool:
    """Return whether there is a way ahead, and nothing comes too near to it."""
    places = np.array([(place.x, place.y) for place in way]).reshape(-1, 1, 2)
    gaps = np.hypot(*np.moveaxis(places - points, -1, 0))
    return len(way) > 1 and bool((gaps > _TIGHT_M).all())


def _find_detour(part: Sequence[Place], points: Points) -> list[Place]:
    """Return a detour to the end of a part of the way; [] if there is none, or it is too long."""
    cells = round(2 * _WINDOW_M / CELL_M)
    grid = FloorGrid(np.zeros((cells, cells), np.bool_), CELL_M, -_WINDOW_M, -_WINDOW_M)
    detour = grid.find_way(_ROBOT, part[-1], [Place(x, y) for x, y in points.tolist()])
    longest = _LONGEST_DETOUR * _length_of([_ROBOT, *part])
    return detour if _length_of(detour) < longest else []


def _length_of(way: Sequence[Place]) -> float:
    return sum(distance_between(*pair) for pair in pairwise(way))


def _bearing(place: Place) -> float:
    return math.atan2(place.y, place.x)


def _room_towards(points: Points, heading: float, half_width: float) -> float:
    """Return how far it is to the first thing in a direction, in m; infinite if there is none."""
    cos, sin = math.cos(heading), math.sin(heading)
    along = points[:, 0] * cos + points[:, 1] * sin
    aside = np.abs(points[:, 1] * cos - points[:, 0] * sin)
    met = along[(along > 0.0) & (aside < half_width)]
    return float(met.min()) if len(met) else math.inf
