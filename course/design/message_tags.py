"""Dye: a tag that travels in a message of any type, so that one can see how far it gets.

Water pipes are tested by pouring dye in at one end and looking for it at the other. Here a tag is
the dye: it stands in the message's text (``frame_id`` first) if there is any, else in its numbers.
A message that answers a question may carry several: the asker's own, and what else is known.
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
_MAX_PLACES = 4
"""How many tags a text can hold."""
_FRAME, _OTHER_TEXT, _NUMBER, _LIST, _STAMP = range(5)


@dataclass(frozen=True)
class _Place:
    """A place in a message that can hold a tag; `rank` says how well suited it is."""

    rank: int
    put: Callable[[list[int]], set[int]]  # returns those for which there is room
    get: Callable[[], list[int]]


def fresh_tag() -> int:
    """Return a random tag."""
    return secrets.choice(TAGS)


def mark(message: Any, *tags: int) -> set[int]:
    """Write `tags` into a message, and return those for which it has room: none, one, or several.

    One tag is written wherever there is a place for it.

    Raises:
        ValueError: one of `tags` is not one of `TAGS`.
    """
    for tag in tags:
        if tag not in TAGS:
            raise ValueError(f"A tag is a number from {TAGS.start} to {TAGS.stop - 1}, not {tag}.")
    places = list(_find_places(message))
    best = min((place.rank for place in places), default=None)
    suited = [place for place in places if place.rank == best]
    written: set[int] = set()
    for number, place in enumerate(suited if tags else ()):
        # Numbers hold one tag each: the first has the first tag, the next one the next.
        at = number % len(tags)
        written |= place.put([*tags[at:], *tags[:at]])
    return written


def read_tag(message: Any) -> int | None:
    """Return the tag that a message carries, the first if there are several, or None."""
    return next(iter(read_all(message)), None)


def read_all(message: Any) -> list[int]:
    """Return every tag that a message carries."""
    places = list(_find_places(message))
    if any(place.rank != _STAMP for place in places):
        # The time of a real reading can look like a tag; it bears one only where nothing else can.
        places = [place for place in places if place.rank != _STAMP]
    for rank in sorted({place.rank for place in places}):
        found = [tag for place in places if place.rank == rank for tag in place.get()]
        if found:
            return list(dict.fromkeys(found))
    return []


def carry(source: Any, target: Any) -> bool:
    """Write the mark of one message into another; return whether there was one and room for it.

    It stands in the text of ``target`` (``frame_id`` first), or in its numbers if it has no text.
    Marks that are there already stay as far as there is room, so what is made of several messages
    can carry the marks of each.

    A node that you write yourself passes marks on with this line.
    """
    tags = read_all(source)
    return bool(tags and mark(target, *dict.fromkeys([*tags, *read_all(target)])))


def has_room(msg_type: Any) -> bool:
    """Return whether messages of a type can carry a tag: `std_msgs/msg/Bool` cannot."""
    return bool(mark(msg_type(), TAGS.start))


def _find_places(message: Any) -> Iterator[_Place]:
    in_time = type(message).__module__.startswith("builtin_interfaces.")
    for name, kind in zip(message.get_fields_and_field_types(), message.SLOT_TYPES, strict=True):
        if isinstance(kind, NamespacedType):
            yield from _find_places(getattr(message, name))
        elif isinstance(kind, AbstractNestedType):
            yield from _in_list(message, name, kind)
        elif _holds_tag(kind):
            yield _field_place(message, name, kind, _STAMP if in_time else _rank_field(name, kind))


def _rank_field(name: str, kind: Any) -> int:
    if isinstance(kind, BasicType):
        return _NUMBER
    return _FRAME if name == "frame_id" else _OTHER_TEXT


def _holds_tag(kind: Any) -> bool:
    if isinstance(kind, AbstractString | AbstractWString):
        return bool(getattr(kind, "maximum_size", _LONGEST) >= _LONGEST)
    return isinstance(kind, BasicType) and kind.typename in _WIDE


def _field_place(message: Any, name: str, kind: Any, rank: int) -> _Place:
    def put(tags: list[int]) -> set[int]:
        fitting = tags[: _field_capacity(kind)]
        setattr(message, name, _encode_tags(fitting, kind))
        return set(fitting)

    return _Place(rank, put, lambda: _decode_tags(getattr(message, name)))


def _field_capacity(kind: Any) -> int:
    """Return how many tags a text or number holds."""
    return 1 if isinstance(kind, BasicType) else _text_capacity(getattr(kind, "maximum_size", None))


def _text_capacity(length: int | None) -> int:
    """Return how many tags a text of at most ``length`` characters holds."""
    return _MAX_PLACES if length is None else min(_MAX_PLACES, (length + 1) // (_LONGEST + 1))


def _in_list(message: Any, name: str, kind: Any) -> Iterator[_Place]:
    """Yield the first element of an array or sequence, if it can hold a tag."""
    element, values = kind.value_type, getattr(message, name)
    if isinstance(element, BasicType) and element.typename in _BYTES:
        yield from _in_bytes(message, name, kind)
    elif isinstance(kind, Array) and isinstance(element, NamespacedType):
        yield from _find_places(values[0])
    elif isinstance(element, NamespacedType):
        yield from _in_messages(message, name, element)
    elif _holds_tag(element):

        def put(tags: list[int]) -> set[int]:
            fitting = tags[: _field_capacity(element)]
            setattr(message, name, [_encode_tags(fitting, element), *list(values)[1:]])
            return set(fitting)

        yield _Place(_LIST, put, lambda: _decode_tags(values[0]) if len(values) else [])


def _in_messages(message: Any, name: str, element: Any) -> Iterator[_Place]:
    values = getattr(message, name)
    first = values[0] if len(values) else _load_element(element)()
    places = list(_find_places(first))
    if places:

        def put(tags: list[int]) -> set[int]:
            written = mark(first, *tags)
            setattr(message, name, [first, *values[1:]])
            return written

        yield _Place(_LIST, put, lambda: read_all(first))


def _in_bytes(message: Any, name: str, kind: Any) -> Iterator[_Place]:
    room = kind.size if isinstance(kind, Array) else getattr(kind, "maximum_size", None)
    if not _text_capacity(room):
        return
    octets = kind.value_type.typename == "octet"

    def put(tags: list[int]) -> set[int]:
        fitting = tags[: _text_capacity(room)]
        text = _format_tags(fitting).encode()
        if not isinstance(kind, AbstractSequence):
            text = text.ljust(kind.size, b"\0")
        setattr(message, name, [bytes([b]) for b in text] if octets else list(text))
        return set(fitting)

    def get() -> list[int]:
        first = list(getattr(message, name)[: _MAX_PLACES * (_LONGEST + 1)])
        text = b"".join(first) if octets else bytes(int(value) % 256 for value in first)
        return _decode_tags(text.decode(errors="replace"))

    yield _Place(_LIST, put, get)


def _load_element(element: Any) -> Any:
    return getattr(importlib.import_module(".".join(element.namespaces)), element.name)


def _format_tags(tags: list[int]) -> str:
    return " ".join(f"dye-{tag}" for tag in tags)


def _encode_tags(tags: list[int], kind: Any) -> str | int | float:
    if not isinstance(kind, BasicType):
        return _format_tags(tags)
    return float(tags[0]) if kind.typename in ("float", "double") else tags[0]


def _decode_tags(value: Any) -> list[int]:
    if isinstance(value, str):
        found = [int(digits) for digits in _TEXT.findall(value)[:_MAX_PLACES]]
        return [tag for tag in found if tag in TAGS]
    number = float(value)
    return [int(number)] if number.is_integer() and int(number) in TAGS else []
