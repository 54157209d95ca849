"""Reads banks: YAML in, a sound `Bank` out, or one sentence with file, item and field."""

from __future__ import annotations

import difflib
from collections.abc import Hashable, Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any

import yaml
from pydantic import ValidationError

from quizzes import rendering
from quizzes.bank import Bank, Variant
from quizzes.errors import BankError

BANKS = Path(__file__).resolve().parent / "banks"
"""The folder of the banks that are installed with the package."""

_KINDS = ("single", "multiple", "numeric", "ordering", "matching", "predict")


def names(folder: Path = BANKS) -> list[str]:
    """Return the names of the quizzes there are."""
    return sorted(path.stem for path in folder.glob("*.yaml"))


def load_bank(name: str, folder: Path = BANKS) -> Bank:
    """Return the bank of the quiz called ``name``.

    Raises:
        BankError: there is none (the message names the ones there are), or it is not sound.
    """
    known = names(folder)
    if name not in known:
        close = difflib.get_close_matches(str(name), known, n=1)
        guess = f" Did you mean '{close[0]}'?" if close else ""
        raise BankError(
            f"There is no quiz {str(name)!r}: there are {', '.join(known) or 'none'}.{guess}"
        )
    path = folder / f"{name}.yaml"
    status = path.stat()
    return _cached(path, status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=16)
def _cached(path: Path, _changed: int, _size: int) -> Bank:
    return read_bank(path)


def read_bank(path: Path) -> Bank:
    """Return the bank in the file at ``path``.

    Raises:
        BankError: it cannot be read, is no YAML, or does not hold together.
    """
    data = _parse(path)
    try:
        bank = Bank.model_validate(data)
    except ValidationError as error:
        raise BankError(_sentence(path, data, error)) from None
    bank._folder = path.parent
    for where, problem in _problems(bank, path):
        raise BankError(f"{path.name}, {where}: {problem}.")
    return bank


class _Loader(yaml.SafeLoader):
    """A loader that takes a key given twice for the mistake that it is."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        seen: set[Any] = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            if isinstance(key, Hashable) and key in seen:
                line = key_node.start_mark.line + 1
                raise yaml.YAMLError(f"line {line} gives the field '{key}' a second time")
            seen.add(key if isinstance(key, Hashable) else None)
        return super().construct_mapping(node, deep)


def _parse(path: Path) -> Any:
    try:
        return yaml.load(path.read_text(encoding="utf-8"), _Loader)
    except FileNotFoundError:
        raise BankError(f"There is no bank {path}.") from None
    except (OSError, UnicodeError) as error:
        raise BankError(f"{path} cannot be read as UTF-8 text: {error}.") from None
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        problem = " ".join(str(error).split())
        raise BankError(f"{path.name} is not valid YAML: {problem[:300]}.") from None


def _sentence(path: Path, data: Any, error: ValidationError) -> str:
    """Say the first problem in one sentence, with the item's id rather than its position."""
    problems = error.errors(include_url=False)
    first = problems[0]
    item, here = "", data
    fields: list[str] = []
    for step in first["loc"]:
        if step in _KINDS and not (isinstance(here, dict) and step in here):
            continue  # pydantic names the kind of a variant as if it were a field
        here = _inside(here, step)
        if isinstance(here, dict) and isinstance(here.get("id"), str):
            item, fields = here["id"], []
        else:
            fields.append(str(step + 1) if isinstance(step, int) else str(step))
    where = f"{path.name}" + (f", item '{item}'" if item else "")
    where += f", field {' '.join(fields)}" if fields else ""
    more = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
    message = first["msg"].removeprefix("Value error, ")
    return f"{where}: {message[:1].lower()}{message[1:].rstrip('.')}{more}."


def _inside(data: Any, step: Any) -> Any:
    try:
        return data[step]
    except (KeyError, IndexError, TypeError):
        return None


def _problems(bank: Bank, path: Path) -> Iterator[tuple[str, str]]:
    """Yield (where, what) for what the schema alone cannot see."""
    if bank.quiz != path.stem:
        yield "field quiz", f"it says '{bank.quiz}', but the file's name says '{path.stem}'"
    if bank.pass_mark > len(bank.concepts):
        yield "field pass_mark", f"{bank.pass_mark} of {len(bank.concepts)} concepts is impossible"
    seen: set[str] = set()
    for concept in bank.concepts:
        for name in (concept.id, *(variant.id for variant in concept.variants)):
            if name in seen:
                yield f"item '{name}', field id", "this id is used twice"
            seen.add(name)
    for concept in bank.concepts:
        for variant in concept.variants:
            for field, problem in _variant_problems(bank, variant):
                yield f"item '{variant.id}', field {field}", problem


def _variant_problems(bank: Bank, variant: Variant) -> Iterator[tuple[str, str]]:
    for field, value in _leaves(variant.model_dump()):
        if field.endswith("misconception"):
            if value not in bank.misconceptions:
                yield field, f"there is no misconception '{value}' in the bank's table"
        elif field.endswith(("show", "code")):
            try:
                compile(value, variant.id, "exec")
            except (SyntaxError, ValueError) as error:
                yield field, f"this is no Python ({error})"
        elif not field.endswith(("id", "kind", "proof", "unit")):
            try:
                rendering.check(value, bank.folder)
            except rendering.RenderError as error:
                yield field, str(error)
    repeated = {text for text in variant.texts if variant.texts.count(text) > 1}
    for text in sorted(repeated):
        yield "options", f"the text {text!r} stands there twice"


def _leaves(data: Any, path: str = "") -> Iterator[tuple[str, str]]:
    """Yield (field, text) for every text of a variant, however deep."""
    if isinstance(data, str):
        yield path, data
    elif isinstance(data, dict):
        for key, value in data.items():
            yield from _leaves(value, f"{path} {key}".strip())
    elif isinstance(data, list):
        for number, value in enumerate(data, start=1):
            yield from _leaves(value, f"{path} {number}")
