"""One line of an interface text: a field, or a constant.

Each check here exists to say what to do about a mistake; the values themselves are read by
rosidl_adapter's parser, so that what passes here is what ROS accepts.
"""

from __future__ import annotations

import difflib
import keyword
import re
from collections.abc import Collection
from dataclasses import dataclass

from course.interfaces import installed
from course.interfaces.texts.type_names import CAMEL_CASE, LOWER_CASE, UPPER_CASE, lower_case

PRIMITIVES = (
    "bool", "byte", "char", "float32", "float64", "int8", "uint8", "int16", "uint16", "int32",
    "uint32", "int64", "uint64", "string", "wstring",
)  # fmt: skip
# What people write who think in Python, C or ROS 1.
ELSEWHERE = {
    "int": "int32 or int64", "integer": "int32 or int64", "long": "int64", "short": "int16",
    "unsigned": "uint32", "uint": "uint32 or uint64", "float": "float32 or float64",
    "double": "float64", "real": "float64", "number": "float64", "str": "string",
    "text": "string", "boolean": "bool", "bytes": "uint8[] or byte[]", "list": "int32[]",
    "time": "builtin_interfaces/Time", "duration": "builtin_interfaces/Duration",
}  # fmt: skip
# A field becomes a member of a C struct that C++ reads too, and a property in Python.
RESERVED = {
    "alignas", "alignof", "and", "and_eq", "asm", "auto", "bitand", "bitor", "bool", "break",
    "case", "catch", "char", "class", "compl", "concept", "const", "consteval", "constexpr",
    "constinit", "continue", "co_await", "co_return", "co_yield", "decltype", "default",
    "delete", "do", "double", "else", "enum", "explicit", "export", "extern", "false", "float",
    "for", "friend", "goto", "if", "inline", "int", "long", "mutable", "namespace", "new",
    "noexcept", "not", "not_eq", "nullptr", "operator", "or", "or_eq", "private", "protected",
    "public", "register", "reinterpret_cast", "requires", "restrict", "return", "short",
    "signed", "sizeof", "static", "static_assert", "static_cast", "struct", "switch",
    "template", "this", "thread_local", "throw", "true", "try", "typedef", "typeid", "typename",
    "union", "unsigned", "using", "virtual", "void", "volatile", "wchar_t", "while", "xor",
    "xor_eq",
    *keyword.kwlist,
}  # fmt: skip

ARRAY = re.compile(r"(?P<element>[^\[\]]+)(?P<brackets>\[(?:<=)?(?P<size>[^\]]*)\])?")


class LineError(Exception):
    """What is wrong with one line; the caller adds where."""


@dataclass(frozen=True)
class DefinitionLine:
    """A field or a constant."""

    name: str
    constant: bool
    reference: tuple[str, str] | None = None  # (package, message) of a field that nests one


def parse_line(line: str, package: str, own: Collection[str]) -> DefinitionLine:
    """Read ``line`` (no comment, no blanks around it) of a text of ``package``.

    ``own`` are the messages that ``package`` has so far. Raises ``LineError``.
    """
    if line.endswith((";", ",")):
        raise LineError(f"a line has no {line[-1]!r} at its end")
    type_text, _, rest = line.partition(" ")
    rest = rest.strip()
    if type_text.endswith(":") or (":" in type_text and "/" not in type_text):
        raise LineError("write the type first, then the name, without a colon, as in `int32 order`")
    if not rest:
        raise LineError("expected a type and then a name, as in `int32 order`")
    element, size = split_type(type_text)
    if "=" in rest:
        return parse_constant(type_text, rest)
    name, _, default = rest.partition(" ")
    default = default.strip()
    reference = check_type(element, name, package, own)
    check_field_name(name)
    if default:
        check_default(type_text, size, name, default, reference)
    return DefinitionLine(name, constant=False, reference=reference)


def split_type(text: str) -> tuple[str, str | None]:
    """Split ``int32[<=4]`` into the type of its elements and its brackets (None: no array)."""
    match = ARRAY.fullmatch(text)
    if not match:
        raise LineError(
            f"{text} is not a type: an array is written int32[] (any length), int32[3] (three) or "
            "int32[<=3] (up to three)"
        )
    size = match["size"]
    if size and not (size.isascii() and size.isdigit() and int(size) > 0):
        raise LineError(f"the size of an array must be a whole number above 0, not {size!r}")
    return match["element"], match["brackets"]


def check_type(text: str, name: str, package: str, own: Collection[str]) -> tuple[str, str] | None:
    """Check the type of a field or of its elements; return (package, message) if it nests one."""
    bounded = re.fullmatch(r"w?string<=(.*)", text)
    if bounded:
        if not (bounded[1].isascii() and bounded[1].isdigit() and int(bounded[1]) > 0):
            raise LineError(f"the bound in {text} must be a whole number above 0, as in string<=20")
        return None
    if text in PRIMITIVES:
        return None
    if text in ELSEWHERE:
        raise LineError(f"there is no type {text} in ROS 2; use {ELSEWHERE[text]}")
    if name in PRIMITIVES:
        raise LineError(f"the type comes first: write `{name} {text}`")
    parts = text.split("/")
    if len(parts) == 3 and parts[1] == "msg":
        raise LineError(f"inside a definition write {parts[0]}/{parts[2]}, without msg")
    if len(parts) > 2 or not all(parts):
        raise LineError(f"{text} is not a type: a message is written package/Name")
    owner, message = parts if len(parts) == 2 else (package, parts[0])
    if message not in (own if owner == package else installed.message_names(owner)):
        raise LineError(describe_unknown(text, owner, message, package, own))
    return owner, message


