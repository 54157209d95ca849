"""A place on the floor, in the frame of the floor or of the robot."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

MAP, BASE = "map", "base_link"
"""Frames: of the floor, or as seen from the robot (x ahead, y to the left)."""

FAR_M = 10.0
"""What a message tells that has room for one distance or place, if nothing is in the way."""


class Place(NamedTuple):
    """A place: m, and rad counter-clockwise from the x axis.

    With ``far_only`` no more is known than how far it is, which `x` tells.
    """

    x: float
    y: float
    yaw: float = 0.0
    far_only: bool = False


@dataclass(frozen=True)
class Slot:
    """Where in a message places can stand.

    Attributes:
        put: writes places, of which a slot for a single one gets the first; its second argument is
            their frame, which a text tells.
        get: returns those that are there.
        many: whether there is room for more than one.
    """

    put: Callable[[Sequence[Place], str], None]
    get: Callable[[], list[Place]]
    many: bool = False


def seen_from(robot: Place, place: Place) -> Place:
    """Return a place of the floor as the robot sees it."""
    dx, dy = place.x - robot.x, place.y - robot.y
    cos, sin = math.cos(robot.yaw), math.sin(robot.yaw)
    return Place(cos * dx + sin * dy, cos * dy - sin * dx, place.yaw - robot.yaw)


def on_floor(robot: Place, place: Place) -> Place:
    """Return where on the floor a place is that the robot sees."""
    cos, sin = math.cos(robot.yaw), math.sin(robot.yaw)
    x, y = cos * place.x - sin * place.y, sin * place.x + cos * place.y
    return Place(robot.x + x, robot.y + y, place.yaw + robot.yaw)


def distance_between(one: Place, other: Place) -> float:
    """Return the distance in m."""
    return math.hypot(one.x - other.x, one.y - other.y)
