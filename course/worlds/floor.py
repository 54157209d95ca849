"""The floor as it is at a moment: walls and shelves, people who walk, and obstacles."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from course.errors import SessionError
from course.util.close_matches import did_you_mean
from course.worlds.floor_plan import ROBOT_RADIUS_M, FloorPlan, Walker
from course.worlds.ray_casting import Floats, distances_to

KINDS = ("a wall", "a shelf", "a person", "an obstacle")
"""What there is to meet, as a sentence names it; an array of kinds has positions in here."""

WALL, SHELF, PERSON, OBSTACLE = range(4)

MAX_OBSTACLES = 50
_POLITE_M = 0.15  # m that people keep from the robot: they wait until it has gone


@dataclass
class Obstacle:
    """A round obstacle: middle and radius in m."""

    x: float
    y: float
    radius: float


class Person:
    """A person who walks along way points, and waits where the robot is in the way."""

    def __init__(self, plan: Walker) -> None:
        """Stand at the first way point."""
        self.x, self.y = plan.path[0]
        self.radius = plan.radius
        self._speed = plan.speed
        self._path = plan.path
        self._next = 1

    def step(self, seconds: float, robot_x: float, robot_y: float) -> None:
        """Walk on for some seconds."""
        x, y, target, left = self.x, self.y, self._next, self._speed * seconds
        for _ in self._path:  # once around at most
            goal_x, goal_y = self._path[target]
            distance = math.hypot(goal_x - x, goal_y - y)
            if distance > left:
                x += (goal_x - x) * left / distance
                y += (goal_y - y) * left / distance
                break
            x, y, left = goal_x, goal_y, left - distance
            target = (target + 1) % len(self._path)
        gap = math.hypot(x - robot_x, y - robot_y)
        near = self.radius + ROBOT_RADIUS_M + _POLITE_M
        if gap < near and gap < math.hypot(self.x - robot_x, self.y - robot_y):
            return
        self.x, self.y, self._next = x, y, target


class Floor:
    """What a ray or the robot can meet.

    Attributes:
        segments: walls and the edges of shelves, (n, 4) in m.
        kinds: what each segment belongs to, and after them each circle: positions in `KINDS`.
        circles: people, then obstacles, (m, 3) in m.
        people: those who walk.
        obstacles: by their id.
    """

    def __init__(self, plan: FloorPlan) -> None:
        """Be as in ``plan``, everybody at the first way point."""
        edges = [edge for shelf in plan.shelves for edge in _shelf_edges(*shelf)]
        self.segments: Floats = np.array([*plan.all_walls, *edges], dtype=np.float64)
        self._fixed_kinds = [WALL] * len(plan.all_walls) + [SHELF] * len(edges)
        self._size = plan.size
        self.people = [Person(walker) for walker in plan.people]
        self.obstacles: dict[int, Obstacle] = {}
        self._last_id = 0
        self._look_again()

    def step(self, seconds: float, robot_x: float, robot_y: float) -> None:
        """Let people walk."""
        for number, person in enumerate(self.people):
            person.step(seconds, robot_x, robot_y)
            self.circles[number, :2] = person.x, person.y

    def clearance(self, x: float, y: float) -> float:
        """Return how far a point is from the nearest thing, in m."""
        return float(distances_to(x, y, self.segments, self.circles).min())

    def nearest_kind(self, x: float, y: float) -> str:
        """Return what is nearest to a point, as a sentence names it."""
        nearest = int(distances_to(x, y, self.segments, self.circles).argmin())
        return KINDS[int(self.kinds[nearest])]

    def add_obstacle(self, x: float, y: float, radius: float) -> int:
        """Put an obstacle on the floor; return its id.

        Raises:
            SessionError: there are enough, or its radius is out of range.
        """
        if len(self.obstacles) >= MAX_OBSTACLES:
            raise SessionError(
                f"There are {MAX_OBSTACLES} obstacles on the floor, and no more fit: take one away "
                "with remove_obstacle(id)."
            )
        if not 0.02 <= radius <= 2.0:
            raise SessionError(f"An obstacle's radius is 0.02 to 2 m, not {radius:g}.")
        self._last_id += 1
        self.obstacles[self._last_id] = Obstacle(*self._keep_inside(x, y), radius)
        self._look_again()
        return self._last_id

    def move_obstacle(self, number: int, x: float, y: float) -> None:
        """Move an obstacle; a place outside of the floor stands for the nearest one on it.

        Raises:
            SessionError: there is no such obstacle.
        """
        obstacle = self._find_obstacle(number)
        obstacle.x, obstacle.y = self._keep_inside(x, y)
        self._look_again()

    def remove_obstacle(self, number: int) -> None:
        """Take an obstacle away.

        Raises:
            SessionError: there is no such obstacle.
        """
        self._find_obstacle(number)
        del self.obstacles[number]
        self._look_again()

    def _find_obstacle(self, number: int) -> Obstacle:
        if number not in self.obstacles:
            known = [str(each) for each in self.obstacles]
            raise SessionError(
                f"There is no obstacle {number!r}: there are {', '.join(known) or 'none'}."
                + did_you_mean(str(number), known)
            )
        return self.obstacles[number]

    def _keep_inside(self, x: float, y: float) -> tuple[float, float]:
        if not (math.isfinite(x) and math.isfinite(y)):
            raise SessionError(f"An obstacle stands at numbers of metres, not at ({x}, {y}).")
        return min(max(float(x), 0.0), self._size[0]), min(max(float(y), 0.0), self._size[1])

    def _look_again(self) -> None:
        round_things: list[Person | Obstacle] = [*self.people, *self.obstacles.values()]
        self.circles: Floats = np.array(
            [(each.x, each.y, each.radius) for each in round_things], dtype=np.float64
        ).reshape(-1, 3)
        moving = [PERSON] * len(self.people) + [OBSTACLE] * len(self.obstacles)
        self.kinds = np.array(self._fixed_kinds + moving, dtype=np.intp)


def _shelf_edges(x: float, y: float, width: float, height: float) -> list[tuple[float, ...]]:
    corners = [(x, y), (x + width, y), (x + width, y + height), (x, y + height), (x, y)]
    return [(*one, *other) for one, other in pairwise(corners)]
