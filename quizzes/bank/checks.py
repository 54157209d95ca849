"""What a bank's schema cannot see: names that must fit together, code that must compile, pictures.

Everything is looked for in the data as it was written, so that it is found together with all that
the schema refuses.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from quizzes.bank.bank_fields import is_closed
from quizzes.bank.bank_yaml import Place
from quizzes.bank.contents import MIN_VARIANTS
from quizzes.bank.faults import Problem, get_part
from quizzes.text import rendering

_DEEPEST = 4
"""Levels at which a variant has texts; aliases can nest YAML without end."""

_NO_MARKDOWN = ("id", "kind", "unit", "proof")


def find_problems(data: Any, quiz: str, folder: Path) -> Iterator[Problem]:
    """Yield what does not hold together in the data of a bank.

    Args:
        data: what stands in the file, which the schema may have refused.
        quiz: what the bank must be called.
        folder: where its pictures are.
    """
    if not isinstance(data, dict):
        return
    if isinstance(data.get("quiz"), str) and data["quiz"] != quiz:
        said = f"it says '{data['quiz']}', but the file's name says '{quiz}'"
        yield Problem(("quiz",), said)
    if data.get("keyless") is True and not is_closed(data):
        yield Problem(("keyless",), "only the questions of a closed quiz go without keys")
    concepts = _list_or_empty(data.get("concepts"))
    needed = data.get("pass_mark")
    if type(needed) is int and concepts and needed > len(concepts):
        yield Problem(("pass_mark",), f"{needed} of {len(concepts)} concepts is impossible")
    yield from _repeated_ids(concepts)
    for number, concept in enumerate(concepts):
        place: Place = ("concepts", number, "variants")
        variants = _list_or_empty(get_part(concept, "variants"))
        if not is_closed(data) and 0 < len(variants) < MIN_VARIANTS:
            least = f"at least {MIN_VARIANTS} in a quiz that teaches"
            yield Problem(place, f"it must have {least}, not {len(variants)}")
        for which, variant in enumerate(variants):
            for where, phrase in _of_variant(variant, data.get("misconceptions"), folder):
                yield Problem((*place, which, *where), phrase)


def _list_or_empty(data: Any) -> list[Any]:
    return data if isinstance(data, list) else []


def _repeated_ids(concepts: list[Any]) -> Iterator[Problem]:
    seen: set[str] = set()
    for number, concept in enumerate(concepts):
        place: Place = ("concepts", number)
        variants = _list_or_empty(get_part(concept, "variants"))
        parts = [(place, concept)]
        parts += [((*place, "variants", which), one) for which, one in enumerate(variants)]
        for where, part in parts:
            name = get_part(part, "id")
            if isinstance(name, str):
                if name in seen:
                    yield Problem((*where, "id"), "this id is used twice")
                seen.add(name)


def _of_variant(variant: Any, known: Any, folder: Path) -> Iterator[tuple[Place, str]]:
    for place, value in _walk_texts(variant):
        field = place[-1]
        if field == "misconception":
            if isinstance(known, dict | None) and value not in (known or {}):
                yield place, f"there is no misconception '{value}' in the bank's table"
        elif field in ("show", "code"):
            try:
                with warnings.catch_warnings(action="ignore"):  # it only has to be Python
                    compile(value, "cell", "exec")
            except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
                yield place, f"this is no Python ({error})"
        elif place[0] not in _NO_MARKDOWN:
            try:
                rendering.check_text(value, folder)
            except rendering.RenderError as error:
                yield place, str(error)
    for field, inner in (("options", ("text",)), ("items", ())):
        texts = [_text_at(one, inner) for one in _list_or_empty(get_part(variant, field))]
        for number, text in enumerate(texts):
            if text is not None and text in texts[:number]:
                yield (field, number, *inner), f"the text {text!r} stands there twice"


def _text_at(data: Any, place: Place) -> str | None:
    for step in place:
        data = get_part(data, step)
    return data.strip() if isinstance(data, str) else None


def _walk_texts(data: Any, place: Place = ()) -> Iterator[tuple[Place, str]]:
    """Yield (place, text) for every text of a variant."""
    if isinstance(data, str) and place:
        yield place, data
    elif len(place) < _DEEPEST:
        if isinstance(data, dict):
            for key, value in data.items():
                if isinstance(key, str):
                    yield from _walk_texts(value, (*place, key))
        elif isinstance(data, list):
            for number, value in enumerate(data):
                yield from _walk_texts(value, (*place, number))
