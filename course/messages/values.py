"""ROS messages as plain data (dicts, lists, numbers, strings), and back.

For what people type and read: a request on a command line, a form, a printed message. The rules of
each field are those of the ROS 2 interface definition.
"""

from __future__ import annotations

import array
import math
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

from rosidl_parser.definition import (
    AbstractSequence,
    AbstractString,
    AbstractType,
    AbstractWString,
    Array,
    BasicType,
    NamespacedType,
)

from course.errors import CourseError
from course.messages import yaml_text
from course.messages.types import type_name

MAX_SHOWN_ITEMS = 64
"""Elements of a sequence, or bytes, that `to_data` keeps by default; the rest is only counted."""

MAX_TEXT_CHARS = 2000
"""Characters of a text that it keeps then."""

_INTEGERS = {
    f"{sign}int{bits}": (0 if sign else -(2 ** (bits - 1)), 2 ** (bits if sign else bits - 1) - 1)
    for sign in ("", "u")
    for bits in (8, 16, 32, 64)
} | {"octet": (0, 255), "char": (0, 255)}
_FLOATS = {"float": 3.4028234663852886e38, "double": 1.7976931348623157e308}  # IEEE 754


class MisfitError(CourseError):
    """A value that does not fit its field; the message names the field and what it takes."""


def to_data(message: Any, longest: int | None = MAX_SHOWN_ITEMS) -> dict[str, Any]:
    """Return a message's fields as plain data, nested messages as dicts.

    Args:
        message: any ROS message.
        longest: keep so many elements of each sequence, and say how many more there are in a
            last element, and cut texts; None keeps all.
    """
    return {
        name: to_plain(getattr(message, name), longest) for name, _ in message_fields(type(message))
    }


def to_plain(value: Any, longest: int | None = MAX_SHOWN_ITEMS) -> Any:
    """Return the value of a field as plain data; see `to_data`."""
    if hasattr(value, "get_fields_and_field_types"):
        return to_data(value, longest)
    if isinstance(value, bytes):
        return value[0] if len(value) == 1 else list(value)
    if isinstance(value, str):
        more = 0 if longest is None else len(value) - MAX_TEXT_CHARS
        return f"{value[:MAX_TEXT_CHARS]}… {more} more" if more > 0 else value
    if isinstance(value, bool | int | float):
        return value
    # Cut first: as a list of numbers a picture takes many times the memory.
    kept = value if longest is None else value[:longest]
    items = kept.tolist() if hasattr(kept, "tolist") else list(kept)
    shown = [to_plain(item, longest) for item in items]
    return shown if len(kept) == len(value) else [*shown, f"… {len(value) - len(kept)} more"]


def from_text(msg_type: Any, text: str) -> Any:
    """Return a message of ``msg_type`` from YAML or JSON, as in ``{data: true}``.

    Raises:
        MisfitError: it is no YAML, or a value does not fit; says which field, and what it takes.
    """
    return from_data(msg_type, parse_text(msg_type, text))


def parse_text(msg_type: Any, text: str) -> Any:
    """Return the plain data of YAML or JSON that is to be a message of ``msg_type``.

    Raises:
        MisfitError: it is neither.
    """
    try:
        return yaml_text.parse_yaml(text) if text.strip() else {}
    except ValueError as error:
        raise MisfitError(
            f"{yaml_text.short_repr(text)} is not YAML ({error}): write the fields as in "
            f"{example_line(msg_type)}."
        ) from None


def from_data(msg_type: Any, data: Any) -> Any:
    """Return a message of ``msg_type`` whose fields have the values of ``data``.

    Fields that are left out keep their defaults.

    Raises:
        MisfitError: an unknown field, or a value that does not fit its field.
    """
    return _to_message(msg_type, data, "")


def message_fields(msg_type: Any) -> Iterator[tuple[str, AbstractType]]:
    """Yield (name, type) of each field, in the order of the definition."""
    for name, slot in all_fields(msg_type):
        if name != "structure_needs_at_least_one_member":
            yield name, slot


def all_fields(msg_type: Any) -> Iterator[tuple[str, AbstractType]]:
    """Yield the same, with the field that an empty message has on the wire."""
    yield from zip(msg_type.get_fields_and_field_types(), msg_type.SLOT_TYPES, strict=True)


def example_line(msg_type: Any) -> str:
    """Return a message of ``msg_type`` with its defaults, as one line of YAML."""
    return yaml_text.one_line(to_data(msg_type()))


def class_of(slot: NamespacedType) -> Any:
    """Return the message class of a field that is a message itself."""
    return _load_class("/".join((*slot.namespaces, slot.name)))


