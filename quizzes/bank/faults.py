"""What is wrong with a bank, all of it: each fault one plain sentence with its place."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from quizzes.bank.bank_fields import FieldError, validating_bank
from quizzes.bank.bank_yaml import Document, Place
from quizzes.bank.contents import Bank, Concept, Option, Pair, Trap, Variant
from quizzes.errors import suggest_name

KINDS: dict[str, type[BaseModel]] = {
    get_args(model.model_fields["kind"].annotation)[0]: model
    for model in get_args(get_args(Variant)[0])
}  # fmt: skip
"""The kinds of questions by their names."""

_PARTS: dict[Any, type[BaseModel]] = {
    "concepts": Concept, "options": Option, "traps": Trap, "pairs": Pair, **KINDS,
}  # fmt: skip
_MAX_CHARS = 60
"""Characters of a value that a message repeats."""


@dataclass(frozen=True)
class Problem:
    """Something wrong at a place in a bank's data, as a phrase."""

    place: Place
    phrase: str


def of_schema(
    error: ValidationError, document: Document, above: Place = (), *, teaches: bool = True
) -> Iterator[Problem]:
    """Yield what the schema has found wrong with a document's data.

    Args:
        error: what pydantic found.
        document: the whole document.
        above: where in it the part stands that was validated.
        teaches: whether its bank teaches.
    """
    for detail in error.errors(include_url=False):
        place = _clean_place(document.data, (*above, *detail["loc"]))
        cause = detail.get("ctx", {}).get("error")
        if isinstance(cause, FieldError):
            for inside, phrase in cause.problems:
                steps = (int(s) - 1 if s.isdigit() else s for s in inside.split())
                yield Problem((*place, *steps), phrase)
        elif detail["type"] == "invalid_key":
            yield Problem(place[:-1], _describe_detail(detail, place[:-1], document))
        else:
            if detail["type"].startswith("union_tag"):  # no kind, or none that there is
                yield from _as_meant(detail["input"], document, place, teaches=teaches)
                place = (*place, "kind")
            yield Problem(place, _describe_detail(detail, place, document))


def _as_meant(
    variant: Any, document: Document, place: Place, *, teaches: bool
) -> Iterator[Problem]:
    """Yield what else is wrong with a variant whose kind is, if it can be guessed."""
    if not isinstance(variant, dict):
        return
    close = difflib.get_close_matches(str(variant.get("kind")), KINDS, n=1)
    telling = {"options": "single", "answer": "numeric", "items": "ordering", "pairs": "matching"}
    meant = next(iter([*close, *(kind for field, kind in telling.items() if field in variant)]), "")
    if meant:
        try:
            with validating_bank(teaches=teaches):
                KINDS[meant].model_validate({**variant, "kind": meant})
        except ValidationError as error:
            yield from of_schema(error, document, (*place, meant), teaches=teaches)


def describe_problems(
    problems: Iterable[Problem], document: Document, source: str, noun: str = "item"
) -> list[str]:
    """Return problems as sentences, in the order of the file's lines.

    A field that is given twice comes first: it may be why the others are.

    Args:
        problems: what is wrong.
        document: what it is wrong with.
        source: the file to name.
        noun: what to call a variant or a concept.
    """
    repeated = [
        f"{source}, line {line}: this gives the field '{name}' a second time, after line {first}."
        for line, first, name in document.repeated
    ]
    found = []
    for problem in problems:
        line = document.line_of(problem.place) if document.node else 0
        item, field = _locate_item(document.data, problem.place)
        where = [source]
        where += [f"line {line}"] if line else []
        where += [f"{noun} '{item}'"] if item else []
        where += [f"field {field}"] if field else []
        end = "" if problem.phrase.endswith("?") else "."
        found.append((line, f"{', '.join(where)}: {problem.phrase}{end}"))
    ordered = (text for _, text in sorted(found, key=lambda pair: pair[0]))
    return list(dict.fromkeys([*repeated, *ordered]))


def get_part(data: Any, step: str | int) -> Any:
    """Return a part of some data, or None."""
    try:
        return data[step]
    except (KeyError, IndexError, TypeError):
        return None


def _clean_place(data: Any, location: Place) -> Place:
    """Return where pydantic found something, without its names of kinds and of keys."""
    place: list[str | int] = []
    for step in location:
        here = data
        for known in place:
            here = get_part(here, known)
        if step in KINDS and not (isinstance(here, dict) and step in here):
            continue  # pydantic names the kind of a variant as if it were a field
        if step != "[key]":
            place.append(step)
        elif not isinstance(place[-1], str):
            place.pop()  # a name that is no text: pydantic gives its position
    return tuple(place)


