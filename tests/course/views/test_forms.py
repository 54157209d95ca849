"""Every interface that is installed has a form, and its defaults can be submitted as they stand."""

from __future__ import annotations

import array
import json
import tracemalloc
from typing import Any

import pytest
from sensor_msgs.msg import CameraInfo, Image
from test_msgs.msg import Arrays, BasicTypes, Strings

from course.interfaces import installed
from course.messages import values
from course.messages.types import load_type
from course.messages.values import MisfitError
from course.watch import forms

PARTS = {"msg": ("",), "srv": ("Request", "Response"), "action": ("Goal", "Result", "Feedback")}


@pytest.mark.parametrize("package", sorted(installed.read_index()))
def test_the_defaults_of_every_interface_can_be_submitted(package: str) -> None:
    for name in sorted(installed.read_index()[package]):
        kind = name.partition("/")[0]
        interface = load_type(f"{package}/{name}")
        for part in PARTS[kind]:
            msg_type = getattr(interface, part) if part else interface
            inputs = forms.form_fields(msg_type)
            json.dumps([field.default for field in inputs], allow_nan=False)
            same = forms.build_message(msg_type, {field.path: field.default for field in inputs})
            assert same == msg_type(), f"{package}/{name} {part}"


def test_there_are_interfaces_to_try() -> None:
    assert {"test_msgs", "sensor_msgs", "std_srvs", "lifecycle_msgs"} <= set(installed.read_index())


@pytest.mark.parametrize(
    ("msg_type", "path", "typed", "expected"),
    [
        (BasicTypes, "float64_value", "1e-3", 1e-3),
        (BasicTypes, "float32_value", "-.inf", float("-inf")),
        (BasicTypes, "float64_value", "inf", float("inf")),
        (BasicTypes, "byte_value", "7", b"\x07"),
        (BasicTypes, "uint64_value", str(2**64 - 1), 2**64 - 1),
        (BasicTypes, "int32_value", "0x10", 16),
        (Arrays, "byte_values", "[1, 2, 3]", [b"\x01", b"\x02", b"\x03"]),
        (Arrays, "string_values", "[1e3x, '1e3', 10:30]", ["1e3x", "1e3", "10:30"]),
        (CameraInfo, "k", "[1e3, 0, 0, 0, 1, 0, 0, 0, 1]", [1000, 0, 0, 0, 1, 0, 0, 0, 1]),
        (Strings, "string_value", "2026-01-31", "2026-01-31"),
    ],
)
def test_what_is_typed_arrives(msg_type: Any, path: str, typed: str, expected: Any) -> None:
    found = getattr(forms.build_message(msg_type, {path: typed}), path)
    assert (list(found) if isinstance(expected, list) else found) == expected


@pytest.mark.parametrize(
    ("msg_type", "path", "typed", "sentence"),
    [
        (BasicTypes, "int32_value", "", "int32_value takes int32, not ''."),
        (BasicTypes, "int32_value", "[a", "int32_value takes int32, not '[a'."),
        (BasicTypes, "float32_value", "1e300", "float32_value takes -3.4"),
        (BasicTypes, "float64_value", "1e400", "float64_value takes float64, not '1e400'."),
        (BasicTypes, "float64_value", "9" * 400, "float64_value takes -1.797693e+308 to"),
        (BasicTypes, "uint64_value", "9" * 5000, "uint64_value takes uint64, not '9999"),
        (BasicTypes, "bool_value", "perhaps", "bool_value takes bool, not 'perhaps'."),
        (BasicTypes, "bool_value", "!!bool x", "bool_value takes bool, not '!!bool x'."),
        (BasicTypes, "int8_value", "!!timestamp x", "int8_value takes int8, not"),
        (BasicTypes, "int8_value", "!!python/name:os.system ''", "int8_value takes int8, not"),
        (BasicTypes, "int8_value", "&a [*a]", "int8_value takes int8, not"),
        (BasicTypes, "wings", "2", "test_msgs/msg/BasicTypes has no field 'wings': it has bool_v"),
        (Strings, "bounded_string_value", "x" * 23, "takes at most 22 characters, not 23."),
        (Strings, "string_value", "a\0b", "takes text without NUL"),
        (Strings, "string_value", "\ud800", "takes text without NUL and surrogate"),
        (Arrays, "bool_values", "[true]", "bool_values takes exactly 3 elements, not 1."),
        (Arrays, "byte_values", "[1, 2, 256]", "byte_values[2] takes 0 to 255, not 256."),
        (Arrays, "int8_values", "[" * 5000, "int8_values takes int8[3], not '[[["),
    ],
    ids=lambda value: ascii(value)[:24],
)
def test_what_does_not_fit_is_a_sentence(
    msg_type: Any, path: str, typed: str, sentence: str
) -> None:
    with pytest.raises(MisfitError) as caught:
        forms.build_message(msg_type, {path: typed})
    assert sentence in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_picture_is_cut_before_it_becomes_numbers() -> None:
    message = Image(data=array.array("B", bytes(20_000_000)))
    tracemalloc.start()
    try:
        shown = values.to_data(message)["data"]
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert shown == [0] * values.MAX_SHOWN_ITEMS + [f"… {20_000_000 - values.MAX_SHOWN_ITEMS} more"]
    assert peak < 1_000_000


def test_long_texts_and_sequences_are_cut_for_display_alone() -> None:
    message = Strings(string_value="z" * 300_000)
    assert len(values.to_data(message)["string_value"]) < 3000
    assert values.to_data(message, None)["string_value"] == message.string_value
