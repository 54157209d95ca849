"""``autograder quiz``: banks of questions, their format and lint, to and from platforms."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from autograder.commands.options import Root, root_if_any
from autograder.util.terminal import Terminal
from course.errors import CourseError

if TYPE_CHECKING:
    from quizzes.errors import BankError

app = typer.Typer(
    help="Write quizzes, and exchange them with learning platforms.", no_args_is_help=True
)
out = Terminal()
err = Terminal(stderr=True)

_NAMES = "such as ch05 or one of the course's own (authoring/banks), or a bank's YAML file."
Quiz = Annotated[str, typer.Argument(help=f"A quiz {_NAMES}")]
Quizzes = Annotated[list[str], typer.Argument(help=f"Quizzes {_NAMES}")]
To = Annotated[Path | None, typer.Option("--to", help="The file to write.")]


class QuizCommandError(CourseError):
    """A quiz, a bank or a file of another format is not as it should be."""


@app.command("export")
def export_command(
    quiz: Quiz,
    format_name: Annotated[
        str, typer.Option("--format", "-f", help="gift (Moodle) or qti (Canvas).")
    ],
    to: To = None,
    root: Root = None,
) -> None:
    """Write a quiz for a learning platform, and say what its format cannot hold."""
    from quizzes.exchange import bank_files

    with as_course_errors():
        bank = bank_files.open_bank(quiz, _banks_folder(root))
        path, notes = bank_files.export_bank(bank, format_name, to)
    points, variants = len(bank.concepts), sum(len(c.variants) for c in bank.concepts)
    worth = f"{points} of {variants} questions are drawn, {points} points"
    _print_notes(f"Written: {path} ({worth})", notes)


@app.command("import")
def import_command(
    file: Annotated[Path, typer.Argument(help="A GIFT file.")],
    into: Annotated[str, typer.Option("--into", help=f"The quiz it belongs to, {_NAMES}")],
    to: To = None,
    root: Root = None,
) -> None:
    """Bring a quiz that was edited in Moodle back: writes the bank's YAML anew."""
    from quizzes.exchange import bank_files

    with as_course_errors():
        path, merged = bank_files.import_gift(
            file, bank_files.open_bank(into, _banks_folder(root)), to
        )
    changes = "nothing has changed" if not merged.changed else f"{merged.changed} new or changed"
    _print_notes(f"Written: {path} ({changes})", merged.notes)


@app.command()
def lint(quizzes: Quizzes, root: Root = None) -> None:
    """Look for all that is wrong with quizzes: faults, and questions easy to guess or unfair."""
    from quizzes.bank import lint as bank_lint
    from quizzes.errors import BankError
    from quizzes.exchange import bank_files

    sound = True
    for quiz in quizzes:
        try:
            bank = bank_files.open_bank(quiz, _banks_folder(root))
        except BankError as error:
            sound = False
            _print_faults(quiz, error)
            continue
        found = [str(finding) for finding in bank_lint.list_findings(bank)]
        _print_notes(f"{bank.quiz}: {len(found)} to mend", found)
        sound = sound and not found
    if not sound:
        raise typer.Exit(1)


def _print_faults(quiz: str, error: BankError) -> None:
    if error.faults == (str(error),):  # it could not be read at all, or has a single fault
        err.print(f"autograder: {error}", soft_wrap=True)
        return
    then = "Its questions are read critically once these are mended."
    _print_notes(f"{quiz}: {len(error.faults)} to mend", [*error.faults, then])


@app.command()
def schema(
    as_json: Annotated[
        bool, typer.Option("--json", help="Print JSON Schema, for editors.")
    ] = False,
) -> None:
    """Print the format of a bank: each field, its bounds, who needs it, and two examples."""
    from quizzes.bank import schema as bank_schema

    if as_json:
        text = json.dumps(bank_schema.json_schema(), indent=2, ensure_ascii=False) + "\n"
    else:
        text = bank_schema.as_markdown()
    sys.stdout.write(text)


def _banks_folder(root: Path | None) -> Path | None:
    """Return the folder of the course's own banks; None if there is no course here."""
    from autograder.assignments.quiz_cells import BANKS

    found = root_if_any(root)
    return found / BANKS if found else None


@contextmanager
def as_course_errors() -> Iterator[None]:
    """Let an error of `quizzes`, which knows nothing of the course, be printed as its sentence."""
    from quizzes.errors import QuizError

    try:
        yield
    except QuizError as error:
        raise QuizCommandError(str(error)) from error


def _print_notes(headline: str, notes: list[str]) -> None:
    for line in (headline, *(f"  {note}" for note in notes)):
        out.print(line, soft_wrap=True)
