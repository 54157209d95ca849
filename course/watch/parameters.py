"""A node's parameters as a sheet: value, type, description and range, and what a change led to."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from rcl_interfaces.msg import Parameter, ParameterDescriptor, ParameterType, ParameterValue
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParameters,
)

from course.messages import yaml_text
from course.runtime.core_session import CoreSession
from course.watch.parameter_values import ParameterError, RefusedError, to_plain, to_value

_HIDDEN = ("use_sim_time", "start_type_description_service", "qos_overrides.")


@dataclass(frozen=True)
class SheetEntry:
    """One parameter; ``least``, ``most`` and ``step`` are None without a range in its descriptor.

    ``value`` is plain data, or None while it has none. ``kind`` is "checkbox", "slider", "number",
    "text" or "yaml".
    """

    name: str
    value: Any
    kind: str
    description: str = ""
    least: float | None = None
    most: float | None = None
    step: float | None = None
    read_only: bool = False


class ParameterSheet:
    """The parameters of one node, over its parameter services."""

    def __init__(self, session: CoreSession, node: str) -> None:
        """Look at ``node`` (fully qualified) of ``session``'s graph."""
        self.node = node
        self._session = session

    def list_names(self, timeout: float = 5.0) -> list[str]:
        """Return the names of all parameters, sorted.

        Raises:
            WaitTimeout: the node has no parameter services, or does not answer.
        """
        found = self._call_service(ListParameters, ListParameters.Request(), timeout).result.names
        return sorted(found)

    def read_entries(self, timeout: float = 5.0) -> list[SheetEntry]:
        """Return the parameters as they are now, by name; without those that ROS adds itself.

        Raises:
            WaitTimeout: the node has no parameter services, or does not answer.
        """
        names = [name for name in self.list_names(timeout) if not name.startswith(_HIDDEN)]
        described = self._fetch_descriptors(names, timeout)
        held = self._fetch_values([name for name in names if name in described], timeout)
        return [_make_entry(name, to_plain(value), described[name]) for name, value in held.items()]

    def get(self, name: str, timeout: float = 5.0) -> Any:
        """Return a parameter's value as plain data; None while it has none.

        Raises:
            ParameterError: there is no such parameter.
            WaitTimeout: the node does not answer.
        """
        self._require_descriptor(name, timeout)
        return to_plain(self._fetch_values([name], timeout)[name])

    def describe(self, name: str, timeout: float = 5.0) -> ParameterDescriptor:
        """Return what the node says of a parameter.

        Raises:
            ParameterError: there is no such parameter.
            WaitTimeout: the node does not answer.
        """
        return self._require_descriptor(name, timeout)

    def set(self, name: str, typed: Any, timeout: float = 5.0) -> None:
        """Change a parameter to what was typed (text is read as YAML).

        Raises:
            RefusedError: the node refused it, for the reason in the message.
            ParameterError: there is no such parameter, or it does not take such a value.
            WaitTimeout: the node does not answer.
        """
        value = to_value(name, typed, self._require_descriptor(name, timeout).type)
        request = SetParameters.Request(parameters=[Parameter(name=name, value=value)])
        (result,) = self._call_service(SetParameters, request, timeout).results
        if not result.successful:
            shown = yaml_text.one_line(to_plain(value))
            reason = " ".join(result.reason.split()) or "it gave no reason"
            raise RefusedError(f"{self.node} refused {name} = {shown}: {reason}")

    def _require_descriptor(self, name: str, timeout: float) -> ParameterDescriptor:
        found = self._fetch_descriptors([name], timeout).get(name)
        if found is None:
            known = ", ".join(self.list_names(timeout)) or "none"
            raise ParameterError(f"{self.node} has no parameter {name!r}: it has {known}.")
        return found

    def _fetch_descriptors(
        self, names: list[str], timeout: float
    ) -> dict[str, ParameterDescriptor]:
        request = DescribeParameters.Request(names=names)
        found = (
            self._call_service(DescribeParameters, request, timeout).descriptors if names else []
        )
        if len(found) != len(names) > 1:  # one of them has gone, so rclpy tells of none
            return {
                k: v for name in names for k, v in self._fetch_descriptors([name], timeout).items()
            }
        for descriptor in found:
            if descriptor.dynamic_typing:
                descriptor.type = ParameterType.PARAMETER_NOT_SET  # it takes any
        return dict(zip(names, found, strict=False))

    def _fetch_values(self, names: list[str], timeout: float) -> dict[str, ParameterValue]:
        asked = names
        found = self._call_service(
            GetParameters, GetParameters.Request(names=asked), timeout
        ).values
        if len(found) != len(asked):  # one of them has no value yet, so rclpy tells of none
            request = GetParameterTypes.Request(names=names)
            types = self._call_service(GetParameterTypes, request, timeout).types
            asked = [name for name, type_ in zip(names, types, strict=False) if type_]
            request = GetParameters.Request(names=asked)
            found = self._call_service(GetParameters, request, timeout).values
        held = dict(zip(asked, found, strict=False))
        return {name: held.get(name, ParameterValue()) for name in names}

    def _call_service(self, srv_type: Any, request: Any, timeout: float) -> Any:
        # ListParameters -> list_parameters, as every node names its parameter services.
        words = "".join(f"_{c.lower()}" if c.isupper() else c for c in srv_type.__name__)
        return self._session.call(srv_type, f"{self.node}/{words.strip('_')}", request, timeout)


def _make_entry(name: str, value: Any, descriptor: Any) -> SheetEntry:
    ranges = [*descriptor.floating_point_range, *descriptor.integer_range]
    limits = ranges[0] if ranges else None
    like = type(value) if value is not None else _LIKE.get(descriptor.type)
    if like is bool:
        kind = "checkbox"
    elif like in (int, float):
        kind = "slider" if limits and value is not None and _is_drawable(limits) else "number"
    else:
        kind = "text" if like is str else "yaml"
    least, most, step = (
        (limits.from_value, limits.to_value, limits.step or None) if limits else (None, None, None)
    )
    if descriptor.integer_range and not descriptor.floating_point_range:
        step = step or 1  # a browser cannot tell 1.0 from 1, so the kind of range decides
    return SheetEntry(
        name, value, kind, descriptor.description, least, most, step, descriptor.read_only
    )


def _is_drawable(limits: Any) -> bool:
    """Return whether a slider can have these ends: not infinity, nor what a browser rounds."""
    ends = (limits.from_value, limits.to_value)
    return all(math.isfinite(end) and yaml_text.for_json(end) == end for end in ends)


_LIKE = {
    ParameterType.PARAMETER_BOOL: bool,
    ParameterType.PARAMETER_INTEGER: int,
    ParameterType.PARAMETER_DOUBLE: float,
    ParameterType.PARAMETER_STRING: str,
}
