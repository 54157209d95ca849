"""A form made from a message type: the inputs it needs, and a message of what was typed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import yaml
from rosidl_parser.definition import AbstractString, AbstractWString, BasicType, NamespacedType

from course import values

MAX_FIELDS = 60
"""Inputs that a form has at most; what a larger type nests deeper is typed as YAML."""


@dataclass(frozen=True)
class Field:
    """One input: the field's ``path`` ("pose.position.x"), what it takes, and its default as text.

    ``kind`` is "checkbox", "number", "text" or "yaml".
    """

    path: str
    takes: str
    kind: str
    default: str


def fields(msg_type: Any) -> list[Field]:
    """Return the inputs for a message of ``msg_type``, nested messages flattened by path."""
    flat = list(_flatten(msg_type, msg_type(), ""))
    return flat if len(flat) <= MAX_FIELDS else list(_top(msg_type, msg_type()))


def message(msg_type: Any, typed: Mapping[str, Any]) -> Any:
    """Return a message of what was typed into the inputs, by path; what is missing is default.

    Raises:
        MisfitError: a text that does not fit its field; the message names it.
    """
    data: dict[str, Any] = {}
    for field in fields(msg_type):
        if field.path in typed:
            *above, last = field.path.split(".")
            place = data
            for name in above:
                place = place.setdefault(name, {})
            place[last] = _parsed(field, typed[field.path])
    return values.from_data(msg_type, data)


def _flatten(msg_type: Any, default: Any, prefix: str) -> Iterator[Field]:
    for name, slot in values.fields(msg_type):
        value = getattr(default, name)
        if isinstance(slot, NamespacedType):
            yield from _flatten(values.class_of(slot), value, f"{prefix}{name}.")
        else:
            yield _field(slot, value, prefix + name)


def _top(msg_type: Any, default: Any) -> Iterator[Field]:
    for name, slot in values.fields(msg_type):
        yield _field(slot, getattr(default, name), name)


def _field(slot: Any, value: Any, path: str) -> Field:
    takes = values.in_words(slot)
    if isinstance(slot, AbstractString | AbstractWString):
        return Field(path, takes, "text", value)
    if isinstance(slot, BasicType):
        if slot.typename == "boolean":
            return Field(path, takes, "checkbox", "true" if value else "false")
        plain = value[0] if isinstance(value, bytes) else value
        return Field(path, takes, "number", f"{plain}")
    plain = values.to_data(value) if isinstance(slot, NamespacedType) else list(value)
    text = yaml.safe_dump(plain, default_flow_style=True, width=10**6)
    return Field(path, takes, "yaml", text.strip())


def _parsed(field: Field, typed: Any) -> Any:
    if field.kind == "checkbox":
        return typed in (True, "true")
    if field.kind == "text":
        return str(typed)
    try:
        return yaml.safe_load(str(typed))
    except yaml.YAMLError:
        raise values.MisfitError(f"{field.path} takes {field.takes}, not {typed!r}.") from None
