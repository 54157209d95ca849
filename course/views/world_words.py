"""A moment of a simulated world as text: what a screen reader reads, and a test."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from course.messages.yaml_text import format_count

NEAR_M = 1.5
"""Metres from a station within which it is named."""

MOVING = 0.005
"""Speed (m/s or rad/s) below which the robot stands."""

_HEADINGS = (
    "east", "north-east", "north", "north-west", "west", "south-west", "south", "south-east",
)  # fmt: skip
_SIDES = (
    "straight ahead", "ahead to the left", "to the left", "behind to the left", "behind",
    "behind to the right", "to the right", "ahead to the right",
)  # fmt: skip
_SOUND = {"works", "free", "there", "normal"}


def describe_world(
    floor: dict[str, Any], moment: dict[str, Any], topics: Sequence[dict[str, Any]], pace: str
) -> str:
    """Return a few lines about a moment; east is along x, and north along y.

    Args:
        floor: as `Simulation.describe_floor` returns it.
        moment: as `Simulation.describe_moment` returns it.
        topics: as `RunningWorld.topics` has them.
        pace: how the world's time goes ("paused").
    """
    robot = moment["robot"]
    lines = [
        f"{floor['name'].capitalize()}, {moment['time']:.1f} s, {pace}",
        f"The robot is at {describe_place(floor, robot)}, heading {name_heading(robot['yaw'])}, "
        f"{_describe_motion(robot)}.",
        _describe_nearest(moment["beams"]),
        f"Battery {robot['battery']:.0%}. Gripper {robot['gripper']}, "
        f"{'holding something' if robot['holding'] else 'empty'}. Emergency stop "
        f"{'pressed' if robot['stopped'] else 'released'}. Bumper "
        f"{'touches something' if robot['touching'] else 'free'}.",
        f"Faults: {', '.join(name_faults(moment['faults'])) or 'none'}.",
        _describe_marks(moment),
        *(f"News: {line}" for line in moment["news"]),
    ]
    if topics:
        rates = (f"{topic['name']} {_describe_rate(topic['rate'])}" for topic in topics)
        lines.append(f"Topics: {', '.join(rates)}.")
    return "\n".join(lines)


def describe_place(floor: dict[str, Any], robot: dict[str, Any]) -> str:
    """Return where the robot is, with the nearest station if one is near."""
    place = f"x {robot['x']:.2f} m, y {robot['y']:.2f} m"
    distances = [
        (math.hypot(station["x"] - robot["x"], station["y"] - robot["y"]), station["name"])
        for station in floor["stations"]
    ]
    distance, name = min(distances, default=(math.inf, ""))
    return f"{place} ({distance:.1f} m from {name})" if distance <= NEAR_M else place


def name_heading(yaw: float) -> str:
    """Return a yaw (rad, counter-clockwise from x) in words: "north-east (47°)"."""
    degrees = round(math.degrees(yaw)) % 360
    return f"{_HEADINGS[round(degrees / 45) % 8]} ({degrees}°)"


def name_faults(faults: dict[str, str]) -> list[str]:
    """Return what is broken, as "wheels jammed"."""
    return [f"{what} {state}" for what, state in faults.items() if state not in _SOUND]


def _describe_motion(robot: dict[str, Any]) -> str:
    speed, turn = robot["speed"], robot["turn"]
    parts = []
    if abs(speed) > MOVING:
        parts.append(f"driving {'forwards' if speed > 0 else 'backwards'} at {abs(speed):.2f} m/s")
    if abs(turn) > MOVING:
        parts.append(f"turning {'left' if turn > 0 else 'right'} at {abs(turn):.2f} rad/s")
    return " and ".join(parts) or "standing"


def _describe_nearest(beams: Sequence[float | None]) -> str:
    seen = [(beam, place) for place, beam in enumerate(beams) if beam is not None]
    if not seen:
        return "The LIDAR sees nothing."
    distance, place = min(seen)
    side = _SIDES[round(place / len(beams) * 8) % 8]
    return f"The nearest thing that the LIDAR sees is {distance:.2f} m away, {side}."


def _describe_marks(moment: dict[str, Any]) -> str:
    people, obstacles = len(moment["people"]), len(moment["obstacles"])
    persons = "1 person" if people == 1 else f"{people} people"
    parts = [f"On the floor: {persons}, {format_count(obstacles, 'obstacle')}."]
    if moment["path"]:
        x, y = moment["path"][-1]
        parts.append(
            f"The planned path has {format_count(len(moment['path']), 'point')} and ends at "
            f"({x:.1f}, {y:.1f})."
        )
    if moment["found"]:
        parts.append(f"Your nodes found {format_count(len(moment['found']), 'obstacle')}.")
    return " ".join(parts)


def _describe_rate(rate: float | None) -> str:
    return f"{rate:.1f} Hz" if rate else "now and then"
