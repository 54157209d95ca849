"""Places on the floor in messages of many types: a pose, a path, obstacles, a grid, words."""

from __future__ import annotations

import importlib
import math
import re
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from rosidl_parser.definition import AbstractSequence, AbstractString, BasicType, NamespacedType

from course.design.at_work.places.arrays import cloud_slot, grid_slot
from course.design.at_work.places.place import BASE, FAR_M, MAP, Place, Slot

_FLOOR_FRAMES = (MAP, "odom")
_FRAME_TEXT = re.compile(r"(map|base_link):")
_PAIR = re.compile(r"(-?\d+\.\d+) (-?\d+\.\d+)")
_FLOATS = ("float", "double")
_NO_PLACE = (
    "Header", "Time", "Duration", "Twist", "TwistWithCovariance", "ColorRGBA", "MultiArrayLayout",
)  # fmt: skip
_DEEPEST = 6


def write_places(message: Any, places: Sequence[Place], frame: str) -> bool:
    """Write places into a message of any type; return whether it has room for them at all."""
    if (slot := find_slot(message)) is None:
        return False
    slot.put(places, frame)
    if hasattr(message, "header"):
        message.header.frame_id = frame
    return True


def read_places(message: Any, frame: str = MAP) -> tuple[list[Place], str]:
    """Return the places in a message, and their frame: ``frame`` if the message does not say."""
    if told := getattr(getattr(message, "header", None), "frame_id", ""):
        frame = MAP if told in _FLOOR_FRAMES else BASE
    for name, kind in _fields(message):
        text = getattr(message, name) if isinstance(kind, AbstractString) else ""
        if found := _FRAME_TEXT.match(text):
            frame = found.group(1)
    slot = find_slot(message)
    return ([], frame) if slot is None else (slot.get(), frame)


def has_room(msg_type: Any, *, many: bool = False) -> bool:
    """Return whether a message of a type can tell a place; with ``many``, more than one."""
    slot = find_slot(msg_type())
    return slot is not None and (slot.many or not many)


def place_fields(message: Any) -> list[Any]:
    """Return the fields of a request that can tell a place, in their order: start, then goal."""
    parts = [
        getattr(message, n) for n, kind in _fields(message) if isinstance(kind, NamespacedType)
    ]
    return [part for part in parts if find_slot(part) is not None]


def find_twist(message: Any) -> Any | None:
    """Return the Twist within a message of one of the four Twist types, or an Odometry; or None."""
    for _ in range(3):
        if hasattr(message, "linear") and hasattr(message, "angular"):
            return message
        message = getattr(message, "twist", None)
    return None


def find_slot(message: Any, depth: int = 0) -> Slot | None:
    """Return where places can stand in a message, or None."""
    name = type(message).__name__
    if name in _KNOWN:
        return _KNOWN[name](message)
    if name in _NO_PLACE or depth > _DEEPEST:
        return None
    fields = list(_fields(message))
    for find in (_in_part, _in_list, _in_measures, _in_text):
        for field, kind in fields:
            if slot := find(message, field, kind, depth):
                return slot
    return _in_numbers(message, [field for field, kind in fields if _is_float(kind)])


# Inside.


def _fields(message: Any) -> Iterator[tuple[str, Any]]:
    return zip(message.get_fields_and_field_types(), message.SLOT_TYPES, strict=True)


def _is_float(kind: Any) -> bool:
    return isinstance(kind, BasicType) and kind.typename in _FLOATS


def _in_part(message: Any, field: str, kind: Any, depth: int) -> Slot | None:
    is_part = isinstance(kind, NamespacedType)
    return find_slot(getattr(message, field), depth + 1) if is_part else None


