"""Messages as a robot sends them: filled with something that a node can work on.

Dye only needs a message. A node that really computes needs a scan with distances in it, an image
with pixels, a path with a pose, an orientation that is one.
"""

from __future__ import annotations

import importlib
import math
import struct
import time
from array import array
from collections.abc import Callable
from typing import Any

from rosidl_parser.definition import (
    AbstractSequence,
    BasicType,
    BoundedSequence,
    NamespacedType,
)
from sensor_msgs.msg import PointField

from course.design import message_tags

AHEAD_M = 0.5
"""Metres to what is in the way."""
FAR_M = 4.0
"""Metres to the walls around."""
BEAMS = 180
ROOM = (8.0, 4.0)
"""Metres that a grid is long and wide: the robot is in it, and so is a goal ahead of it."""
BEHIND_M = 2.0
"""Metres of a grid that are behind the robot, and to either side of it."""
CELL_M = 0.2
"""Metres that a grid's cell is wide."""
_DEEPEST = 8
"""Messages within messages that are filled."""

_FLOATS = ("float", "double")


def lifelike_message(msg_type: Any, ahead: float = AHEAD_M) -> Any:
    """Return a message with content.

    Args:
        msg_type: its type.
        ahead: metres straight on to every place that it names.
    """
    message = msg_type()
    _fill_message(message, ahead, 0)
    return message


def _fill_message(message: Any, ahead: float, depth: int) -> None:
    for name, kind in zip(message.get_fields_and_field_types(), message.SLOT_TYPES, strict=True):
        if isinstance(kind, NamespacedType):
            _fill_message(getattr(message, name), ahead, depth)
        elif isinstance(kind, AbstractSequence) and depth < _DEEPEST:
            _fill_list(message, name, kind, ahead, depth)
    if (finish := _KNOWN.get(_type_name(message))) is not None:
        finish(message, ahead)


def _fill_list(message: Any, name: str, kind: Any, ahead: float, depth: int) -> None:
    """Give a list of places one place, and a list of measures a distance and a bearing."""
    element = kind.value_type
    if isinstance(element, NamespacedType) and element.namespaces[0] in _PACKAGES:
        first = getattr(importlib.import_module(".".join(element.namespaces)), element.name)()
        _fill_message(first, ahead, depth + 1)
        setattr(message, name, [first])
    elif isinstance(element, BasicType) and element.typename in _FLOATS:
        room = kind.maximum_size if isinstance(kind, BoundedSequence) else 2
        setattr(message, name, [ahead, 0.0][:room])


_PACKAGES = ("geometry_msgs", "nav_msgs", "visualization_msgs", "vision_msgs")
"""Packages whose lists name places: goals, poses, boxes."""


def _type_name(message: Any) -> str:
    cls = type(message)
    return f"{cls.__module__.split('.')[0]}/{cls.__name__}"


def _set_now(message: Any, _: float) -> None:
    message.sec, message.nanosec = divmod(time.time_ns(), 10**9)
    if message.nanosec in message_tags.TAGS:
        message.nanosec = 0  # a time must not look like a mark


def _set_ahead(message: Any, ahead: float) -> None:
    message.x = ahead


def _set_upright(message: Any, _: float) -> None:
    message.w = 1.0


def _at_the_start(message: Any, _: float) -> None:
    message.header.frame_id, message.child_frame_id = "odom", "base_link"
    message.pose.pose.position.x = 0.0


def _fill_scan(message: Any, ahead: float) -> None:
    message.header.frame_id = "laser"
    message.angle_min, message.angle_max = -math.pi / 2, math.pi / 2
    message.angle_increment = math.pi / (BEAMS - 1)
    message.scan_time, message.time_increment = 0.1, 0.1 / BEAMS
    message.range_min, message.range_max = 0.05, 2 * FAR_M
    middle = range(BEAMS // 2 - 5, BEAMS // 2 + 5)
    message.ranges = [ahead if beam in middle else FAR_M for beam in range(BEAMS)]
    message.intensities = [1.0] * BEAMS


def _fill_image(message: Any, _: float) -> None:
    message.header.frame_id = "camera"
    message.height, message.width, message.encoding = 12, 16, "rgb8"
    message.step = 3 * message.width
    message.data = array("B", [90, 120, 150] * (message.height * message.width))


def _fill_cloud(message: Any, ahead: float) -> None:
    message.header.frame_id = "laser"
    message.height, message.width, message.is_dense = 1, 1, True
    message.fields = [
        PointField(name=name, offset=4 * at, datatype=PointField.FLOAT32, count=1)
        for at, name in enumerate("xyz")
    ]
    message.point_step = message.row_step = 12
    message.data = array("B", struct.pack("<3f", ahead, 0.0, 0.2))


def _fill_grid(message: Any, ahead: float) -> None:
    message.header.frame_id = "map"
    width, height = (round(metres / CELL_M) for metres in ROOM)
    message.info.resolution, message.info.width, message.info.height = CELL_M, width, height
    message.info.origin.position.x = message.info.origin.position.y = -BEHIND_M
    cells = [0] * (width * height)
    cells[height // 2 * width + min(width - 1, int((ahead + BEHIND_M) / CELL_M))] = 100
    message.data = array("b", cells)


_KNOWN: dict[str, Callable[[Any, float], None]] = {
    "builtin_interfaces/Time": _set_now,
    "geometry_msgs/Point": _set_ahead,
    "geometry_msgs/Point32": _set_ahead,
    "geometry_msgs/Quaternion": _set_upright,
    "nav_msgs/OccupancyGrid": _fill_grid,
    "nav_msgs/Odometry": _at_the_start,
    "sensor_msgs/Image": _fill_image,
    "sensor_msgs/LaserScan": _fill_scan,
    "sensor_msgs/PointCloud2": _fill_cloud,
}
