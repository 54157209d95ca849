"""Dye: a tag that travels in a message of any type, so that one can see how far it gets.

Water pipes are tested by pouring dye in at one end and looking for it at the other. Here a tag is
the dye: it stands in the message's text (``frame_id`` first) if there is any, else in its numbers.
"""

from __future__ import annotations

import importlib
import re
import secrets
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from rosidl_parser.definition import (
    AbstractNestedType,
    AbstractSequence,
    AbstractString,
    AbstractWString,
    Array,
    BasicType,
    NamespacedType,
)

TAGS = range(2**20, 2**24)
"""What a tag can be: a float32 still holds it exactly, and it is no reading of a sensor."""

_TEXT = re.compile(r"dye-(\d{7,8})")
_WIDE = {"float", "double", "int32", "uint32", "int64", "uint64"}
_BYTES = {"uint8", "int8", "octet"}
_LONGEST = len(f"dye-{TAGS.stop}")
_FRAME, _OTHER_TEXT, _NUMBER, _LIST, _STAMP = range(5)


@dataclass(frozen=True)
class _Place:
    """A place in a message that can hold a tag; `rank` says how well suited it is."""

    rank: int
    put: Callable[[int], None]
    get: Callable[[], int | None]


def fresh_tag() -> int:
    """Return a random tag."""
    return secrets.choice(TAGS)


def mark(message: Any, tag: int) -> bool:
    """Write `tag` into a message; return whether it has room for one.

    Raises:
        ValueError: `tag` is not one of `TAGS`.
    """
    if tag not in TAGS:
        raise ValueError(f"A tag is a number from {TAGS.start} to {TAGS.stop - 1}, not {tag}.")
    places = list(_places(message))
    best = min((place.rank for place in places), default=None)
    for place in places:
        if place.rank == best:
            place.put(tag)
    return best is not None


def read(message: Any) -> int | None:
    """Return the tag that a message carries, or None."""
    for place in sorted(_places(message), key=lambda place: place.rank):
        if (tag := place.get()) is not None:
            return tag
    return None


def carry(source: Any, target: Any) -> bool:
    """Write the tag of one message into another; return whether there was one and room for it.

    A node that you write yourself passes dye on with this line.
    """
    tag = read(source)
    return tag is not None and mark(target, tag)


def has_room(msg_type: Any) -> bool:
    """Return whether messages of a type can carry a tag: `std_msgs/msg/Bool` cannot."""
    return mark(msg_type(), TAGS.start)


def _places(message: Any) -> Iterator[_Place]:
    in_time = type(message).__module__.startswith("builtin_interfaces.")
    for name, kind in zip(message.get_fields_and_field_types(), message.SLOT_TYPES, strict=True):
        if isinstance(kind, NamespacedType):
            yield from _places(getattr(message, name))
        elif isinstance(kind, AbstractNestedType):
            yield from _in_list(message, name, kind)
        elif _holds_tag(kind):
            yield _field(message, name, kind, _STAMP if in_time else _rank(name, kind))


def _rank(name: str, kind: Any) -> int:
    if isinstance(kind, BasicType):
        return _NUMBER
    return _FRAME if name == "frame_id" else _OTHER_TEXT


def _holds_tag(kind: Any) -> bool:
    if isinstance(kind, AbstractString | AbstractWString):
        return bool(getattr(kind, "maximum_size", _LONGEST) >= _LONGEST)
    return isinstance(kind, BasicType) and kind.typename in _WIDE


def _field(message: Any, name: str, kind: Any, rank: int) -> _Place:
    return _Place(
        rank,
        lambda tag: setattr(message, name, _encoded(tag, kind)),
        lambda: _decoded(getattr(message, name)),
    )


def _in_list(message: Any, name: str, kind: Any) -> Iterator[_Place]:
    """Yield the first element of an array or sequence, if it can hold a tag."""
    element, values = kind.value_type, getattr(message, name)
    if isinstance(element, BasicType) and element.typename in _BYTES:
        yield from _in_bytes(message, name, kind)
    elif isinstance(kind, Array) and isinstance(element, NamespacedType):
        yield from _places(values[0])
    elif isinstance(element, NamespacedType):
        yield from _in_messages(message, name, element)
    elif _holds_tag(element):

        def put(tag: int) -> None:
            setattr(message, name, [_encoded(tag, element), *list(values)[1:]])

        yield _Place(_LIST, put, lambda: _decoded(values[0]) if len(values) else None)


def _in_messages(message: Any, name: str, element: Any) -> Iterator[_Place]:
    values = getattr(message, name)
    first = values[0] if len(values) else _load(element)()
    places = list(_places(first))
    if places:

        def put(tag: int) -> None:
            mark(first, tag)
            setattr(message, name, [first, *values[1:]])

        yield _Place(_LIST, put, lambda: read(first))


def _in_bytes(message: Any, name: str, kind: Any) -> Iterator[_Place]:
    room = kind.size if isinstance(kind, Array) else getattr(kind, "maximum_size", _LONGEST)
    if room < _LONGEST:
        return
    octets = kind.value_type.typename == "octet"

    def put(tag: int) -> None:
        text = f"dye-{tag}".encode()
        if not isinstance(kind, AbstractSequence):
            text = text.ljust(kind.size, b"\0")
        setattr(message, name, [bytes([b]) for b in text] if octets else list(text))

    def get() -> int | None:
        first = list(getattr(message, name)[:_LONGEST])
        text = b"".join(first) if octets else bytes(int(value) % 256 for value in first)
        return _decoded(text.decode(errors="replace"))

    yield _Place(_LIST, put, get)


def _load(element: Any) -> Any:
    return getattr(importlib.import_module(".".join(element.namespaces)), element.name)


def _encoded(tag: int, kind: Any) -> str | int | float:
    if not isinstance(kind, BasicType):
        return f"dye-{tag}"
    return float(tag) if kind.typename in ("float", "double") else tag


def _decoded(value: Any) -> int | None:
    if isinstance(value, str):
        found = _TEXT.search(value)
        value = int(found[1]) if found else 0
    number = float(value)
    return int(number) if number.is_integer() and int(number) in TAGS else None
