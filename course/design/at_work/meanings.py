"""What the messages of a design mean: told by their types, and by what their writers read.

A PoseStamped of the node that has the goal is a waypoint, that of a node that reads the wheels is
the robot's pose, and a PoseArray of a node that reads scans says what is in the way.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from course.design.at_work.places import messages as places
from course.design.at_work.places.place import BASE, MAP
from course.design.endpoints import DesignEndpoint, Role

NAVIGATE, MOTORS, WHEELS = "/navigate_to", "/motors/command", "/wheel/odometry"


class Meaning(StrEnum):
    """What messages tell. The values end sentences such as "it hears no pose"."""

    SCAN = "scan"
    IMAGE = "image"
    IMU = "inertial reading"
    ODOMETRY = "wheel odometry"
    MEASURED_SPEED = "measured speed"
    POSE = "pose"
    OBSTACLES = "obstacles"
    MAP = "map"
    GOAL = "waypoint"
    PATH = "path"
    VELOCITY = "velocity"
    OTHER = "news"


SENSED = (Meaning.SCAN, Meaning.IMAGE)
AHEAD = (Meaning.GOAL, Meaning.PATH)

_BOUNDARY = {
    "/scan": Meaning.SCAN, "/camera/image": Meaning.IMAGE, WHEELS: Meaning.ODOMETRY,
    "/map": Meaning.MAP,
}  # fmt: skip
_READINGS = {
    "LaserScan": Meaning.SCAN, "Image": Meaning.IMAGE, "CompressedImage": Meaning.IMAGE,
    "Imu": Meaning.IMU,
}  # fmt: skip
_TWISTS = ("Twist", "TwistStamped", "TwistWithCovariance", "TwistWithCovarianceStamped")
_POSES = ("Pose", "PoseStamped", "PoseWithCovariance", "PoseWithCovarianceStamped")


@dataclass
class NodePart:
    """A node as far as its part in the design goes.

    Attributes:
        label: what the design calls it.
        endpoints: what it is connected to.
        factory: what makes it, if the student has written it: what it does is up to its code.
        hears: what comes in, as far as it is known.
        tells: what it publishes or, of a map, hands out.
    """

    label: str
    endpoints: list[DesignEndpoint]
    factory: Any = None
    hears: set[Meaning] = field(default_factory=set)
    tells: set[Meaning] = field(default_factory=set)

    def ends(self, role: Role) -> list[DesignEndpoint]:
        """Return its endpoints of a role."""
        return [end for end in self.endpoints if end.role is role]

    @property
    def plan_clients(self) -> list[DesignEndpoint]:
        """The services that it calls for a way."""
        return [end for end in self.ends(Role.CALLS) if hands_out_places(end.type)]


def hands_out_map(srv_type: Any) -> bool:
    """Return whether a service answers with a map, as GetMap does."""
    fields = srv_type.Response.get_fields_and_field_types().values()
    return "nav_msgs/OccupancyGrid" in fields


def hands_out_places(srv_type: Any) -> bool:
    """Return whether a service can answer with a way: GetPlan, or Trigger in its text."""
    return not hands_out_map(srv_type) and places.has_room(srv_type.Response)


def find_meanings(parts: Iterable[NodePart]) -> dict[str, Meaning]:
    """Return what each topic and action carries, by full name; note in each part what it hears."""
    parts = list(parts)
    meanings: dict[str, Meaning] = {}
    for _ in range(len(parts) + 1):  # what a node hears decides on what it tells, and so on
        found: dict[str, Meaning] = {NAVIGATE: Meaning.GOAL}
        for part in parts:
            part.hears = _heard_by(part, {NAVIGATE: Meaning.GOAL} | _BOUNDARY | meanings)
            told = {end.full_name: _meaning_of(part, end) for end in part.ends(Role.PUBLISHES)}
            part.tells = set(told.values())
            part.tells |= {Meaning.MAP for e in part.ends(Role.SERVES) if hands_out_map(e.type)}
            for name, meaning in told.items():
                _note(found, name, meaning)
            for end in part.ends(Role.ACTION_CLIENT):
                _note(found, end.full_name, _sent_by(part))
        found = _BOUNDARY | found  # also of a sensor that nobody publishes
        if found == meanings:
            break
        meanings = found
    return meanings


def find_frames(parts: Iterable[NodePart], meanings: Mapping[str, Meaning]) -> dict[str, str]:
    """Return the frame in which each topic and action says where to drive, by full name.

    That is the floor's, unless somebody drives by it who is not told where the robot is.
    """
    frames = {name: MAP for name, meaning in meanings.items() if meaning in AHEAD}
    for part in parts:
        lost = not part.hears & {Meaning.POSE, Meaning.ODOMETRY, Meaning.MEASURED_SPEED}
        if lost and Meaning.VELOCITY in part.tells and part.factory is None:
            for end in part.ends(Role.SUBSCRIBES) + part.ends(Role.ACTION_SERVER):
                if end.full_name in frames and end.full_name != NAVIGATE:
                    frames[end.full_name] = BASE
    return frames


def _note(meanings: dict[str, Meaning], name: str, meaning: Meaning) -> None:
    """Keep what is known of a name: of several writers, the first that knows what it tells."""
    if meanings.get(name, Meaning.OTHER) is Meaning.OTHER:
        meanings[name] = meaning


def _heard_by(part: NodePart, meanings: Mapping[str, Meaning]) -> set[Meaning]:
    ends = part.ends(Role.SUBSCRIBES) + part.ends(Role.ACTION_SERVER)
    heard = {meanings.get(end.full_name, Meaning.OTHER) for end in ends}
    if any(hands_out_map(end.type) for end in part.ends(Role.CALLS)):
        heard.add(Meaning.MAP)
    if part.plan_clients and not any(
        places.place_fields(end.type.Request()) for end in part.plan_clients
    ):
        heard.add(Meaning.PATH)  # asked for without a goal: somebody else has it
    return heard


def _meaning_of(part: NodePart, end: DesignEndpoint) -> Meaning:
    kind, hears = end.type.__name__, part.hears
    if kind in _READINGS:
        return _READINGS[kind]
    if kind in _TWISTS:
        leads = end.full_name == MOTORS or hears & {*AHEAD, Meaning.VELOCITY, *SENSED}
        measured = not leads and Meaning.ODOMETRY in hears
        return Meaning.MEASURED_SPEED if measured else Meaning.VELOCITY
    if kind == "Odometry":
        return Meaning.ODOMETRY if end.full_name == WHEELS else Meaning.POSE
    if kind == "Path":
        return Meaning.PATH
    if not places.has_room(end.type) or kind == "DiagnosticArray":
        return Meaning.OTHER
    sees = bool(hears & {*SENSED, Meaning.OBSTACLES})
    if kind == "OccupancyGrid":
        return Meaning.OBSTACLES if sees and end.full_name != "/map" else Meaning.MAP
    if hears & {*AHEAD}:
        return Meaning.PATH if places.has_room(end.type, many=True) else Meaning.GOAL
    if kind in _POSES:
        return Meaning.POSE
    return Meaning.OBSTACLES if sees else Meaning.OTHER


def _sent_by(part: NodePart) -> Meaning:
    """Return what the goals of a node tell."""
    if part.hears & {*AHEAD}:
        return Meaning.PATH
    return Meaning.OBSTACLES if part.hears & {*SENSED, Meaning.OBSTACLES} else Meaning.OTHER
