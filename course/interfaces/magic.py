"""``%%interface package/kind/Name``: a cell whose text becomes a ROS interface."""

from __future__ import annotations

from typing import Any

from course.interfaces.defining import define
from course.interfaces.texts.type_names import parse_name


def register(shell: Any) -> None:
    """Register the magic with an IPython shell."""
    shell.register_magic_function(interface, magic_kind="cell", magic_name="interface")


def interface(line: str, cell: str) -> None:
    """Build the interface whose text is this cell, and make it importable.

    Usage::

        %%interface robot_msgs/srv/GetPose
        string robot
        ---
        geometry_msgs/Pose pose

    The kind is msg, srv or action. The text follows the ROS 2 interface definition format.
    """
    define(line, cell)
    name = parse_name(line)
    print(f"{name} is ready: {name.import_line}")  # noqa: T201  the answer to the learner's cell
