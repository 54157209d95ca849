"""Loading a type by its name, which may have come over the network and so be anybody's text.

Such a name is never an import path. It has to be spelled as ROS spells the names of interfaces, and
its package has to be one that is known to be made of interfaces: installed as such (in the ament
index), brought along by the course, or defined in this process.
"""

from __future__ import annotations

import importlib
import importlib.util
import re
from typing import Any

from course.interfaces import installed, packages
from course.interfaces.names import LOWER_CASE

_PARTS = ("get_fields_and_field_types", "Request", "Goal")
_KINDS = ("msg", "srv", "action")
_MEMBER = re.compile(r"[A-Z][A-Za-z0-9]*(_[A-Za-z]+)*")
"""The name of an interface, or of a part of one, as ``Fibonacci_FeedbackMessage`` is."""


class UnknownTypeError(LookupError):
    """A name that is of no type known here."""


def load(package: str, kind: str, name: str) -> Any:
    """Return the class of an interface.

    Raises:
        UnknownTypeError: there is none known here.
        CourseError: it is of a package of the learner's own that is not built yet; says what to do.
    """
    if kind in _KINDS and _MEMBER.fullmatch(name) and is_of_interfaces(package):
        try:
            found = _member(importlib.import_module(f"{package}.{kind}"), name)
        except (ImportError, AttributeError, ValueError):
            found = None
        if any(hasattr(found, part) for part in _PARTS):
            return found
    raise UnknownTypeError(f"{package}/{kind}/{name}")


def load_named(text: str) -> Any:
    """Return the class of an interface by its full name, such as ``std_msgs/msg/String``.

    Raises:
        UnknownTypeError: there is none known here.
        CourseError: it is of a package of the learner's own that is not built yet; says what to do.
    """
    parts = text.split("/")
    if len(parts) != 3:
        raise UnknownTypeError(text)
    return load(*parts)


def is_of_interfaces(package: str) -> bool:
    """Return whether a package is known to be made of interfaces; it is not imported."""
    if not LOWER_CASE.fullmatch(package):
        return False
    if package in installed.interfaces():
        return True
    try:
        spec = importlib.util.find_spec(package)
    except (ImportError, ValueError):
        return False
    return spec is not None and isinstance(spec.loader, packages.MadeHere)


def _member(module: Any, name: str) -> Any:
    found = getattr(module, name, None)
    if found is not None:
        return found
    first, *parts = name.split("_")
    found = getattr(module, first)
    for part in parts:
        holder = found if hasattr(found, part) else getattr(found, "Impl", found)
        found = getattr(holder, part, None) or getattr(holder, f"{part}Service")
    return found
