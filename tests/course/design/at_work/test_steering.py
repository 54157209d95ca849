"""Steering around what stands, or stood a moment ago, in the way; without ROS."""

from __future__ import annotations

import math

import pytest

from course.design.at_work.driving.memory import MEMORY_S, ObstacleMemory
from course.design.at_work.driving.steering import SPEED_MPS, STAND, steer
from course.design.at_work.meanings import Meaning, NodePart
from course.design.at_work.places.place import (
    BASE,
    MAP,
    Place,
    distance_between,
    on_floor,
    seen_from,
)
from course.design.at_work.worker import PATIENCE_S, Worker
from course.worlds.floor_plan import ROBOT_RADIUS_M

WAY = [Place(0.2 * n, 0.0) for n in range(1, 20)]
STEP_S = 0.1
FLOOR = {"width": 12.0, "height": 8.0, "walls": [], "shelves": []}


def post(x: float, y: float, radius: float = 0.15) -> list[Place]:
    """Return points around something round."""
    angles = [math.tau * n / 16 for n in range(16)]
    return [Place(x + radius * math.cos(a), y + radius * math.sin(a)) for a in angles]


def test_a_free_way_is_driven_straight_on() -> None:
    command, detour = steer(WAY, post(1.0, 1.0))
    assert command == (SPEED_MPS, 0.0)
    assert not detour


def test_a_detour_keeps_its_distance_and_comes_back_to_the_way() -> None:
    things = post(1.0, 0.1)
    command, detour = steer(WAY, things)
    assert command.turn < 0.0  # there is more room to the right
    assert detour[-1].y == pytest.approx(0.0)
    gap = min(math.dist(place[:2], thing[:2]) for place in detour for thing in things)
    assert gap > 0.2  # the robot's radius


def test_a_detour_is_stayed_with_as_long_as_it_is_free() -> None:
    _, right = steer(WAY, post(1.0, 0.1))
    moved = post(1.0, -0.02)
    assert steer(WAY, moved)[0].turn > 0.0
    command, detour = steer(WAY, moved, right)
    assert command.turn < 0.0
    assert detour == right
    command, detour = steer(WAY, post(0.8, -0.4, 0.3), right)
    assert command.turn > 0.0


def test_a_robot_at_a_corner_of_its_detour_drives_around_it() -> None:
    """Steering at what lay 0.6 m on along the detour, it stood for good, its nose at the post."""
    robot, thing = Place(6.46, 0.82, 0.66), Place(6.4, 1.3)
    corners = [(6.38, 0.73), (6.55, 0.72), (6.68, 0.87), (6.81, 1.01), (6.95, 1.16), (7.08, 1.3)]
    around = [Place(x, y) for x, y in corners]
    for _ in range(60):
        if distance_between(robot, around[-1]) < 0.3:
            break
        things = [seen_from(robot, place) for place in post(*thing[:2], 0.25)]
        detour = [seen_from(robot, place) for place in around]
        command, _ = steer(detour, things, detour)
        ahead = on_floor(robot, Place(command.speed * STEP_S, 0.0))
        robot = Place(ahead.x, ahead.y, robot.yaw + command.turn * STEP_S)
        assert distance_between(robot, thing) > 0.25 + ROBOT_RADIUS_M
    assert distance_between(robot, around[-1]) < 0.3


def test_it_stands_where_there_is_no_way() -> None:
    wall = [Place(0.5, y / 10) for y in range(-30, 31)]
    assert steer(WAY, wall)[0] == STAND


def test_what_was_found_is_remembered_for_a_while() -> None:
    memory = ObstacleMemory()
    memory.remember([Place(0.95, 2.0), Place(0.97, 2.0)], now=10.0)
    memory.remember([Place(3.0, 2.0)], now=12.0)
    assert len(memory.recall(10.0 + MEMORY_S - 0.1)) == 2
    assert memory.recall(10.0 + MEMORY_S + 0.1) == [Place(3.0, 2.0)]


def test_what_has_left_the_picture_is_where_it_was_on_the_floor() -> None:
    worker = Worker(NodePart("navigation", [], hears={Meaning.OBSTACLES}), FLOOR, Place(0.0, 0.0))
    worker.hear_pose(Place(2.0, 1.0, math.pi / 2), now=0.0)
    worker.hear_obstacles("obstacles", ([Place(1.0, 0.0)], BASE), now=0.0)
    worker.hear_pose(Place(2.0, 3.0, math.pi / 2), now=2.0)
    assert worker.in_the_way(2.0) is None  # nobody has said anything for longer than patience is
    worker.hear_obstacles("obstacles", ([], BASE), now=2.0)
    assert worker.obstacles(2.0) == []
    (place,) = worker.in_the_way(2.0) or []
    assert (place.x, place.y) == pytest.approx((-1.0, 0.0))
    worker.hear_obstacles("obstacles", ([Place(5.0, 5.0)], MAP), now=MEMORY_S)
    assert worker.in_the_way(MEMORY_S + PATIENCE_S) is None
