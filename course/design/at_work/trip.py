"""A trip of a simulated robot that a design drives: how it goes, and what the nodes lack."""

from __future__ import annotations

import math
from contextlib import suppress
from html import escape
from typing import Any

from rclpy.exceptions import InvalidHandle

from course.design.at_work.crew import Crew
from course.design.at_work.meanings import Meaning
from course.design.at_work.places.place import MAP, Place, distance_between, on_floor
from course.design.at_work.shortcomings import list_worker_gaps
from course.runtime.requests.actions import GoalRun
from course.worlds.running_world import RunningWorld
from course.worlds.simulation import AT_PLACE_M

GRACE_S = 2.0
"""Seconds of the world's time until it is said what a node lacks: all may have just begun."""

STANDING_S = 4.0
"""Seconds without motion after which the robot is said to stand."""

CABLES = {  # topic of the world: what it tells
    "scan": Meaning.SCAN,
    "camera/image": Meaning.IMAGE,
    "wheel/odometry": Meaning.ODOMETRY,
    "imu/data": Meaning.IMU,
}
_LOOK_EVERY = 4  # readings of the wheels, which come at 20 Hz
_MOVING = 0.01  # m/s or rad/s
SHOWN_M, APART_M = 1.3, 0.45
"""Metres within which what was found is drawn, and metres between two marks of it."""

_MAX_TOUCHES = 5


class Trip:
    """The way of the robot to one place. It shows itself, and changes as the robot drives.

    Attributes:
        arrived: whether the robot stands at the place.
        touched: what it has driven into or was touched by, a sentence each; the first five.
        gaps: what nodes could not do, a sentence each, as long as it was under way.
    """

    def __init__(self, world: RunningWorld, name: str, target: Place) -> None:
        """Begin a trip in ``world`` to the place ``target`` of a name; `follow` makes it go on."""
        self.arrived = False
        self.touched: list[str] = []
        self.gaps: list[str] = []
        self._world, self._name, self._target = world, name, target
        self._crew = Crew([], [])
        self._goal: GoalRun | None = None
        self._known_gaps: list[str] = []
        self._lacking: list[str] = []
        self._began = self._moved = world.time_s
        self._looks = 0
        self._headline = f"The robot is on its way to {name}."
        self._shown = ""
        self._handle: Any = None

    def follow(self, crew: Crew, gaps: list[str], goal: GoalRun | None = None) -> None:
        """Follow the nodes that drive and the goal that they have; ``gaps`` are known already."""
        self._crew, self._known_gaps, self._goal = crew, gaps, goal

    def deliver(self, topic: str, message: Any) -> None:
        """Take what comes out of the robot: hand readings to their drivers, and look."""
        meaning = CABLES.get(topic)
        if meaning is not None:
            for node in self._crew.drivers(meaning):
                with suppress(InvalidHandle):  # it was stopped just now
                    node.take_reading(meaning, message)
        if topic == "bumper" and message.data and not self.arrived:
            news = self._world.describe_moment()["news"]
            self.touched = [*self.touched, *news[-1:]][:_MAX_TOUCHES]
        if topic == "wheel/odometry":
            self._looks += 1
            if self._looks % _LOOK_EVERY == 0:
                self._look()

    def lines(self) -> list[str]:
        """Return how it goes, what was touched, and what nodes could not do."""
        return [self._headline, *self.touched, *self.gaps]

    def __repr__(self) -> str:
        """Return the same as text."""
        return "\n  ".join(self.lines())

    # Inside.

    def _look(self) -> None:
        moment, now = self._world.describe_moment(), self._world.time_s
        robot = moment["robot"]
        place = Place(robot["x"], robot["y"], robot["yaw"])
        left = distance_between(place, self._target)
        moves = abs(robot["speed"]) > _MOVING or abs(robot["turn"]) > _MOVING
        self._moved = now if moves else self._moved
        if not self.arrived:
            if left < AT_PLACE_M and not moves:
                self.arrived = True
                self._headline = (
                    f"The robot arrived at {self._name} after {now - self._began:.1f} s."
                )
                self._world.tell(f"The robot arrived at {self._name}")
                self._world.show_plans([], [])
            else:
                self._describe_way(left, now)
                self._show_plans(place)
        self._update_output()

    def _describe_way(self, left: float, now: float) -> None:
        goal = self._goal if self._goal is not None and self._goal.accepted else None
        if now - self._began >= GRACE_S and (goal is None or not goal.done):
            self._lacking = [
                gap
                for node in self._crew.working
                for gap in list_worker_gaps(node.worker, node.now_s)
            ]
        self.gaps = [*self._known_gaps, *self._lacking]
        if now - self._moved < STANDING_S:
            self._headline = f"The robot is on its way to {self._name}."
            return
        self._headline = f"The robot stands still, {left:.1f} m away from {self._name}."
        if goal is not None and goal.done:
            self._headline += f" The goal is over: {goal.status.name}."

    def _show_plans(self, robot: Place) -> None:
        """Show the path that a node has, and what those that drive have heard of nearby."""
        path: list[Place] = []
        found: list[Place] = []
        for node in self._crew.working:
            worker = node.worker
            if worker.path is not None and not path:
                path = worker.way_in(MAP, node.now_s) or []
            if Meaning.VELOCITY in worker.part.tells and not found:
                found = _choose_shown(worker.obstacles(node.now_s) or [])
        places_found = [on_floor(robot, place) for place in found]
        self._world.show_plans([(p.x, p.y) for p in path], [(p.x, p.y) for p in places_found])

    def _ipython_display_(self) -> None:
        from IPython.display import display

        self._shown = repr(self)
        self._handle = display(self._as_output(), raw=True, display_id=True)  # type: ignore[no-untyped-call]

    def _update_output(self) -> None:
        if self._handle is not None and self._shown != (text := repr(self)):
            self._shown = text
            with suppress(Exception):  # the front end may be gone: the output stays as it was
                self._handle.update(self._as_output(), raw=True)

    def _as_output(self) -> dict[str, str]:
        first, *rest = map(escape, self.lines())
        items = "".join(f"<li>{line}</li>" for line in rest)
        return {
            "text/plain": repr(self),
            "text/html": f'<div role="status"><b>{first}</b><ul>{items}</ul></div>',
        }


def _choose_shown(found: list[Place]) -> list[Place]:
    """Return some of what was found ahead and nearby, apart from each other, to be drawn."""
    shown: list[Place] = []
    for place in found:
        ahead = place.x > abs(place.y) and not place.far_only
        near = ahead and math.hypot(place.x, place.y) < SHOWN_M
        if near and all(distance_between(place, other) > APART_M for other in shown):
            shown.append(place)
    return shown
