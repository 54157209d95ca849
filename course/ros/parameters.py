"""Parameters: list a node's, read one, change one."""

# mypy: allow-untyped-calls

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import yaml
from rcl_interfaces.srv import GetParameters, ListParameters, SetParameters
from rclpy.parameter import Parameter, parameter_value_to_python

from course import ambient
from course.errors import SessionError
from course.graph import reader

NOUN = "param"


def list_(node: str = "") -> str:
    """List the parameters of a node, or of all."""
    names = [_full(node)] if node else list(reader.read(ambient.session().observer).nodes)
    lines = []
    for name in names:
        lines.append(f"{name}:")
        lines += [f"  {parameter}" for parameter in names_of(name)]
    return "\n".join(lines) or "No nodes."


def names_of(node: str) -> list[str]:
    """Return the names of a node's parameters, sorted.

    Raises:
        SessionError: there is no such node.
    """
    _require(node)
    response = ambient.call(ListParameters, f"{node}/list_parameters", ListParameters.Request())
    return sorted(response.result.names)


def get(node: str, name: str) -> str:
    """Show a parameter's value."""
    node = _full(node)
    _require(node)
    request = GetParameters.Request(names=[name])
    (value,) = ambient.call(GetParameters, f"{node}/get_parameters", request).values or (None,)
    if value is None or value.type == 0:
        raise SessionError(
            f"{node} has no parameter {name!r}: it has {', '.join(names_of(node)) or 'none'}."
        )
    return f"{parameter_value_to_python(value)}"


def set_(node: str, name: str, value: str) -> str:
    """Change a parameter; a value that the node refuses comes back with its reason."""
    node = _full(node)
    _require(node)
    try:
        parameter = Parameter(name, value=yaml.safe_load(value)).to_parameter_msg()
    except (TypeError, ValueError, yaml.YAMLError):
        raise SessionError(
            f"{value!r} is no value of a parameter: it takes true or false, a number, a text, or a "
            "list of one of them."
        ) from None
    request = SetParameters.Request(parameters=[parameter])
    (result,) = ambient.call(SetParameters, f"{node}/set_parameters", request).results
    if result.successful:
        return f"{node}: {name} is now {get(node, name)}"
    return f"{node} refused {name} = {value}: {result.reason or 'it gave no reason'}"


def _require(node: str) -> None:
    nodes = reader.read(ambient.session().observer, everything=True).nodes
    if node not in nodes:
        shown = ", ".join(reader.read(ambient.session().observer).nodes)
        raise SessionError(f"There is no node {node}: there are {shown or 'none'}.")


def _full(node: str) -> str:
    return node if node.startswith("/") else f"/{node}"


def _declare_list(add: Callable[..., Any]) -> None:
    add("node", nargs="?", default="")


def _declare_get(add: Callable[..., Any]) -> None:
    add("node")
    add("name")


def _declare_set(add: Callable[..., Any]) -> None:
    _declare_get(add)
    add("value", help="as YAML: true, 0.5, fast, [1, 2]")


VERBS = {
    "list": (list_, _declare_list),
    "get": (get, _declare_get),
    "set": (set_, _declare_set),
}
