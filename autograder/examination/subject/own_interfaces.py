"""The interfaces that notebooks bring along, built before a submission needs them.

A sandboxed program has the cache of built interfaces read-only: what is not in it, each one would
build for itself, and on a busy machine for longer than a cell may run.
"""

from __future__ import annotations

import functools
import threading

from course import interfaces
from course.interfaces.bundled import PACKAGES

NAVIGATE_TO = "robot_msgs/action/NavigateTo"
"""The action that the notebook on architecture gives: the examiner needs its type, too."""

DEFINITIONS = {
    NAVIGATE_TO: """\
geometry_msgs/PoseStamped waypoint
---
bool arrived
string message
---
float32 distance_left
""",
}

_lock = threading.Lock()


def build_interfaces() -> None:
    """Build what is not in the cache; without a compiler, programs get stand-ins as elsewhere."""
    with _lock:
        _build_once()


@functools.cache
def _build_once() -> None:
    try:
        for package in PACKAGES:
            interfaces.ensure(package)
        for name, text in DEFINITIONS.items():
            interfaces.ensure_definition(name, text)
    except interfaces.InterfaceError:
        return  # the notebook says so, where it uses one