def _in_list(message: Any, field: str, kind: Any, depth: int) -> Slot | None:
    """Find places in a list of messages, one in each."""
    if not isinstance(kind, AbstractSequence) or not isinstance(kind.value_type, NamespacedType):
        return None
    part = kind.value_type
    make = getattr(importlib.import_module(".".join(part.namespaces)), part.name)
    if find_slot(make(), depth + 1) is None:
        return None

    def put(places: Sequence[Place], frame: str) -> None:
        made = [make() for _ in places]
        for each, place in zip(made, places, strict=True):
            write_places(each, [place], frame)
        setattr(message, field, made)

    def get() -> list[Place]:
        slots = [find_slot(each, depth + 1) for each in getattr(message, field)]
        return [place for slot in slots if slot for place in slot.get()]

    return Slot(put, get, many=True)


def _in_measures(message: Any, field: str, kind: Any, _: int) -> Slot | None:
    """Find distances and bearings, one after the other, in a list of numbers."""
    if not isinstance(kind, AbstractSequence) or not _is_float(kind.value_type):
        return None

    def put(places: Sequence[Place], _: str) -> None:
        pairs = [(math.hypot(p.x, p.y), math.atan2(p.y, p.x)) for p in places]
        setattr(message, field, [number for pair in pairs for number in pair])

    def get() -> list[Place]:
        values = list(getattr(message, field))
        pairs = zip(values[::2], values[1::2], strict=False)
        return [Place(far * math.cos(at), far * math.sin(at)) for far, at in pairs]

    return Slot(put, get, many=True)


def _in_text(message: Any, field: str, kind: Any, _: int) -> Slot | None:
    if not isinstance(kind, AbstractString) or field == "frame_id":
        return None

    def put(places: Sequence[Place], frame: str) -> None:
        words = "; ".join(f"{place.x:.2f} {place.y:.2f}" for place in places)
        setattr(message, field, f"{frame}: {words}")

    def get() -> list[Place]:
        return [Place(float(x), float(y)) for x, y in _PAIR.findall(getattr(message, field))]

    return Slot(put, get, many=True)


def _in_numbers(message: Any, fields: list[str]) -> Slot | None:
    """Find x and y in two numbers, or how far something is in a single one."""
    if not fields:
        return None

    def put(places: Sequence[Place], _: str) -> None:
        first = places[0] if places else Place(FAR_M, 0.0)
        values = (first.x, first.y) if len(fields) > 1 else (math.hypot(first.x, first.y),)
        for field, value in zip(fields, values, strict=False):
            setattr(message, field, value)

    def get() -> list[Place]:
        values = [float(getattr(message, field)) for field in fields[:2]]
        return [Place(values[0], values[1] if values[1:] else 0.0, far_only=len(values) < 2)]

    return Slot(put, get)


def _of_point(point: Any) -> Slot:
    def put(places: Sequence[Place], _: str) -> None:
        point.x, point.y = (places[0].x, places[0].y) if places else (FAR_M, 0.0)

    return Slot(put, lambda: [Place(point.x, point.y)])


def _of_pose(pose: Any) -> Slot:
    turned = pose.orientation

    def put(places: Sequence[Place], _: str) -> None:
        place = places[0] if places else Place(FAR_M, 0.0)
        pose.position.x, pose.position.y = place.x, place.y
        turned.z, turned.w = math.sin(place.yaw / 2), math.cos(place.yaw / 2)

    def get() -> list[Place]:
        yaw = math.atan2(2 * (turned.w * turned.z), 1 - 2 * turned.z**2)
        return [Place(pose.position.x, pose.position.y, yaw)]

    return Slot(put, get)


def _of_range(message: Any) -> Slot:
    message.max_range = message.max_range or FAR_M
    return _in_numbers(message, ["range"]) or Slot(lambda *_: None, list)


_KNOWN: dict[str, Callable[[Any], Slot]] = {
    "Point": _of_point,
    "Point32": _of_point,
    "Pose": _of_pose,
    "Range": _of_range,
    "OccupancyGrid": grid_slot,
    "PointCloud2": cloud_slot,
}
