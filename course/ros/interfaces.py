"""Interfaces: show the fields of a message, service or action."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

from course import plain, values
from course.errors import SessionError
from course.interfaces import installed
from course.runtime.names import type_name
from course.runtime.offers import load_type

NOUN = "interface"


def show(type: str) -> str:  # noqa: A002 - as the command line says
    """Show the definition of an interface; what is nested is indented."""
    return "\n".join(definition(type))


def list_(package: str = "") -> str:
    """List the installed interfaces, or those of one package."""
    known = installed.interfaces()
    if package and package not in known:
        raise SessionError(f"There is no package {package} with interfaces here.")
    return "\n".join(
        f"{name}/{interface}"
        for name in ([package] if package else sorted(known))
        for interface in sorted(known[name])
    )


def definition(name: str) -> list[str]:
    """Return an interface's fields, a line each, with the fields of nested messages below.

    Raises:
        SessionError: there is no such interface here.
    """
    cls = load_type(name)
    kinds = (("Goal", "Result", "Feedback"), ("Request", "Response"))
    named = next((names for names in kinds if hasattr(cls, names[0])), ())
    parts = [getattr(cls, part) for part in named] or [cls]
    lines: list[str] = []
    for number, part in enumerate(parts):
        lines += ["---"] if number else []
        lines += _fields(part, "")
    return lines


def _fields(msg_type: Any, indent: str) -> list[str]:
    lines = []
    for name, slot in values.fields(msg_type):
        lines.append(f"{indent}{values.in_words(slot)} {name}")
        inner = getattr(slot, "value_type", slot)
        if hasattr(inner, "namespaces"):
            lines += _fields(values.class_of(inner), indent + "\t")
    return [indent + constant for constant in _constants(msg_type)] + lines


def _constants(msg_type: Any) -> list[str]:
    """Return a line for each constant; Python knows no more of its type than that it is an int."""
    found = getattr(type(msg_type), f"_Metaclass_{msg_type.__name__}__constants", {})
    package, kind, name = type_name(msg_type).split("/")
    file = f"share/{package}/{kind}/{name.partition('_')[0]}.{kind}"
    try:
        text = (installed.prefix_of(package) / file).read_text(encoding="utf-8") if found else ""
    except (LookupError, OSError):  # built on this machine
        text = ""
    types = {line["name"]: line["type"] for line in _CONSTANT.finditer(text)}
    return [
        f"{types.get(key) or type(value).__name__} {key}={plain.one_line(values.to_plain(value))}"
        for key, value in found.items()
    ]


_CONSTANT = re.compile(r"^\s*(?P<type>[a-z]\S*)\s+(?P<name>[A-Z]\w*)\s*=", re.MULTILINE)


def _declare_show(add: Callable[..., Any]) -> None:
    add("type", help="as in sensor_msgs/msg/Image")


def _declare_list(add: Callable[..., Any]) -> None:
    add("package", nargs="?", default="")


VERBS = {"show": (show, _declare_show), "list": (list_, _declare_list)}
