"""Types of interfaces, and their names.

A name may have come over the network and so be anybody's text: it is never an import path. It has
to be spelled as ROS spells the names of interfaces, and its package has to be one that is known to
be made of interfaces: installed as such (in the ament index), brought along by the course, or
defined in this process.
"""

from __future__ import annotations

import importlib
import importlib.util
import re
from contextlib import suppress
from typing import Any

from course.errors import SessionError
from course.interfaces import installed, packages
from course.interfaces.texts.type_names import LOWER_CASE
from course.messages import yaml_text

_PARTS = ("get_fields_and_field_types", "Request", "Goal")
_KINDS = ("msg", "srv", "action")
_MEMBER = re.compile(r"[A-Z][A-Za-z0-9]*(_[A-Za-z]+)*")
"""The name of an interface, or of a part of one, as ``Fibonacci_FeedbackMessage`` is."""


_TYPE_NAME = re.compile(
    r"(?P<package>[A-Za-z][A-Za-z0-9_]*)/(?:(?P<kind>msg|srv|action)/)?(?P<name>[A-Za-z][A-Za-z0-9_]*)"
)
_EXAMPLES = {
    "msg": "std_msgs/msg/String",
    "srv": "std_srvs/srv/SetBool",
    "action": "example_interfaces/action/Fibonacci",
}


class UnknownTypeError(LookupError):
    """A name that is of no type known here."""


def load_class(package: str, kind: str, name: str) -> Any:
    """Return the class of an interface.

    Raises:
        UnknownTypeError: there is none known here.
        CourseError: it is of a package of the learner's own that is not built yet; says what to do.
    """
    if kind in _KINDS and _MEMBER.fullmatch(name) and is_of_interfaces(package):
        try:
            found = _find_member(importlib.import_module(f"{package}.{kind}"), name)
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
    return load_class(*parts)


def is_type_name(text: str) -> bool:
    """Return whether a text has the form of an interface's name, as ``std_msgs/msg/String`` has."""
    return _TYPE_NAME.fullmatch(text) is not None


def load_type(name: str, who: str = "", kind: str = "") -> Any:
    """Return the class of an interface such as ``std_msgs/msg/String``.

    Args:
        name: package, kind and name; the kind may be left out where `kind` says it, or else for
            a message.
        who: the topic or service that needs it, for the error.
        kind: "msg", "srv" or "action", if nothing else will do.

    Raises:
        SessionError: that is no name of an interface, of another kind, or not installed here.
    """
    found = _TYPE_NAME.fullmatch(name)
    if found is None:
        raise SessionError(
            f"{yaml_text.short_repr(name)} is not the name of an interface: write "
            f"package/kind/Name, as in {_EXAMPLES[kind or 'msg']}."
        )
    package, actual, cls = found["package"], found["kind"] or kind or "msg", found["name"]
    if kind and actual != kind:
        raise SessionError(f"{name} is no {kind} type: name one such as {_EXAMPLES[kind]}.")
    with suppress(UnknownTypeError):
        return load_class(package, actual, cls)
    why = (
        f"{who} carries {name}, which is not installed here" if who else f"There is no {name} here"
    )
    raise SessionError(
        f"{why}: install its package, or define it with `%%interface {package}/{actual}/{cls}`."
    )


def type_name(ros_type: Any) -> str:
    """Return a message, service or action type's name as on the graph: ``std_msgs/msg/String``."""
    package, kind = ros_type.__module__.split(".")[:2]
    return f"{package}/{kind}/{ros_type.__name__}"


def is_of_interfaces(package: str) -> bool:
    """Return whether a package is known to be made of interfaces; it is not imported."""
    if not LOWER_CASE.fullmatch(package):
        return False
    if package in installed.read_index():
        return True
    try:
        spec = importlib.util.find_spec(package)
    except (ImportError, ValueError):
        return False
    return spec is not None and isinstance(spec.loader, packages.MadeHere)


def _find_member(module: Any, name: str) -> Any:
    found = getattr(module, name, None)
    if found is not None:
        return found
    first, *parts = name.split("_")
    found = getattr(module, first)
    for part in parts:
        holder = found if hasattr(found, part) else getattr(found, "Impl", found)
        found = getattr(holder, part, None) or getattr(holder, f"{part}Service")
    return found
