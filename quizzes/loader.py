"""Reads banks: YAML in, a sound `Bank` out, or one sentence with file, item and field."""

from __future__ import annotations

import difflib
from collections.abc import Hashable, Iterable, Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any

import yaml
from pydantic import ValidationError

from quizzes import rendering
from quizzes.bank import Bank, FieldError, Ordering, Variant
from quizzes.errors import BankError

BANKS = Path(__file__).resolve().parent / "banks"
"""The folder of the banks that are installed with the package."""

_KINDS = ("single", "multiple", "numeric", "ordering", "matching", "predict")


def names(folder: Path = BANKS) -> list[str]:
    """Return the names of the quizzes there are."""
    return sorted(path.stem for path in folder.glob("*.yaml"))


def load_bank(name: str, folder: Path = BANKS, others: Iterable[str] = ()) -> Bank:
    """Return the bank of the quiz called ``name``.

    Args:
        name: such as ``"ch05"``.
        folder: where its bank lies.
        others: quizzes elsewhere, for the message to name.

    Raises:
        BankError: there is none (the message names the ones there are), or it is not sound.
    """
    known = names(folder)
    if name not in known:
        known = sorted({*known, *others})
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


def read_bank(path: Path, quiz: str = "") -> Bank:
    """Return the bank in the file at ``path``, of the quiz that the file is named after.

    Args:
        path: the file.
        quiz: what the quiz is called, if the file is named otherwise.

    Raises:
        BankError: it cannot be read, is no YAML, or does not hold together.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise BankError(f"There is no bank {path}.") from None
    except (OSError, UnicodeError) as error:
        raise BankError(f"{path} cannot be read as UTF-8 text: {error}.") from None
    return bank_of(text, path.name, path.parent, quiz)


def bank_of(text: str, name: str, folder: Path, quiz: str = "") -> Bank:
    """Return the bank in the text of a file called ``name``, whose pictures lie in ``folder``.

    ``quiz`` is what it must be called; what the file is called, if left out.

    Raises:
        BankError: it is no YAML, or does not hold together.
    """
    try:
        data = yaml.load(text, _Loader)
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        problem = " ".join(str(error).split())
        raise BankError(f"{name} is not valid YAML: {problem[:300]}.") from None
    return sound(data, name, quiz or Path(name).stem, folder)


def sound(data: Any, source: str, quiz: str, folder: Path, noun: str = "item") -> Bank:
    """Return the bank that ``data`` makes, if all of it holds together.

    Args:
        data: what stands in the YAML file.
        source: the file that a message names.
        quiz: what the bank must be called.
        folder: where the pictures are.
        noun: what a message calls a variant.

    Raises:
        BankError: it does not; the message names source, item and field.
    """
    try:
        bank = Bank.model_validate(data)
    except ValidationError as error:
        item, field, problem = _first(data, error)
        raise BankError(_sentence(source, noun, item, field, problem)) from None
    bank._folder = folder
    for item, field, problem in _problems(bank, quiz):
        raise BankError(_sentence(source, noun, item, field, problem))
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


def _sentence(source: str, noun: str, item: str, field: str, problem: str) -> str:
    where = source + (f", {noun} '{item}'" if item else "") + (f", field {field}" if field else "")
    return f"{where}: {problem}."


def _first(data: Any, error: ValidationError) -> tuple[str, str, str]:
    """Return item, field and text of the first problem, with the item's id, not its position."""
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
    message = first["msg"].removeprefix("Value error, ")
    cause = first.get("ctx", {}).get("error")
    if isinstance(cause, FieldError):
        fields.append(cause.field)
    elif first["type"].startswith("union_tag"):  # the kind is missing, or there is none like it
        fields.append("kind")
        message = f"it must be one of {', '.join(_KINDS)}"
    more = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
    return item, " ".join(fields), f"{message[:1].lower()}{message[1:].rstrip('.')}{more}"


def _inside(data: Any, step: Any) -> Any:
    try:
        return data[step]
    except (KeyError, IndexError, TypeError):
        return None


def _problems(bank: Bank, quiz: str) -> Iterator[tuple[str, str, str]]:
    """Yield (item, field, problem) for what the schema alone cannot see."""
    if bank.quiz != quiz:
        yield "", "quiz", f"it says '{bank.quiz}', but the file's name says '{quiz}'"
    if bank.keyless and not bank.closed:
        yield "", "keyless", "only the questions of a closed quiz go without keys"
    if bank.pass_mark > len(bank.concepts):
        yield "", "pass_mark", f"{bank.pass_mark} of {len(bank.concepts)} concepts is impossible"
    seen: set[str] = set()
    for concept in bank.concepts:
        for name in (concept.id, *(variant.id for variant in concept.variants)):
            if name in seen:
                yield name, "id", "this id is used twice"
            seen.add(name)
    for concept in bank.concepts:
        for variant in concept.variants:
            for field, problem in _variant_problems(bank, variant):
                yield variant.id, field, problem


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
        elif field.split()[0] not in ("id", "kind", "unit", "proof"):
            try:
                rendering.check(value, bank.folder)
            except rendering.RenderError as error:
                yield field, str(error)
    for number, text in enumerate(variant.texts, start=1):
        if text in variant.texts[: number - 1]:
            place = f"items {number}" if isinstance(variant, Ordering) else f"options {number} text"
            yield place, f"the text {text!r} stands there twice"


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
