"""The types on a robot's graph, as far as they are installed where the examiner runs."""

# mypy: allow-untyped-calls

from __future__ import annotations

import importlib
from collections.abc import Iterable
from typing import Any

from course.design import dye
from course.interfaces import define

NAVIGATE_TO = "robot_msgs/action/NavigateTo"
NAVIGATE_TO_TEXT = """\
geometry_msgs/PoseStamped waypoint
---
bool arrived
string message
---
float32 distance_left
"""
"""The action that the notebook gives: the examiner needs its type, too."""


class UnknownTypeError(Exception):
    """A type on the graph that is not installed where the examiner runs."""


def load_type(name: str) -> Any:
    """Return the class of a type on the graph.

    Raises:
        UnknownTypeError: it is not installed.
    """
    if name == NAVIGATE_TO:
        return define(NAVIGATE_TO, NAVIGATE_TO_TEXT)
    package, kind, cls = name.split("/")
    try:
        return getattr(importlib.import_module(f"{package}.{kind}"), cls)
    except (ImportError, AttributeError):
        raise UnknownTypeError(name) from None


def bears_marks(names: Iterable[str]) -> bool:
    """Return whether messages of these types have room for dye; a type unknown here may have it."""
    return all(_bears_marks(name) for name in names)


def _bears_marks(name: str) -> bool:
    try:
        return dye.has_room(load_type(name))
    except UnknownTypeError:
        return True
