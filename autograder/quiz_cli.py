"""``autograder quiz``: banks of questions to and from learning platforms, and their lint."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from course.errors import CourseError

app = typer.Typer(help="Exchange quizzes with learning platforms.", no_args_is_help=True)
out = Console()

Quiz = Annotated[str, typer.Argument(help="A quiz such as ch05, or a bank's YAML file.")]
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
) -> None:
    """Write a quiz for a learning platform."""
    from quizzes.exchange import files

    with as_course_errors():
        path, notes = files.export_bank(files.open_bank(quiz), format_name, to)
    _say(f"Written: {path}", notes)


@app.command("import")
def import_command(
    file: Annotated[Path, typer.Argument(help="A GIFT file.")],
    into: Annotated[str, typer.Option("--into", help="The quiz it belongs to.")],
    to: To = None,
) -> None:
    """Bring a quiz that was edited in Moodle back: writes the bank's YAML anew."""
    from quizzes.exchange import files

    with as_course_errors():
        path, merged = files.import_gift(file, files.open_bank(into), to)
    changes = "nothing has changed" if not merged.changed else f"{merged.changed} new or changed"
    _say(f"Written: {path} ({changes})", merged.notes)


@app.command()
def lint(quiz: Quiz) -> None:
    """Look for questions that are easy to guess, unfair, or teach nothing."""
    from quizzes import lint as bank_lint
    from quizzes.exchange import files

    with as_course_errors():
        bank = files.open_bank(quiz)
    findings = bank_lint.findings(bank)
    _say(f"{bank.quiz}: {len(findings)} to mend", [str(finding) for finding in findings])
    if findings:
        raise typer.Exit(1)


@contextmanager
def as_course_errors() -> Iterator[None]:
    """Let an error of `quizzes`, which knows nothing of the course, be printed as its sentence."""
    from quizzes.errors import QuizError

    try:
        yield
    except QuizError as error:
        raise QuizCommandError(str(error)) from error


def _say(headline: str, notes: list[str]) -> None:
    for line in (headline, *(f"  {note}" for note in notes)):
        out.print(line, markup=False, highlight=False, soft_wrap=True)