def describe_unknown(
    text: str, owner: str, message: str, package: str, own: Collection[str]
) -> str:
    """Say that there is no such type, and which ones are near."""
    for kind, what in (("srv", "a service"), ("action", "an action")):
        if f"{kind}/{message}" in installed.read_index().get(owner, ()):
            return f"{text} is {what}; a field needs a message or a basic type"
    near: list[str] = []
    if "/" not in text:
        near = difflib.get_close_matches(text.lower(), PRIMITIVES, 2, 0.7)
    if CAMEL_CASE.fullmatch(camel := message[:1].upper() + message[1:]):
        near += installed.suggest_message(owner, camel, own, package)
    sentence = f"there is no type {text}"
    if near:
        return f"{sentence}; did you mean {' or '.join(near[:3])}?"
    if owner == package:
        return f"{sentence}; define {owner}/msg/{message} in a cell above, or use a basic type"
    if owner in installed.read_index():
        return f"{sentence} in the package {owner}"
    return f"{sentence}: no package {owner} with messages is installed"


def check_field_name(name: str) -> None:
    """Check that ``name`` can be a field in Python, C and C++."""
    if not LOWER_CASE.fullmatch(name):
        if name.startswith("["):
            raise LineError("brackets follow the type directly, as in `int32[] data`")
        if re.fullmatch(r"\w+\[.*\]", name):
            raise LineError("brackets follow the type, not the name, as in `int32[] data`")
        better = lower_case(name)
        hint = f": {better}" if LOWER_CASE.fullmatch(better) else ", as in target_pose"
        raise LineError(f"a field's name is lower case with single underscores{hint}, not {name}")
    if name in RESERVED:
        raise LineError(
            f"{name} cannot name a field, since it is a word of Python, C or C++ itself; "
            f"{name}_value, say, can"
        )


def check_default(
    type_text: str, brackets: str | None, name: str, default: str, nested: tuple[str, str] | None
) -> None:
    """Check a default value (or what was taken for one)."""
    if nested:
        raise LineError(f"a field of type {type_text} cannot have a default value")
    if type_text.startswith("float") and re.search("nan|inf", default, re.IGNORECASE):
        raise LineError("the default of a floating point field must be a finite number")
    is_word = default.isidentifier() and default.lower() not in ("true", "false")
    if is_word and not brackets and not type_text.startswith(("string", "wstring")):
        raise LineError(
            f"expected one name after the type, or a value after the name, not {default!r}"
        )
    check_text(type_text, default)
    read_value(type_text, name, default, constant=False)


def parse_constant(type_text: str, rest: str) -> DefinitionLine:
    """Read ``NAME=value``."""
    name, _, value = (part.strip() for part in rest.partition("="))
    if type_text not in PRIMITIVES:
        raise LineError(
            f"a constant has a basic type, not {type_text}; a default value is written without "
            "an equals sign, as in `int32 order 5`"
        )
    if not UPPER_CASE.fullmatch(name):
        better = name.upper()
        hint = f"{type_text} {better}={value}" if UPPER_CASE.fullmatch(better) else "uint8 STOP=0"
        raise LineError(
            f"an equals sign makes a constant, and its name is UPPER_CASE, as in `{hint}`; a "
            "default value is written without it"
        )
    if not value:
        raise LineError(f"the constant {name} needs a value after the equals sign")
    check_text(type_text, value)
    read_value(type_text, name, value, constant=True)
    return DefinitionLine(name, constant=True)


def check_text(type_text: str, value: str) -> None:
    """Refuse what rosidl would silently turn into another text."""
    if not type_text.startswith(("string", "wstring")):
        return
    if re.search(r"\\(?!['\"])", value):
        raise LineError(f"in the text {value}, a backslash may stand before a quote only")
    if "[" not in type_text and value[0] in "'\"" and (len(value) == 1 or value[-1] != value[0]):
        raise LineError(
            f"the quote in {value} is not closed (# begins a comment inside quotes as well)"
        )


def read_value(type_text: str, name: str, value: str, *, constant: bool) -> None:
    """Let rosidl_adapter read the value."""
    from rosidl_adapter import parser  # type: ignore[import-untyped]

    try:
        if constant:
            parser.Constant(type_text, name, value)
        else:
            parser.Field(parser.Type(type_text, context_package_name="course"), name, value)
    except Exception as error:  # noqa: BLE001  it raises half a dozen unrelated classes
        raise LineError(str(error).rstrip(".")) from None
