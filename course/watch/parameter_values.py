"""Values of parameters as plain data, and back, by the type that the node has declared."""

from __future__ import annotations

from typing import Any

from rcl_interfaces.msg import ParameterType, ParameterValue

from course.errors import CourseError
from course.messages import values, yaml_text

TYPES = {
    ParameterType.PARAMETER_BOOL: ("bool_value", "true or false"),
    ParameterType.PARAMETER_INTEGER: ("integer_value", "a whole number"),
    ParameterType.PARAMETER_DOUBLE: ("double_value", "a number"),
    ParameterType.PARAMETER_STRING: ("string_value", "text"),
    ParameterType.PARAMETER_BYTE_ARRAY: ("byte_array_value", "a list of bytes (0 to 255)"),
    ParameterType.PARAMETER_BOOL_ARRAY: ("bool_array_value", "a list of true and false"),
    ParameterType.PARAMETER_INTEGER_ARRAY: ("integer_array_value", "a list of whole numbers"),
    ParameterType.PARAMETER_DOUBLE_ARRAY: ("double_array_value", "a list of numbers"),
    ParameterType.PARAMETER_STRING_ARRAY: ("string_array_value", "a list of texts"),
}
"""{type: (the field of ParameterValue that holds it, what it takes)}"""

_GUESSES = (  # in this order: an empty list is one of bytes, as rclpy has it
    ParameterType.PARAMETER_BOOL, ParameterType.PARAMETER_INTEGER, ParameterType.PARAMETER_DOUBLE,
    ParameterType.PARAMETER_STRING, ParameterType.PARAMETER_BOOL_ARRAY,
    ParameterType.PARAMETER_INTEGER_ARRAY, ParameterType.PARAMETER_DOUBLE_ARRAY,
    ParameterType.PARAMETER_STRING_ARRAY,
)  # fmt: skip
_SLOTS = dict(values.message_fields(ParameterValue))


class ParameterError(CourseError):
    """A parameter that cannot be changed as asked; the message has the node's own reason."""


class RefusedError(ParameterError):
    """The node has refused a value; the message has its reason."""


def to_plain(value: ParameterValue) -> Any:
    """Return a parameter's value as plain data; None if it has none yet."""
    if value.type not in TYPES:
        return None
    field, _ = TYPES[value.type]
    return values.to_plain(getattr(value, field), None)


def to_value(name: str, typed: Any, declared: int) -> ParameterValue:
    """Return the value for a parameter of the type ``declared`` (NOT_SET takes any).

    Args:
        name: the parameter's, for the error.
        typed: plain data, or a text in YAML; for a parameter of type string, the text itself.
        declared: as in rcl_interfaces/msg/ParameterType.

    Raises:
        ParameterError: it does not fit; the message says what the parameter takes.
    """
    takes = TYPES[declared][1] if declared in TYPES else "a value, or a list of one kind of value"
    try:
        data = _parse_typed(typed, declared)
        type_ = declared if declared in TYPES else _guess_type(data)
        field, _ = TYPES[type_]
        if isinstance(data, float) and data.is_integer() and field == "integer_value":
            data = int(data)  # a slider's 2.0
        held = values.to_field(_SLOTS[field], data, name)
    except values.MisfitError as error:
        if declared == ParameterType.PARAMETER_INTEGER and type(data) is int:
            raise ParameterError(str(error)) from None  # the range
        raise ParameterError(f"{name} takes {takes}, not {yaml_text.short_repr(typed)}.") from None
    except ValueError:
        raise ParameterError(f"{name} takes {takes}, not {yaml_text.short_repr(typed)}.") from None
    return ParameterValue(type=type_, **{field: held})


def _parse_typed(typed: Any, declared: int) -> Any:
    if isinstance(typed, str) and declared != ParameterType.PARAMETER_STRING:
        return yaml_text.parse_yaml(typed)
    return typed.tolist() if hasattr(typed, "tolist") else typed  # numpy's


def _guess_type(data: Any) -> int:
    if data == []:
        return int(ParameterType.PARAMETER_BYTE_ARRAY)
    for type_ in _GUESSES:
        try:
            values.to_field(_SLOTS[TYPES[type_][0]], data, "")
        except values.MisfitError:
            continue
        return int(type_)
    raise ValueError(data)