def in_words(slot: AbstractType) -> str:
    """Return what a field takes, as an interface definition says it (``float64[]``)."""
    if isinstance(slot, NamespacedType):
        return f"{slot.namespaces[0]}/{slot.name}"
    if isinstance(slot, Array):
        return f"{in_words(slot.value_type)}[{slot.size}]"
    if isinstance(slot, AbstractSequence):
        bound = getattr(slot, "maximum_size", None)
        return f"{in_words(slot.value_type)}[{f'<={bound}' if bound else ''}]"
    if isinstance(slot, AbstractString | AbstractWString):
        bound = getattr(slot, "maximum_size", None)
        kind = "string" if isinstance(slot, AbstractString) else "wstring"
        return f"{kind}<={bound}" if bound else kind
    assert isinstance(slot, BasicType)
    name: str = slot.typename
    return {"boolean": "bool", "double": "float64", "float": "float32", "octet": "byte"}.get(
        name, name
    )


@cache
def _load_class(name: str) -> Any:
    from course.messages.types import load_type

    return load_type(name)


def _to_message(msg_type: Any, data: Any, where: str) -> Any:
    if not isinstance(data, Mapping):
        raise MisfitError(
            f"{_describe_place(where, type_name(msg_type))} takes fields, as in "
            f"{example_line(msg_type)}, not "
            f"{yaml_text.short_repr(data)}."
        )
    slots = dict(message_fields(msg_type))
    for name in data:
        if name not in slots:
            raise MisfitError(
                f"{type_name(msg_type)} has no field {yaml_text.short_repr(name)}: it has "
                f"{', '.join(slots) or 'none'}."
            )
    message = msg_type()
    for name, given in data.items():
        place = f"{where}.{name}" if where else name
        fits = to_field(slots[name], given, place)
        try:
            setattr(message, name, fits)
        except (AssertionError, TypeError, ValueError, OverflowError):  # rosidl's own rules
            raise _misfit_error(place, slots[name], given) from None
    return message


def to_field(slot: AbstractType, value: Any, where: str) -> Any:
    """Return what a field of the type ``slot`` holds for plain data.

    Raises:
        MisfitError: it does not fit; the message calls the field ``where``.
    """
    if isinstance(slot, NamespacedType):
        return _to_message(class_of(slot), value, where)
    if isinstance(slot, Array | AbstractSequence):
        return _to_sequence(slot, value, where)
    if isinstance(slot, AbstractString | AbstractWString):
        return _to_string(slot, value, where)
    assert isinstance(slot, BasicType)
    return _to_basic(slot, value, where)


def _to_sequence(slot: Any, value: Any, where: str) -> Any:
    if not isinstance(value, list | tuple | bytes | array.array):
        raise _misfit_error(where, slot, value)
    size, bound = getattr(slot, "size", None), getattr(slot, "maximum_size", None)
    if size is not None and len(value) != size:
        raise MisfitError(f"{where} takes exactly {size} elements, not {len(value)}.")
    if bound and len(value) > bound:
        raise MisfitError(f"{where} takes at most {bound} elements, not {len(value)}.")
    return [to_field(slot.value_type, item, f"{where}[{n}]") for n, item in enumerate(value)]


def _to_string(slot: Any, value: Any, where: str) -> str:
    if not isinstance(value, str):
        raise _misfit_error(where, slot, value)
    bound = getattr(slot, "maximum_size", None)
    if bound and len(value) > bound:
        raise MisfitError(f"{where} takes at most {bound} characters, not {len(value)}.")
    if any(character == "\0" or "\ud800" <= character <= "\udfff" for character in value):
        # DDS would end the text at a NUL, and has no way to write half a character.
        raise MisfitError(
            f"{where} takes text without NUL and surrogate characters, not "
            f"{yaml_text.short_repr(value)}."
        )
    return value


def _to_basic(slot: BasicType, value: Any, where: str) -> Any:
    name = slot.typename
    if name == "boolean":
        if isinstance(value, bool):
            return value
    elif name in _INTEGERS:
        if isinstance(value, int) and not isinstance(value, bool):
            least, most = _INTEGERS[name]
            if least <= value <= most:
                return bytes([value]) if name == "octet" else value
            raise MisfitError(
                f"{where} takes {least} to {most}, not {yaml_text.short_repr(value)}."
            )
        if name == "octet" and isinstance(value, bytes) and len(value) == 1:
            return value
    elif isinstance(value, int | float) and not isinstance(value, bool):
        most = _FLOATS.get(name, math.inf)
        if -most <= value <= most or abs(value) == math.inf or value != value:
            return float(value)
        raise MisfitError(
            f"{where} takes {-most:.7g} to {most:.7g}, not {yaml_text.short_repr(value)}."
        )
    elif isinstance(value, str) and value.lower().lstrip("+-.") in ("nan", "inf", "infinity"):
        return float(value.replace(".", ""))
    raise _misfit_error(where, slot, value)


def _misfit_error(where: str, slot: AbstractType, value: Any) -> MisfitError:
    return MisfitError(f"{where} takes {in_words(slot)}, not {yaml_text.short_repr(value)}.")


def _describe_place(where: str, name: str) -> str:
    return f"{where} ({name})" if where else name
