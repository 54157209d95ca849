"""What the nodes of a design could not do, a plain sentence each."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from course.design.at_work.meanings import (
    AHEAD,
    MOTORS,
    NAVIGATE,
    SENSED,
    Meaning,
    NodePart,
    hands_out_places,
)
from course.design.at_work.places import messages as places
from course.design.at_work.worker import Worker
from course.design.endpoints import Role

_DRIVERS = {"scan": Meaning.SCAN, "wheel/odometry": Meaning.ODOMETRY}


def list_design_gaps(parts: Sequence[NodePart]) -> list[str]:
    """Return what no node of a design does, or more than one."""
    return [*_motor_gaps(parts), *_sensor_gaps(parts), *_action_gaps(parts)]


def list_worker_gaps(worker: Worker, now: float) -> list[str]:
    """Return what one node cannot do now, as it does not hear what it takes."""
    part = worker.part
    gaps = []
    if Meaning.VELOCITY in part.tells:
        gaps.append(_why_no_drive(worker, now))
    if Meaning.POSE in part.tells and worker.pose(now) is None:
        gaps.append(f"{part.label} hears no wheel odometry: it cannot say where the robot is.")
    if Meaning.OBSTACLES in part.tells:
        gaps.append(_why_no_obstacles(worker, now))
    if any(hands_out_places(end.type) for end in part.ends(Role.SERVES)):
        gaps.append(_why_no_plan(worker, now))
    if _is_navigator(part) and worker.pose(now) is None:
        gaps.append(f"{part.label} hears no pose: it does not know where the robot is.")
    return [gap for gap in gaps if gap]


def _motor_gaps(parts: Sequence[NodePart]) -> Iterator[str]:
    drives = [part.label for part in parts if _publishes(part, MOTORS)]
    if not drives:
        yield "No node publishes motors/command: the motors stand still."
    if len(drives) > 1:
        yield (
            f"{' and '.join(drives)} publish motors/command: the motors do what they heard last, "
            "and the robot jerks if the two do not agree."
        )
    leads = [part for part in parts if Meaning.VELOCITY in part.tells and part.factory is None]
    if leads and not any(part.hears & {Meaning.OBSTACLES, *SENSED} for part in leads):
        names = " and ".join(part.label for part in leads)
        yield f"{names} cannot hear what is in the way: the robot drives into it."


def _sensor_gaps(parts: Sequence[NodePart]) -> Iterator[str]:
    for name, meaning in _DRIVERS.items():
        writers = [part for part in parts if _publishes(part, f"/{name}")]
        if not any(meaning in part.tells for part in writers):
            yield f"No node publishes {name} as it should be: nobody hears that sensor."


def _action_gaps(parts: Sequence[NodePart]) -> Iterator[str]:
    for part in parts:
        for end in part.ends(Role.ACTION_CLIENT):
            if end.full_name != NAVIGATE and not places.has_room(end.type.Goal):
                yield (
                    f"{part.label} cannot say in a goal of {end.full_name} where to drive: "
                    f"{end.type_name} has no room for a place."
                )
        if part.factory is not None:
            yield f"{part.label} is a node of your own: what it does is up to its code."


def _publishes(part: NodePart, name: str) -> bool:
    return any(end.full_name == name for end in part.ends(Role.PUBLISHES))


def _is_navigator(part: NodePart) -> bool:
    serves = any(end.full_name == NAVIGATE for end in part.ends(Role.ACTION_SERVER))
    return serves and Meaning.VELOCITY not in part.tells


def _why_no_drive(worker: Worker, now: float) -> str:
    part, label = worker.part, worker.part.label
    stands = "the motors stand still" if _publishes(part, MOTORS) else "it stands still"
    if Meaning.VELOCITY in part.hears:
        return (
            "" if worker.hears(Meaning.VELOCITY, now) else f"{label} hears no velocity: {stands}."
        )
    if not worker.needs_way:
        return f"{label} hears no velocity and no waypoint: {stands}."
    if worker.way(now) is None:
        return _why_no_way(worker, now, stands)
    if worker.needs_obstacles and (seen := worker.obstacles(now)) is None:
        return f"{label} hears nothing of obstacles: it does not drive blind, and {stands}."
    if worker.needs_obstacles and any(place.far_only for place in seen or ()):
        return (
            f"{label} hears how far an obstacle is, not where: it stops before it, and cannot "
            "drive around it."
        )
    return "" if worker.needs_path else f"{label} asks no planner: it drives straight on."


def _why_no_way(worker: Worker, now: float, stands: str) -> str:
    label, hears = worker.part.label, worker.part.hears
    told = worker.path if worker.needs_path else worker.goal
    if told is None and worker.needs_path and worker.pose(now) is not None:
        return f"{label} gets no path: {stands}."
    if told is None and Meaning.GOAL in hears and not worker.needs_path:
        return f"{label} hears no waypoint: {stands}."
    if worker.pose(now) is None and hears & {*AHEAD}:
        return f"{label} hears no pose: it does not know where the robot is, and {stands}."
    return f"{label} gets no path: {stands}."


def _why_no_obstacles(worker: Worker, now: float) -> str:
    part = worker.part
    if worker.obstacles(now) is None:
        return f"{part.label} sees nothing, no scan and no picture: it cannot find obstacles."
    if part.hears & {*SENSED, Meaning.OBSTACLES} == {Meaning.IMAGE}:
        return f"{part.label} sees only what the camera does: 60° ahead, from 0.9 m on."
    return ""


def _why_no_plan(worker: Worker, now: float) -> str:
    label = worker.part.label
    if worker.grid is None:
        return f"{label} has no map: it cannot plan." if worker.was_asked else ""
    if worker.was_asked and not worker.could_plan:
        return (
            f"{label} finds no path: it has to know the goal and where the robot is, and a way "
            "has to be there."
        )
    return ""
