"""Interfaces: show the fields of a message, service or action."""

from __future__ import annotations

import re
from typing import Any

from course.errors import SessionError
from course.interfaces import installed
from course.messages import values, yaml_text
from course.messages.types import load_type, type_name
from course.ros_magic.options import Add

NOUN = "interface"


def show(asked: str, no_comments: bool = True) -> str:
    """Show the definition of an interface; what is nested is indented."""
    return "\n".join(definition_lines(asked))


def list_(package: str = "", only: str = "") -> str:
    """List the installed interfaces, or those of one package or kind."""
    known = installed.read_index()
    if package and package not in known:
        raise SessionError(f"There is no package {package} with interfaces here.")
    return "\n".join(
        f"{name}/{interface}"
        for name in ([package] if package else sorted(known))
        for interface in sorted(known[name])
        if interface.startswith(only)
    )


def packages() -> str:
    """List the packages that define interfaces."""
    return "\n".join(sorted(installed.read_index()))


def proto(asked: str) -> str:
    """Show a message, request or goal with its defaults, to be edited."""
    cls = _load_interface(asked)
    return f'"{values.example_line(getattr(cls, "Request", getattr(cls, "Goal", cls)))}"'


def definition_lines(name: str) -> list[str]:
    """Return an interface's fields, a line each, with the fields of nested messages below.

    Raises:
        SessionError: there is no such interface here.
    """
    cls = _load_interface(name)
    kinds = (("Goal", "Result", "Feedback"), ("Request", "Response"))
    named = next((names for names in kinds if hasattr(cls, names[0])), ())
    parts = [getattr(cls, part) for part in named] or [cls]
    lines: list[str] = []
    for number, part in enumerate(parts):
        lines += ["---"] if number else []
        lines += _field_lines(part, "")
    return lines


def _load_interface(name: str) -> Any:
    """Return the class of an interface; of a kind that is left out, the first that there is.

    Raises:
        SessionError: there is none.
    """
    package, slash, last = name.partition("/")
    known = installed.read_index().get(package, ())
    kinds = [kind for kind in ("msg", "srv", "action") if f"{kind}/{last}" in known]
    return load_type(f"{package}/{kinds[0]}/{last}" if slash and kinds else name)


def _field_lines(msg_type: Any, indent: str) -> list[str]:
    lines = []
    for name, slot in values.message_fields(msg_type):
        lines.append(f"{indent}{values.in_words(slot)} {name}")
        inner = getattr(slot, "value_type", slot)
        if hasattr(inner, "namespaces"):
            lines += _field_lines(values.class_of(inner), indent + "\t")
    return [indent + constant for constant in _constant_lines(msg_type)] + lines


def _constant_lines(msg_type: Any) -> list[str]:
    """Return a line for each constant; Python knows no more of its type than that it is an int."""
    found = getattr(type(msg_type), f"_Metaclass_{msg_type.__name__}__constants", {})
    package, kind, name = type_name(msg_type).split("/")
    file = f"share/{package}/{kind}/{name.partition('_')[0]}.{kind}"
    try:
        text = (installed.prefix_of(package) / file).read_text(encoding="utf-8") if found else ""
    except (LookupError, OSError):  # built on this machine
        text = ""
    types = {line["name"]: line["type"] for line in _CONSTANT.finditer(text)}
    kinds = {key: types.get(key) or type(value).__name__ for key, value in found.items()}
    return [
        f"{kinds[key]} {key}={yaml_text.one_line(values.to_plain(value))}"
        for key, value in found.items()
    ]


_CONSTANT = re.compile(r"^\s*(?P<type>[a-z]\S*)\s+(?P<name>[A-Z]\w*)\s*=", re.MULTILINE)


def _declare_type(add: Add) -> None:
    add("asked", metavar="TYPE", help="as in sensor_msgs/msg/Image")


def _declare_show(add: Add) -> None:
    _declare_type(add)
    add("--no-comments", action="store_true", help="as it is shown anyway")


def _declare_list(add: Add) -> None:
    add("package", metavar="PACKAGE", nargs="?", default="")
    for letter, kind, what in (
        ("m", "msg", "msgs"),
        ("s", "srv", "srvs"),
        ("a", "action", "actions"),
    ):
        add(f"-{letter}", f"--only-{what}", dest="only", action="store_const", const=f"{kind}/",
            default="", help=f"{what} alone")  # fmt: skip


def _declare_package(add: Add) -> None:
    add("package", metavar="PACKAGE")


VERBS = {
    "show": (show, _declare_show),
    "list": (list_, _declare_list),
    "package": (list_, _declare_package),
    "packages": (packages, lambda _add: None),
    "proto": (proto, _declare_type),
}
