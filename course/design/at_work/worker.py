"""What a node of a design knows, and what it makes of it; without ROS."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from course.design.at_work.driving import sensing, steering
from course.design.at_work.driving.floor_grid import FloorGrid
from course.design.at_work.driving.memory import ObstacleMemory
from course.design.at_work.driving.steering import STAND, Command
from course.design.at_work.meanings import AHEAD, SENSED, Meaning, NodePart
from course.design.at_work.places.place import BASE, MAP, Place, on_floor, seen_from

PATIENCE_S = 1.0
"""Seconds after which what was heard is out of date: a robot that hears nothing stands still."""

ARRIVED_M = 0.25
"""Metres from its goal at which a robot has arrived."""

Way = tuple[list[Place], str]
"""Places to drive to, one after the other, and their frame."""


class Worker:
    """The knowledge of one node.

    Attributes:
        part: its part in the design.
        goal: where it is to go, as it was told by a goal or on a topic; or None.
        path: the way there, or None.
        was_asked: whether it had to plan.
        could_plan: whether it found a way the last time.
    """

    def __init__(self, part: NodePart, floor: Mapping[str, Any], start: Place) -> None:
        """Know what a node of this part knows at first: where the robot was put down."""
        self.part = part
        self.goal: Way | None = None
        self.path: Way | None = None
        self.was_asked = self.could_plan = False
        has_plan = Meaning.MAP in part.tells
        self._grid = FloorGrid.from_floor(dict(floor)) if has_plan else None
        self._pose, self._pose_time = start, -PATIENCE_S
        self._seen: dict[str, tuple[float, Way]] = {}
        self._memory = ObstacleMemory()
        self._detour: list[Place] = []  # on the floor
        self._heard: dict[Meaning, float] = {}

    # What it hears.

    def hear_pose(self, pose: Place, now: float) -> None:
        """Take where the robot is."""
        self._pose, self._pose_time = pose, now

    def hear_speed(self, speed: float, turn: float, now: float) -> None:
        """Go on from the last pose: dead reckoning."""
        passed = min(max(now - self._pose_time, 0.0), PATIENCE_S / 2)
        middle = self._pose._replace(yaw=self._pose.yaw + turn * passed / 2)
        moved = on_floor(middle, Place(speed * passed, 0.0))
        self.hear_pose(moved._replace(yaw=self._pose.yaw + turn * passed), now)

    def hear_obstacles(self, source: str, found: Way, now: float) -> None:
        """Take what one source has found."""
        self._seen[source] = (now, found)
        if (pose := self.pose(now)) is not None:
            places = [place for place in found[0] if not place.far_only]
            if found[1] == BASE:
                places = [on_floor(pose, place) for place in places]
            self._memory.remember(places, now)

    def hear_way(self, meaning: Meaning, way: Way, now: float) -> None:
        """Take a waypoint or a path."""
        self.note(meaning, now)
        if meaning is Meaning.GOAL:
            self.goal = way
        else:
            self.path = way

    def hear_map(self, message: Any) -> None:
        """Take a map."""
        self._grid = FloorGrid.from_message(message) or self._grid

    def note(self, meaning: Meaning, now: float) -> None:
        """Remember that something of a meaning was heard."""
        self._heard[meaning] = now

    def forget_way(self) -> None:
        """Have nowhere to go any more."""
        self.goal = self.path = None
        self._detour = []

    # What it makes of it.

    def hears(self, meaning: Meaning, now: float) -> bool:
        """Return whether it has heard something of a meaning lately."""
        return now - self._heard.get(meaning, -PATIENCE_S) < PATIENCE_S

    @property
    def grid(self) -> FloorGrid | None:
        """The map that it has."""
        return self._grid

    def pose(self, now: float) -> Place | None:
        """Return where the robot is, or None if nobody has said so lately."""
        return self._pose if now - self._pose_time < PATIENCE_S else None

    def obstacles(self, now: float) -> list[Place] | None:
        """Return what is in the way, as seen from the robot; None if nobody has said lately."""
        fresh = [found for time, found in list(self._seen.values()) if now - time < PATIENCE_S]
        if not fresh:
            return None
        pose = self.pose(now)
        return [
            place if frame == BASE or pose is None else seen_from(pose, place)
            for found, frame in fresh
            for place in found
        ]

    def in_the_way(self, now: float) -> list[Place] | None:
        """Return what `obstacles` does, and what is remembered where it is not seen any more."""
        seen, pose = self.obstacles(now), self.pose(now)
        if seen is None or pose is None:
            return seen
        return seen + [seen_from(pose, place) for place in self._memory.recall(now)]

    def way(self, now: float) -> list[Place] | None:
        """Return the way to drive, as seen from the robot; None if it has none."""
        if self.needs_path:
            return self._seen_way(Meaning.PATH, self.path, now)
        return self._seen_way(Meaning.GOAL, self.goal, now)

    def way_in(self, frame: str, now: float) -> list[Place] | None:
        """Return the way in a frame; None if it has none, or cannot tell."""
        told, pose = self.path or self.goal, self.pose(now)
        if told is None or told[1] == frame:
            return None if told is None else told[0]
        if pose is None:
            return None
        return [(seen_from if frame == BASE else on_floor)(pose, place) for place in told[0]]

    def distance_left(self, now: float) -> float | None:
        """Return how far it is to the goal in a straight line (m), or None if it cannot tell."""
        meaning, told = (Meaning.GOAL, self.goal) if self.goal else (Meaning.PATH, self.path)
        way = self._seen_way(meaning, told, now)
        return math.hypot(way[-1].x, way[-1].y) if way else None

    def _seen_way(self, meaning: Meaning, told: Way | None, now: float) -> list[Place] | None:
        if told is None:
            return None
        if told[1] == BASE:  # the robot has moved since
            return told[0] if self.hears(meaning, now) else None
        pose = self.pose(now)
        return None if pose is None else [seen_from(pose, place) for place in told[0]]

    def plan(self, start: Place | None, goal: Place | None, now: float) -> list[Place]:
        """Return the way from start to goal over the map; [] if it cannot say.

        What it knows by itself comes first: a question may leave a field empty.
        """
        self.was_asked, self.could_plan = True, False
        start = self.pose(now) or start
        if self.goal is not None and self.goal[1] == MAP:
            goal = self.goal[0][-1]
        if self._grid is None or start is None or goal is None:
            return []
        seen = [on_floor(start, p) for p in self.obstacles(now) or () if not p.far_only]
        way = self._grid.find_way(start, goal, seen)
        self.could_plan = bool(way)
        return way

    def command(self, now: float) -> Command:
        """Return how to drive on along the way; to stand if it cannot tell."""
        way, seen = self.way(now), self.in_the_way(now)
        if not way or (seen is None and self.needs_obstacles):
            return STAND
        if math.hypot(way[-1].x, way[-1].y) < ARRIVED_M:
            return STAND
        pose = self.pose(now)
        if pose is None:
            return steering.steer(way, seen or ())[0]
        last = [seen_from(pose, place) for place in self._detour]
        command, detour = steering.steer(way, seen or (), last)
        self._detour = [on_floor(pose, place) for place in detour]
        return command

    def guard(self, asked: Command, now: float) -> Command:
        """Return a velocity that it was told, changed as far as it hears of obstacles."""
        seen = self.in_the_way(now)
        if seen is None:
            return STAND if self.needs_obstacles else asked
        return steering.guard(asked, seen)

    # What its part in the design asks for.

    @property
    def needs_obstacles(self) -> bool:
        """Whether it is told what is in the way, so that silence is no good sign."""
        return bool(self.part.hears & {Meaning.OBSTACLES, *SENSED})

    @property
    def needs_path(self) -> bool:
        """Whether it is given a path, so that it does not drive without one."""
        return Meaning.PATH in self.part.hears or bool(self.part.plan_clients)

    @property
    def needs_way(self) -> bool:
        """Whether it is told where to go at all."""
        return bool(self.part.hears & {*AHEAD}) or bool(self.part.plan_clients)


def find_obstacles(meaning: Meaning, message: Any) -> list[Place]:
    """Return what a reading says about what is in the way, as seen from the robot."""
    if meaning is Meaning.SCAN:
        return sensing.find_in_scan(message)
    return sensing.find_in_picture(message) if message.__class__.__name__ == "Image" else []
