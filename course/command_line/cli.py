"""The ``course`` command."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from course.errors import CourseError

app = typer.Typer(
    name="course",
    help="Learn the building blocks of ROS 2 in JupyterLab.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
out = Console()
err = Console(stderr=True)


@app.command(context_settings={"ignore_unknown_options": True})
def lab(
    arguments: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[DIR] [JUPYTERLAB OPTIONS]",
            help="The working copy (./ros2-course), then what JupyterLab is to be told.",
            show_default=False,
        ),
    ] = None,
    no_browser: Annotated[
        bool, typer.Option("--no-browser", help="Only print JupyterLab's address.")
    ] = False,
    copy_only: Annotated[
        bool, typer.Option("--copy-only", help="Make the working copy and stop.")
    ] = False,
    chapters_only: Annotated[
        bool,
        typer.Option(
            "--chapters-only", help="Leave out the exercises: nbgrader's exchange hands them out."
        ),
    ] = False,
) -> None:
    """Open JupyterLab on a working copy of the chapters and exercises.

    Your files are never overwritten: a newer version from the course is put beside yours.
    """
    from course.workspace import working_copy as course_lab

    rest = list(arguments or [])
    # JupyterLab's own options take values, so only the first word can be the folder.
    folder = Path(rest.pop(0)) if rest and not rest[0].startswith("-") else course_lab.DEFAULT
    folder = folder.expanduser().absolute()
    copied = course_lab.make_copy(folder, assignments=not chapters_only)
    for name in copied.new:
        _print_text(f"new: {folder / name}")
    for name, beside in copied.beside.items():
        _print_text(f"The course has a newer {name}. Yours is untouched; the new one is {beside}.")
    _print_text(f"Your working copy is {folder}")
    if not copy_only:
        course_lab.open_lab(folder, ["--no-browser", *rest] if no_browser else rest)


@app.command()
def progress(
    folder: Annotated[
        Path | None,
        typer.Argument(metavar="[DIR]", help="The working copy (./ros2-course, or here)."),
    ] = None,
) -> None:
    """Say what is done and what is left in your working copy."""
    from course.workspace import working_copy as course_lab
    from course.workspace.journal.progress import progress as read

    inside = course_lab.DEFAULT if course_lab.DEFAULT.is_dir() else None
    _print_text(repr(read(folder.expanduser() if folder else inside)))


@app.command()
def doctor(
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON for machines.")] = False,
) -> None:
    """Say what is wrong with this machine, and how to mend it. Exit code 1 if something is."""
    from course import doctor as course_doctor

    findings = []
    for finding in course_doctor.examine_all():
        findings.append(finding)
        if not as_json:
            _print_text(finding.as_text())
    if as_json:
        _print_text(json.dumps([finding.as_data() for finding in findings], ensure_ascii=False))
    else:
        _print_text(course_doctor.summary_line(findings))
    raise typer.Exit(course_doctor.exit_code(findings))


def _print_text(text: str) -> None:
    out.print(text, markup=False, highlight=False, soft_wrap=True)


def main() -> None:
    """Run the command; a `CourseError` is printed as its sentence, with its exit code."""
    try:
        app()
    except CourseError as error:
        err.print(f"course: {error}", markup=False, highlight=False, soft_wrap=True)
        sys.exit(error.exit_code)
    except KeyboardInterrupt:
        sys.exit(130)
