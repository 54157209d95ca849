"""YAML as people write it: its data, where each part stands, and what is wrong in plain words.

Plain values mean what they look like, as in YAML 1.2 (https://yaml.org/spec/1.2.2/, section 10.3):
``yes``, ``12:30`` and a date are texts, ``1e3`` and ``010`` are the numbers 1000 and 10. PyYAML
alone would read them as true, 750, a date, a text and 8.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import yaml

from quizzes.errors import BankError

Place = Sequence[str | int]
"""Keys and positions that lead from the whole to a part of it."""

_MERGE = "tag:yaml.org,2002:merge"
_PARSER_SAYS = {
    "mapping values are not allowed": "a text with ': ' in it must stand in quotes; without one, "
    "look at the indentation of this line and the one above",
    "found undefined alias": "a text that begins with * must stand in quotes (without, it means "
    "something named before with &)",
    "could not determine a constructor": "a text that begins with ! must stand in quotes",
    "found unexpected end of stream": "a quote that opens before is never closed",
    "but found another document": "'---' begins a second document here, and a bank is one",
    "expected <block end>": "this does not fit what stands above it: look at the indentation, and "
    "at quotes that end too early",
    "could not find expected ':'": "there is no ':' behind a field's name, or the text above is "
    "not indented far enough",
    "expected ',' or": "a bracket that opens before is never closed",
    "unhashable key": "the name of a field must be a word",
    "unknown escape character": "between double quotes a backslash begins something special: use "
    "single quotes, or write it twice",
    "expected alphabetic or numeric": "a text that begins with * or & must stand in quotes",
}
_RESERVED = "`@%&*!|>"


@dataclass(frozen=True)
class Document:
    """One YAML document.

    ``repeated`` has the fields given a second time, of which the last is in ``data``: its line, the
    line of the first, and its name. Without a ``node`` nothing is known of lines.
    """

    data: Any
    node: yaml.Node | None = None
    repeated: tuple[tuple[int, int, str], ...] = ()

    def line_of(self, place: Place) -> int:
        """Return the line, from 1, where a part stands, or else what should hold it."""
        return self._find_part(place)[0]

    def written_value(self, place: Place) -> str | None:
        """Return a value as it is written, if it is a plain one without quotes."""
        _, node = self._find_part(place)
        plain = isinstance(node, yaml.ScalarNode) and node.style is None
        return node.value if plain else None  # type: ignore[union-attr]

    def _find_part(self, place: Place) -> tuple[int, yaml.Node | None]:
        node = self.node
        line = node.start_mark.line + 1 if node else 1
        for step in place:
            found = _find_inside(node, step)
            if found is None:
                return line, None
            key, node = found
            line = key.start_mark.line + 1
        return line, node


def parse_document(text: str, name: str) -> Document:
    """Return what the text of a file called ``name`` holds.

    Raises:
        BankError: it is no YAML; the message says in which line, and what to do.
    """
    try:
        loader = _Loader(text)
        node = loader.get_single_node()
        if node is None:
            return Document(None)
        repeated = sorted(_repeated_fields(node, set()))  # while what is merged does not repeat any
        data = loader.construct_document(node)
        return Document(data, node, tuple(repeated))
    except yaml.reader.ReaderError as error:
        line = text[: error.position].count("\n") + 1
        problem = f"line {line}: the character {ord(text[error.position]):#06x} is not allowed"
        raise BankError(f"{name} is not valid YAML: {problem}; delete it.") from None
    except yaml.MarkedYAMLError as error:
        raise BankError(f"{name} is not valid YAML: {_explain_error(error, text)}.") from None
    except RecursionError:
        raise BankError(f"{name} is not valid YAML: it is nested too deeply.") from None
    except (yaml.YAMLError, ValueError, OverflowError, TypeError) as error:
        problem = " ".join(str(error).split())[:300]
        raise BankError(f"{name} is not valid YAML: {problem}.") from None


class _Loader(yaml.SafeLoader):
    def construct_whole_number(self, node: yaml.ScalarNode) -> int:
        return int(self.construct_scalar(node))


_Loader.yaml_implicit_resolvers = {}
for _tag, _looks, _first in (
    ("bool", r"true|True|TRUE|false|False|FALSE", "tTfF"),
    ("null", r"~|null|Null|NULL|", ["~", "n", "N", ""]),
    ("int", r"[-+]?[0-9]+", "-+0123456789"),
    ("float", r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)"
              r"|\.(nan|NaN|NAN)", "-+.0123456789"),
    ("merge", r"<<", "<"),
):  # fmt: skip
    _Loader.add_implicit_resolver(
        f"tag:yaml.org,2002:{_tag}", re.compile(f"^(?:{_looks})$"), list(_first)
    )
_Loader.add_constructor("tag:yaml.org,2002:int", _Loader.construct_whole_number)


def _find_inside(node: yaml.Node | None, step: str | int) -> tuple[yaml.Node, yaml.Node] | None:
    """Return where a part begins, and the part."""
    if isinstance(node, yaml.SequenceNode) and isinstance(step, int):
        item = node.value[step] if step < len(node.value) else None
        return (item, item) if item else None
    if isinstance(node, yaml.MappingNode):
        for key, value in reversed(node.value):  # what is merged comes first, and gives way
            if isinstance(key, yaml.ScalarNode) and key.value == step:
                return key, value
    return None


def _repeated_fields(node: yaml.Node, seen: set[int]) -> Iterator[tuple[int, int, str]]:
    if id(node) in seen:
        return
    seen.add(id(node))
    if isinstance(node, yaml.SequenceNode):
        for item in node.value:
            yield from _repeated_fields(item, seen)
    elif isinstance(node, yaml.MappingNode):
        lines: dict[str, int] = {}
        for key, value in node.value:
            line = key.start_mark.line + 1
            if isinstance(key, yaml.ScalarNode) and key.tag != _MERGE:
                if key.value in lines:
                    yield line, lines[key.value], key.value
                lines.setdefault(key.value, line)
            yield from _repeated_fields(value, seen)


def _explain_error(error: yaml.MarkedYAMLError, text: str) -> str:
    """Say in which line the text is no YAML, and what to do about it."""
    problem = " ".join(str(error.problem or error.context or "it cannot be read").split())
    mark = error.problem_mark or error.context_mark
    if mark is None:
        return problem[:300]
    lines = text.split("\n")
    here = lines[mark.line] if mark.line < len(lines) else ""
    at = here[mark.column : mark.column + 1]
    where = f"line {mark.line + 1}: "
    if "\t" in here[: mark.column + 1]:
        return where + "a tab stands where YAML wants blanks: indent with blanks only"
    if "cannot start any token" in problem or (at and at in _RESERVED and "alias" not in problem):
        return where + f"a text that begins with {at} must stand in quotes"
    said = next((plain for says, plain in _PARSER_SAYS.items() if says in problem), problem[:300])
    return where + said
