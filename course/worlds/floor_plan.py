"""Floor plans: what stands on a floor, who walks there, where the robot starts; in YAML."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, Literal

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from course.errors import CourseError
from course.util.close_matches import did_you_mean

PLANS = Path(__file__).parent / "plans"
"""The folder of the plans that are installed with the package."""

ROBOT_RADIUS_M = 0.2
"""Seen from above, the robot is a disc of this radius."""

_MAX_FILE_BYTES = 200_000
_FURTHER = " (and {} more)"

Metres = Annotated[float, Field(allow_inf_nan=False)]
Point = tuple[Metres, Metres]
Four = tuple[Metres, Metres, Metres, Metres]


class FloorPlanError(CourseError):
    """A floor plan is not there or not sound; the message names file and field."""


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class StartPose(_Part):
    """Where the robot stands at first: m, and rad counter-clockwise from the x axis."""

    x: Metres
    y: Metres
    yaw: Metres = 0.0


class Place(_Part):
    """A place on the floor, in m."""

    x: Metres
    y: Metres


class Station(Place):
    """A place with a name, where parcels are handed over."""

    name: str = Field(min_length=1, max_length=30)


class Walker(_Part):
    """A person who walks along way points at a speed (m/s), and on to the first again."""

    path: list[Point] = Field(min_length=2, max_length=50)
    speed: float = Field(gt=0, le=3)
    radius: float = Field(default=0.25, ge=0.05, le=1)


class FloorPlan(_Part):
    """A rectangle of floor from (0, 0) to ``size``, with a wall around it, and what it holds.

    ``slip`` is the share of the wheels' travel that is lost, so that wheel odometry drifts.
    ``interfaces`` are what the robot offers beside its usual topics: a ``line`` that begins at the
    first station, a ``navigator``, speed ``limits``; see `course.worlds.interfaces`.
    """

    name: str = Field(pattern=r"^[a-z][a-z0-9_]{0,39}$")
    size: tuple[Annotated[float, Field(ge=2, le=100)], Annotated[float, Field(ge=2, le=100)]]
    start: StartPose
    charger: Place | None = None
    stations: list[Station] = Field(default=[], max_length=20)
    walls: list[Four] = Field(default=[], max_length=200)
    shelves: list[Four] = Field(default=[], max_length=100)
    people: list[Walker] = Field(default=[], max_length=20)
    slip: float = Field(default=0.0, ge=0, le=0.5)
    interfaces: list[Literal["line", "navigator", "limits"]] = Field(default=[], max_length=3)

    @model_validator(mode="after")
    def _hold_together(self) -> FloorPlan:
        for problem in _find_misplaced(self):
            raise ValueError(problem)
        return self

    @property
    def all_walls(self) -> list[Four]:
        """The outer walls and the others, each from x, y to x, y in m."""
        width, height = self.size
        outer: list[Four] = [
            (0.0, 0.0, width, 0.0), (width, 0.0, width, height),
            (width, height, 0.0, height), (0.0, height, 0.0, 0.0),
        ]  # fmt: skip
        return outer + self.walls


def plan_names() -> list[str]:
    """Return the names of the plans that are installed."""
    return sorted(path.stem for path in PLANS.glob("*.yaml"))


def load_floor_plan(name_or_path: str | Path) -> FloorPlan:
    """Return the floor plan of a name, such as ``"warehouse"``, or in the YAML file at a path.

    A text that ends in ``.yaml`` or has a slash in it is a path.

    Raises:
        FloorPlanError: there is none, or it is not sound; the message names file and field.
    """
    text = str(name_or_path)
    if isinstance(name_or_path, Path) or "/" in text or text.endswith((".yaml", ".yml")):
        return _read_plan(Path(text))
    if text not in (known := plan_names()):
        raise FloorPlanError(
            f"There is no world {text!r}: there are {', '.join(known)}, or give the path of a "
            f"floor plan of your own, such as './my_floor.yaml'.{did_you_mean(text, known)}"
        )
    return _read_plan(PLANS / f"{text}.yaml")


def _read_plan(path: Path) -> FloorPlan:
    try:
        with path.open("rb") as file:
            raw = file.read(_MAX_FILE_BYTES + 1)
        if len(raw) > _MAX_FILE_BYTES:
            raise FloorPlanError(
                f"{path.name} has more than {_MAX_FILE_BYTES // 1000} kB: a floor plan is a few "
                "lines, so give the path of another file."
            )
        data = yaml.safe_load(raw)
        return FloorPlan.model_validate(data)
    except FileNotFoundError:
        raise FloorPlanError(f"There is no floor plan {path}: look at its path.") from None
    except OSError as error:
        raise FloorPlanError(f"{path} cannot be read: {error.strerror or error}.") from None
    except yaml.YAMLError as error:
        raise FloorPlanError(f"{path.name} is not valid YAML: {_explain_yaml(error)}.") from None
    except ValidationError as error:
        raise FloorPlanError(_explain_schema(error, path.name)) from None


def _explain_yaml(error: yaml.YAMLError) -> str:
    problem = " ".join(str(getattr(error, "problem", None) or error).split())[:200]
    mark = getattr(error, "problem_mark", None)
    where = f"line {mark.line + 1}: " if mark else ""
    return f"{where}{problem}; look at the indentation and the brackets there"


def _explain_schema(error: ValidationError, source: str) -> str:
    """Return a fault as a sentence: an unknown field first, which may be why one is missing."""
    details = error.errors(include_url=False)
    first = next((each for each in details if each["type"] == "extra_forbidden"), details[0])
    more = _FURTHER.format(len(details) - 1) if len(details) > 1 else ""
    steps = [str(step + 1) if isinstance(step, int) else str(step) for step in first["loc"]]
    where = f"{source}, field {' '.join(steps)}" if steps else source
    kind, given = first["type"], first["input"]
    if kind == "extra_forbidden":
        known = _fields_at(first["loc"])
        phrase = f"there is no such field; there are {', '.join(known)}: rename or delete it"
        return f"{where}: {phrase}{more}.{did_you_mean(steps[-1], known)}"
    if kind == "missing":
        phrase = "it is missing: add it"
    elif kind == "model_type":
        phrase = "here must stand fields with their values, such as 'name: my_floor'"
    elif kind == "string_pattern_mismatch":
        phrase = f"{str(given)[:60]!r} is no name of a node: write lower-case letters, digits and _"
    elif kind == "value_error":
        return f"{source}, {first['ctx']['error']}{more}."
    else:
        rule = first["msg"].removeprefix("Input ").replace("should", "it must", 1)
        phrase = f"{rule}, not {str(given)[:60]!r}: correct it"
    return f"{where}: {phrase}{more}."


def _fields_at(location: tuple[int | str, ...]) -> list[str]:
    parts: dict[Any, type[BaseModel]] = {
        "start": StartPose, "charger": Place, "stations": Station, "people": Walker,
    }  # fmt: skip
    model = parts.get(location[0], FloorPlan) if len(location) > 1 else FloorPlan
    return list(model.model_fields)


def _find_misplaced(plan: FloorPlan) -> list[str]:
    """Return what does not stand where it can, each as a phrase that begins with its field."""
    width, height = plan.size
    places: list[tuple[str, float, float]] = [("start", plan.start.x, plan.start.y)]
    places += [("charger", plan.charger.x, plan.charger.y)] if plan.charger else []
    places += [(f"stations {i}", s.x, s.y) for i, s in enumerate(plan.stations, 1)]
    places += [
        (f"people {i} path", x, y) for i, who in enumerate(plan.people, 1) for x, y in who.path
    ]
    found = [
        f"field {field}: ({x:g}, {y:g}) is not on the floor, which goes from (0, 0) to "
        f"({width:g}, {height:g}): move it"
        for field, x, y in places
        if not (0 < x < width and 0 < y < height)
    ]
    found += [
        f"field shelves {i}: width and height must be above 0, not {w:g} and {h:g}: x and y are "
        "its lower left corner"
        for i, (_, _, w, h) in enumerate(plan.shelves, 1)
        if w <= 0 or h <= 0
    ]
    names = [station.name for station in plan.stations]
    found += [
        f"field stations {i} name: {name!r} is there already: give each its own name"
        for i, name in enumerate(names, 1)
        if name in names[: i - 1]
    ]
    if "line" in plan.interfaces and not plan.stations:
        found.append("field stations: a line begins at the first station, so write at least one")
    room = _room_at_start(plan)
    if not found and room < ROBOT_RADIUS_M:
        found.append(
            f"field start: the robot has a radius of {ROBOT_RADIUS_M:g} m, and something is "
            f"{room:.2f} m from its middle: move one of them"
        )
    return found


def _room_at_start(plan: FloorPlan) -> float:
    """Return how far the nearest wall or shelf is from the start, in m; 0 inside of a shelf."""
    x, y = plan.start.x, plan.start.y
    to_walls = [_distance_to_segment(x, y, wall) for wall in plan.all_walls]
    to_shelves = [
        math.hypot(max(left - x, 0.0, x - left - w), max(low - y, 0.0, y - low - h))
        for left, low, w, h in plan.shelves
    ]
    return min([*to_walls, *to_shelves])


def _distance_to_segment(x: float, y: float, wall: Four) -> float:
    x1, y1, x2, y2 = wall
    dx, dy = x2 - x1, y2 - y1
    length2 = dx * dx + dy * dy
    along = 0.0 if not length2 else ((x - x1) * dx + (y - y1) * dy) / length2
    along = min(1.0, max(0.0, along))
    return math.hypot(x - x1 - along * dx, y - y1 - along * dy)
