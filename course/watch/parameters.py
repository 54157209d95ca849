"""A node's parameters as a sheet: value, type, description and range, and what a change led to."""

# mypy: allow-untyped-calls

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import yaml
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    ListParameters,
    SetParameters,
)
from rclpy.parameter import Parameter, parameter_value_to_python

from course.errors import CourseError
from course.runtime.session import Session

_HIDDEN = ("use_sim_time", "start_type_description_service", "qos_overrides.")


@dataclass(frozen=True)
class Entry:
    """One parameter; ``least``, ``most`` and ``step`` are None without a range in its descriptor.

    ``kind`` is "checkbox", "slider", "number", "text" or "yaml".
    """

    name: str
    value: Any
    kind: str
    description: str = ""
    least: float | None = None
    most: float | None = None
    step: float | None = None
    read_only: bool = False


class ParameterError(CourseError):
    """A parameter that cannot be changed as asked; the message has the node's own reason."""


class ParameterSheet:
    """The parameters of one node, over its parameter services."""

    def __init__(self, session: Session, node: str) -> None:
        """Look at ``node`` (fully qualified) of ``session``'s graph."""
        self.node = node
        self._session = session

    def entries(self, timeout: float = 5.0) -> list[Entry]:
        """Return the parameters as they are now, by name.

        Raises:
            WaitTimeout: the node has no parameter services, or does not answer.
        """
        found = self._call(ListParameters, ListParameters.Request(), timeout).result.names
        names = sorted(name for name in found if not name.startswith(_HIDDEN))
        if not names:
            return []
        got = self._call(GetParameters, GetParameters.Request(names=names), timeout).values
        described = self._call(
            DescribeParameters, DescribeParameters.Request(names=names), timeout
        ).descriptors
        return [
            _entry(name, parameter_value_to_python(value), descriptor)
            for name, value, descriptor in zip(names, got, described, strict=True)
        ]

    def set(self, name: str, typed: Any, timeout: float = 5.0) -> None:
        """Change a parameter to what was typed (text is read as YAML).

        Raises:
            ParameterError: the node refused it, for the reason in the message; or no such value.
            WaitTimeout: the node does not answer.
        """
        entry = next((e for e in self.entries(timeout) if e.name == name), None)
        if entry is None:
            raise ParameterError(f"{self.node} has no parameter {name!r}.")
        try:
            value = _typed(entry, typed)
            parameter = Parameter(name, value=value).to_parameter_msg()
        except (TypeError, ValueError, yaml.YAMLError):
            raise ParameterError(f"{name} takes {_takes(entry)}, not {typed!r}.") from None
        request = SetParameters.Request(parameters=[parameter])
        (result,) = self._call(SetParameters, request, timeout).results
        if not result.successful:
            raise ParameterError(
                f"{self.node} refused {name} = {value!r}: {result.reason or 'it gave no reason'}"
            )

    def _call(self, srv_type: Any, request: Any, timeout: float) -> Any:
        # ListParameters -> list_parameters, as every node names its parameter services.
        words = "".join(f"_{c.lower()}" if c.isupper() else c for c in srv_type.__name__)
        return self._session.call(srv_type, f"{self.node}/{words.strip('_')}", request, timeout)


def _entry(name: str, value: Any, descriptor: Any) -> Entry:
    ranges = [*descriptor.floating_point_range, *descriptor.integer_range]
    limits = ranges[0] if ranges else None
    if isinstance(value, bool):
        kind = "checkbox"
    elif isinstance(value, int | float):
        kind = "slider" if limits else "number"
    else:
        kind = "text" if isinstance(value, str) else "yaml"
    plain = value if value is None or isinstance(value, bool | int | float | str) else list(value)
    least, most, step = (
        (limits.from_value, limits.to_value, limits.step or None) if limits else (None, None, None)
    )
    return Entry(name, plain, kind, descriptor.description, least, most, step, descriptor.read_only)


def _typed(entry: Entry, typed: Any) -> Any:
    if isinstance(entry.value, bool):
        return typed in (True, "true")
    if isinstance(entry.value, str):
        return str(typed)
    value = yaml.safe_load(typed) if isinstance(typed, str) else typed
    if isinstance(entry.value, float):
        return float(value)
    if isinstance(entry.value, int) and (isinstance(value, bool) or int(value) != value):
        raise ValueError(value)
    return int(value) if isinstance(entry.value, int) else value


def _takes(entry: Entry) -> str:
    names = {bool: "true or false", int: "a whole number", float: "a number", str: "text"}
    return names.get(type(entry.value), "a list")