def _locate_item(data: Any, place: Place) -> tuple[str, str]:
    """Return the id of the item at a place, and the field in it; positions count from 1."""
    item, fields = "", list[str]()
    for step in place:
        data = get_part(data, step)
        if isinstance(data, dict) and isinstance(data.get("id"), str):
            item, fields = data["id"][:_MAX_CHARS], []
        else:
            fields.append(str(step + 1) if isinstance(step, int) else str(step)[:_MAX_CHARS])
    return item, " ".join(fields)


def _describe_detail(detail: ErrorDetails, place: Place, document: Document) -> str:
    """Return what is wrong in the words of somebody who writes a bank."""
    kind, context = detail["type"], detail.get("ctx", {})
    if kind == "missing":
        return "it is missing, and is required here"
    if kind == "extra_forbidden":
        return _unknown_field(detail["loc"])
    if kind.startswith("union_tag"):
        given = get_part(detail["input"], "kind")
        return f"it must be one of {', '.join(KINDS)}{_or_is_it(given, KINDS)}"
    if kind in _MUST_BE:
        return _of_another_kind(_MUST_BE[kind], detail["input"], document.written_value(place))
    if kind == "string_pattern_mismatch":
        given = str(detail["input"])[:_MAX_CHARS]
        return f"{given!r} is no id: write lower-case words joined by hyphens, such as qos-purpose"
    if kind == "string_unicode":
        return "it holds half of a character, which is no text"
    if kind == "string_too_short":
        return "it is empty"
    if kind in ("too_short", "too_long"):
        least = kind == "too_short"
        count = context["min_length" if least else "max_length"]
        return f"it must have at {'least' if least else 'most'} {count}, not {len(detail['input'])}"
    if kind in ("greater_than_equal", "less_than_equal"):
        least = kind == "greater_than_equal"
        bound = context["ge" if least else "le"]
        return f"it must be at {'least' if least else 'most'} {bound:g}, not {detail['input']:g}"
    message = detail["msg"].removeprefix("Value error, ").removeprefix("Input ")
    return f"it {message}" if message.startswith("should") else message.rstrip(".")


_MUST_BE = {
    "string_type": "text",
    "bool_type": "true or false",
    "float_type": "a number",
    "int_type": "a whole number",
    "list_type": "a list, each item behind '- '",
    "dict_type": "fields with their values",
    "model_type": "fields with their values",
    "model_attributes_type": "fields with their values",
    "invalid_key": "text, as every field's name",
}


def _of_another_kind(wanted: str, given: Any, written: str | None) -> str:
    if given is None:
        return f"it must be {wanted}, but nothing stands there"
    if isinstance(given, dict | list):
        have = "fields with values" if isinstance(given, dict) else "a list"
        quotes = "; a text that begins with { or [ must stand in quotes" if wanted == "text" else ""
        return f"it must be {wanted}, but it is {have}{quotes}"
    shown = (written or str(given))[:_MAX_CHARS]
    if wanted.startswith("text"):
        read_as = "true or false" if isinstance(given, bool) else "a number"
        quoted = f"write '{shown}', in quotes"
        return f"it must be {wanted}, but YAML reads {shown} as {read_as}: {quoted}"
    return f"it must be {wanted}, not {shown!r}{_way_to_write(wanted, given)}"


def _way_to_write(wanted: str, given: Any) -> str:
    """Return how to write what seems to be meant, or nothing."""
    if not isinstance(given, str):
        return ""
    if wanted == "true or false":
        meant = {"yes": "true", "on": "true", "no": "false", "off": "false"}.get(given.lower())
        return f": write {meant}" if meant else " in quotes" * (given.lower() in ("true", "false"))
    found = re.match(r"[-+]?[0-9]+([.,][0-9]+)?", given) if "number" in wanted else None
    if not found:
        return ""
    if found[0] != given:
        return ": write a number alone; what it is a number of goes elsewhere"
    return f": write {given.replace(',', '.')} without quotes"


def _unknown_field(location: Place) -> str:
    model: type[BaseModel] = Bank
    for step in location[:-1]:
        model = _PARTS.get(step, model)
    known = list(model.model_fields)
    meant = _or_is_it(location[-1], known)
    return "there is no such field" + (meant or f" here, only {', '.join(known)}")


def _or_is_it(given: object, known: Iterable[str]) -> str:
    question = suggest_name(given, known) if isinstance(given, str) else ""
    return f": {question[1:2].lower()}{question[2:]}" if question else ""
