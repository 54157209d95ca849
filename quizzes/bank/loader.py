"""Reads banks: YAML in, a sound `Bank` out, or every fault as a sentence with its place."""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from quizzes.bank import bank_yaml, checks, faults
from quizzes.bank.bank_fields import is_closed
from quizzes.bank.bank_yaml import Document
from quizzes.bank.contents import Bank
from quizzes.errors import BankError, suggest_name

BANKS = Path(__file__).resolve().parents[1] / "banks"
"""The folder of the banks that are installed with the package."""

MAX_SIZE_BYTES = 4 * 1024 * 1024
"""Bytes of a bank that are read; that of chapter 5 has 0.1 million."""


def names(folder: Path = BANKS) -> list[str]:
    """Return the names of the quizzes there are."""
    return sorted(path.stem for path in folder.glob("*.yaml"))


def find_bank(name: str, own: Path | None = None) -> Bank:
    """Return the bank of a quiz, one in the folder ``own`` before one of the package.

    Raises:
        BankError: there is none (the message names all that there are), or it is not sound.
    """
    if own is None or (name in names() and name not in names(own)):
        return load_bank(name)
    return load_bank(name, own, names())


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
        raise BankError(
            f"There is no quiz {str(name)!r}: there are {', '.join(known) or 'none'}."
            + (_named_otherwise(str(name), folder) or suggest_name(name, known))
        )
    path = folder / f"{name}.yaml"
    status = path.stat()
    return _load_cached(path, status.st_mtime_ns, status.st_size)


def _named_otherwise(name: str, folder: Path) -> str:
    """Return a sentence about a file that only lacks the right name, with a blank before it."""
    found = next((p.name for p in folder.glob("*.yml") if p.stem == name), "")
    return f" Its bank must be called {name}.yaml, not {found}: rename it." if found else ""


@lru_cache(maxsize=16)
def _load_cached(path: Path, _changed: int, _size: int) -> Bank:
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
        with path.open("rb") as file:
            raw = file.read(MAX_SIZE_BYTES + 1)
    except FileNotFoundError:
        raise BankError(f"There is no bank {path}.") from None
    except OSError as error:
        raise BankError(f"{path} cannot be read: {error.strerror or error}.") from None
    if len(raw) > MAX_SIZE_BYTES:
        raise BankError(f"{path} is larger than {MAX_SIZE_BYTES // 2**20} MB: split the quiz.")
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw[: error.start].count(b"\n") + 1
        raise BankError(
            f"{path}, line {line}: this is not UTF-8 text; save the file in that encoding."
        ) from None
    return bank_of(text, path.name, path.parent, quiz)


def bank_of(text: str, name: str, folder: Path, quiz: str = "") -> Bank:
    """Return the bank in the text of a file called ``name``, whose pictures lie in ``folder``.

    ``quiz`` is what it must be called; what the file is called, if left out.

    Raises:
        BankError: it is no YAML, or does not hold together.
    """
    return _validate_document(
        bank_yaml.parse_document(text, name), name, quiz or Path(name).stem, folder, "item"
    )


def validate_bank(data: Any, source: str, quiz: str, folder: Path, noun: str = "item") -> Bank:
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
    return _validate_document(Document(data), source, quiz, folder, noun)


def _validate_document(document: Document, source: str, quiz: str, folder: Path, noun: str) -> Bank:
    data = document.data
    if data is None:
        raise BankError(f"{source} is empty: it must hold a quiz, with fields such as 'quiz'.")
    problems = list(checks.find_problems(data, quiz, folder))
    bank: Bank | None = None
    try:
        bank = Bank.model_validate(data)
    except ValidationError as error:
        problems += faults.of_schema(error, document, teaches=not is_closed(data))
    found = faults.describe_problems(problems, document, source, noun)
    if bank is None or found:
        raise BankError(_summarize_faults(found), found)
    bank._folder = folder
    return bank


def _summarize_faults(found: list[str]) -> str:
    more = f" (and {len(found) - 1} more)." if len(found) > 1 else ""
    return found[0].removesuffix(".") + more if more else found[0]
