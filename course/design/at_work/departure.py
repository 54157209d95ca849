"""The beginning of a trip: the nodes come up, the robot is theirs, the waypoint is sent."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol

from rclpy.node import Node

from course.design.at_work.crew import Crew, Declared, bring_up
from course.design.at_work.meanings import NAVIGATE
from course.design.at_work.places import messages as places
from course.design.at_work.places.place import MAP, Place
from course.design.at_work.shortcomings import list_design_gaps
from course.design.at_work.trip import CABLES, Trip
from course.design.endpoints import DesignError
from course.design.findings import list_findings
from course.errors import WaitTimeout
from course.runtime.core_session import CoreSession
from course.runtime.requests.actions import GoalRun
from course.util.close_matches import did_you_mean
from course.worlds.running_world import RunningWorld

MOTORS = "motors/command"
"""The topic that the robot's motors hear."""


class DrivenWorld(Protocol):
    """What is used of a world that `course.world` makes."""

    session: CoreSession
    simulation: RunningWorld


class DrivingDesign(Protocol):
    """What is used of a design."""

    @property
    def nodes(self) -> Mapping[str, Declared]:
        """Its nodes, by label."""

    @property
    def outside(self) -> frozenset[str]:
        """The names whose other side is not part of it."""


def start_trip(
    design: DrivingDesign, world: DrivenWorld, to: Any,
    replace_nodes: Callable[[CoreSession], list[Node]],
) -> Trip:  # fmt: skip
    """Bring a design up as the nodes of a robot, and send the robot to a place.

    Args:
        design: the design.
        world: whose robot it drives.
        to: the name of a station, or x and y in m.
        replace_nodes: stops the nodes of an earlier run, and returns the list of the next ones.

    Raises:
        DesignError: there is no such station.
        SessionError: the world has ended.
    """
    session, simulation = world.session, world.simulation
    name, target = _find_target(simulation.describe_floor(), to)
    trip = Trip(simulation, name, target)
    nodes = replace_nodes(session)
    simulation.hand_over(trip.deliver, CABLES, MOTORS)
    robot = simulation.describe_moment()["robot"]
    start = Place(robot["x"], robot["y"], robot["yaw"])
    crew = bring_up(session, design.nodes, nodes.append, simulation.describe_floor(), start)
    gaps = [*list_design_gaps(crew.parts), *list_findings(crew.parts, design.outside)]
    trip.follow(crew, gaps)
    goal, refusal = _send_waypoint(session, crew, target)
    trip.follow(crew, [*filter(None, [refusal]), *gaps], goal)
    return trip


def _find_target(floor: Mapping[str, Any], to: Any) -> tuple[str, Place]:
    stations = {station["name"]: station for station in floor["stations"]}
    if isinstance(to, str):
        if to not in stations:
            raise DesignError(
                f"There is no station {to!r} here: there are {', '.join(stations) or 'none'}, or "
                f"give x and y in m.{did_you_mean(to, stations)}"
            )
        return to, Place(stations[to]["x"], stations[to]["y"])
    if not isinstance(to, tuple | list) or len(to) != 2:
        raise DesignError(f"Where to drive is the name of a station, or x and y in m, not {to!r}.")
    return f"({to[0]:g}, {to[1]:g})", Place(float(to[0]), float(to[1]))


def _send_waypoint(session: CoreSession, crew: Crew, target: Place) -> tuple[GoalRun | None, str]:
    """Send the waypoint as a person does; return the goal, or else why nobody took it."""
    if (action_type := crew.action_type) is None:
        return None, "No node serves navigate_to: nobody takes the waypoint."
    goal = action_type.Goal()
    if not places.write_places(goal, [target], MAP):
        return None, "The goals of navigate_to have no room for a place: nobody gets the waypoint."
    try:
        run = session.send_goal(action_type, NAVIGATE, goal)
    except WaitTimeout as error:
        return None, f"Nobody took the waypoint: {error}"
    return run, "" if run.accepted else "The waypoint was refused by the server of navigate_to."
