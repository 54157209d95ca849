"""Files of other formats: write a bank as one, read one into a bank."""

from __future__ import annotations

from pathlib import Path

from quizzes.bank import loader
from quizzes.bank.contents import Bank
from quizzes.errors import BankError
from quizzes.exchange import format_limits, gift, merge, platform_questions
from quizzes.exchange.platform_questions import ExchangeError
from quizzes.marking import closed_quizzes

FORMATS = {"gift": ".gift", "qti": ".qti.zip"}
"""What a bank can be exported as, and how such a file's name ends."""


def open_bank(name: str, own: Path | None = None) -> Bank:
    """Return the bank of a quiz, or the one in the YAML file called ``name``.

    Args:
        name: a quiz, or a file whose name ends in .yaml.
        own: a course's own banks, which go before those of the package.

    Raises:
        BankError: there is none, it is not sound, or it has no keys.
    """
    if not name.endswith((".yaml", ".yml")):
        bank, source = loader.find_bank(name, own), f"{name}.yaml"
    else:
        path = Path(name)
        sheet = closed_quizzes.quiz_of(path)
        bank = closed_quizzes.read_sheet(path, sheet) if sheet else loader.read_bank(path)
        source = path.name
    if bank.keyless:
        raise BankError(f"{source} holds questions without keys: take the bank they come from.")
    return bank


def export_bank(bank: Bank, format_name: str, to: Path | None = None) -> tuple[Path, list[str]]:
    """Write a bank in another format; return the file, and what it leaves out, a sentence each.

    Args:
        bank: what to write.
        format_name: one of `FORMATS`.
        to: the file; by default it is named like the quiz, in the current folder.

    Raises:
        ExchangeError: there is no such format, a question does not fit it, or the file cannot be
            written.
    """
    if format_name not in FORMATS:
        raise ExchangeError(
            f"There is no format '{format_name}': choose one of {', '.join(FORMATS)}."
        )
    path = to or Path(f"{bank.quiz}{FORMATS[format_name]}")
    if format_name == "gift":
        content = gift.format_gift(platform_questions.of_bank(bank), bank.title).encode()
        notes = format_limits.of_gift(bank)
    else:
        from quizzes.exchange import qti  # text2qti takes a moment to import

        content, notes = qti.make_package(bank)
    _write_file(path, content)
    return path, notes


def import_gift(path: Path, bank: Bank, to: Path | None = None) -> tuple[Path, merge.Merged]:
    """Bring a GIFT file into a bank, and write that as YAML; the bank's own file stays as it is.

    Args:
        path: the GIFT file.
        bank: the bank that the questions belong to.
        to: the YAML file; by default it is named like the quiz, in the current folder.

    Raises:
        ExchangeError: a file cannot be read or written, is no GIFT, or does not fit the bank.
        BankError: what would be written is no sound bank.
    """
    try:
        with path.open("rb") as file:
            raw = file.read(4 * gift.MAX_SIZE_CHARS + 1)
        content = raw.decode("utf-8")
    except UnicodeDecodeError as error:
        line = raw[: error.start].count(b"\n") + 1
        raise ExchangeError(f"{path}, line {line}: this is not UTF-8 text.") from None
    except OSError as error:
        raise ExchangeError(f"{path} cannot be read: {error.strerror or error}.") from None
    merged = merge.merge_questions(bank, gift.read_gift(content, path.name), path.name)
    target = to or Path(f"{bank.quiz}.yaml")
    if to is None and target.exists():
        raise ExchangeError(f"{target} is there already: name the file to write with --to.")
    if target.name != f"{bank.quiz}.yaml":
        raise ExchangeError(
            f"{target}: a bank is named like its quiz, so call the file {bank.quiz}.yaml, in "
            "another folder if need be."
        )
    content = merged.to_yaml()
    loader.bank_of(content, target.name, bank.folder)  # what is written can be read again
    _write_file(target, content.encode())
    try:
        loader.bank_of(content, target.name, target.parent)
    except BankError:
        merged.notes.append(f"Its pictures are not beside it: copy {bank.folder / 'assets'} there.")
    return target, merged


def _write_file(path: Path, content: bytes) -> None:
    try:
        path.write_bytes(content)
    except OSError as error:
        raise ExchangeError(
            f"{path} cannot be written: {error.strerror or error}; name another file with --to."
        ) from None
