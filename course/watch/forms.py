"""A form made from a message type: the inputs it needs, and a message of what was typed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from rosidl_parser.definition import AbstractString, AbstractWString, BasicType, NamespacedType

from course.messages import values, yaml_text
from course.messages.types import type_name

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


def form_fields(msg_type: Any) -> list[Field]:
    """Return the inputs for a message of ``msg_type``, nested messages flattened by path."""
    flat = list(_flatten_fields(msg_type, msg_type(), ""))
    return flat if len(flat) <= MAX_FIELDS else list(_top_fields(msg_type, msg_type()))


def build_message(msg_type: Any, typed: Mapping[str, Any]) -> Any:
    """Return a message of what was typed into the inputs, by path; what is missing is default.

    Raises:
        MisfitError: there is no such input, or a text does not fit its field; the message names
            it.
    """
    known = {field.path: field for field in form_fields(msg_type)}
    data: dict[str, Any] = {}
    for path, value in typed.items():
        if path not in known:
            raise values.MisfitError(
                f"{type_name(msg_type)} has no field {path!r}: it has {', '.join(known) or 'none'}."
            )
        *above, last = path.split(".")
        place = data
        for name in above:
            place = place.setdefault(name, {})
        place[last] = _parse_input(known[path], value)
    return values.from_data(msg_type, data)


def _flatten_fields(msg_type: Any, default: Any, prefix: str) -> Iterator[Field]:
    for name, slot in values.message_fields(msg_type):
        value = getattr(default, name)
        if isinstance(slot, NamespacedType):
            yield from _flatten_fields(values.class_of(slot), value, f"{prefix}{name}.")
        else:
            yield _make_field(slot, value, prefix + name)


def _top_fields(msg_type: Any, default: Any) -> Iterator[Field]:
    for name, slot in values.message_fields(msg_type):
        yield _make_field(slot, getattr(default, name), name)


def _make_field(slot: Any, value: Any, path: str) -> Field:
    takes = values.in_words(slot)
    if isinstance(slot, AbstractString | AbstractWString):
        return Field(path, takes, "text", value)
    if isinstance(slot, BasicType):
        if slot.typename == "boolean":
            return Field(path, takes, "checkbox", "true" if value else "false")
        return Field(path, takes, "number", yaml_text.one_line(values.to_plain(value)))
    return Field(path, takes, "yaml", yaml_text.one_line(values.to_plain(value, None)))


def _parse_input(field: Field, typed: Any) -> Any:
    """Return what was typed as plain data; what is no text has been given by a program."""
    if not isinstance(typed, str):
        return typed
    if field.kind == "text":
        return typed
    try:
        read = yaml_text.parse_yaml(typed)
    except ValueError:
        read = None
    if read is None:
        raise values.MisfitError(
            f"{field.path} takes {field.takes}, not {yaml_text.short_repr(typed)}."
        )
    return read
