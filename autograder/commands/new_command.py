"""``autograder new``: a course, an exercise, a quiz or a hub to begin with; each works at once."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import Annotated

import typer

from autograder.assignments import listing
from autograder.commands.options import Root, course_root
from autograder.hub import new_hub
from autograder.hub.hub_settings import COURSE_ID
from autograder.util import exercise_folders
from autograder.util.terminal import Terminal
from course.errors import CourseError
from course.workspace.content import CONFIG, content_root
from quizzes.bank.schema import EXAMPLES

app = typer.Typer(help="Begin a course, an exercise, a quiz or a hub.", no_args_is_help=True)
out = Terminal()

TEMPLATE = exercise_folders.NEW_EXERCISE
"""The files of a small exercise that works: each ends in .txt, as none of them is a module here."""

QUIZ = "lesson.yaml"
"""The example that a new quiz begins as."""


class NewError(CourseError):
    """Something new that cannot be made; the message says why, and what to do."""


@app.command("course")
def course_command(
    folder: Path,
    chapter: Annotated[
        bool, typer.Option("--chapter-5", help="With the texts of chapter 5 and its exercises.")
    ] = False,
    course_id: Annotated[
        str, typer.Option("--course-id", help="Its name in nbgrader's exchange (ros2-course).")
    ] = "",
    exchange: Annotated[
        Path | None, typer.Option("--exchange", help="nbgrader's exchange, as on a hub.")
    ] = None,
) -> None:
    """Make a course root: nbgrader's configuration, and a place for exercises of your own."""
    made = make_course(folder, with_chapter=chapter, course_id=course_id, exchange=exchange)
    out.print(f"A course: {made}", soft_wrap=True)
    out.print(f"Go on with: cd {folder} && autograder new exercise NAME --assignment lab1")


@app.command("exercise")
def exercise_command(
    name: str,
    assignment: Annotated[
        str, typer.Option("--assignment", help="The assignment that it belongs to, new or not.")
    ],
    root: Root = None,
) -> None:
    """Make an exercise that builds and grades: a lamp that blinks, to be made into your own."""
    folder = make_exercise(course_root(root), name, assignment)
    out.print(f"An exercise: {folder}", soft_wrap=True)
    out.print(f"Go on with: autograder try {name}, then change its files.")


@app.command("quiz")
def quiz_command(name: str, root: Root = None) -> None:
    """Make a bank of questions, to be made into your own."""
    file = make_quiz(course_root(root), name)
    out.print(f"A quiz: {file}", soft_wrap=True)
    out.print(f"Go on with: autograder quiz lint {name}")


@app.command("hub")
def hub_command(
    folder: Path,
    exchange: Annotated[
        Path, typer.Option("--exchange", help="nbgrader's exchange, which all users share.")
    ] = new_hub.EXCHANGE,
    python: Annotated[
        Path | None,
        typer.Option("--python", help="The Python that users work with, if not this one."),
    ] = None,
) -> None:
    """Write a JupyterHub configuration: courses, graders, exchange, limits, in one folder."""
    made = new_hub.make_hub(folder, exchange, python)
    out.print(f"A hub: {made}", soft_wrap=True)
    out.print(f"Go on with: {folder / 'README.md'}", soft_wrap=True)


def make_course(
    folder: Path,
    *,
    with_chapter: bool = False,
    course_id: str = "",
    exchange: Path | None = None,
) -> Path:
    """Make a course root of a folder that is new or empty; return it.

    Args:
        folder: where to.
        with_chapter: with the texts of chapter 5.
        course_id: its name in nbgrader's exchange, if not the bundled course's.
        exchange: nbgrader's exchange, if not nbgrader's own default.

    Raises:
        NewError: the id cannot be one, there is something in the folder, or it cannot be written.
    """
    if course_id and not re.search(COURSE_ID, course_id):
        raise NewError(
            f"A course cannot have the id '{course_id}': take small letters, digits and hyphens."
        )
    try:
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise NewError(f"{folder} is not empty: choose a folder that is not there yet.")
        (folder / exercise_folders.FOLDER).mkdir(parents=True)
        (folder / listing.ASSIGNMENTS).mkdir(parents=True)
        shutil.copyfile(content_root() / CONFIG, folder / CONFIG)
        with (folder / CONFIG).open("a", encoding="utf-8") as config:
            if course_id:
                config.write(f"\nc.CourseDirectory.course_id = {course_id!r}\n")
            if exchange:
                config.write(f"\nc.Exchange.root = {str(exchange.expanduser().absolute())!r}\n")
        if with_chapter:
            shutil.copytree(content_root() / "authoring", folder / "authoring", dirs_exist_ok=True)
    except OSError as error:
        raise _unwritable(folder, error) from error
    return folder.resolve()


def make_exercise(root: Path, name: str, assignment: str) -> Path:
    """Make an exercise in the course at ``root``, and add it to an assignment; return its folder.

    Raises:
        NewError: it has that exercise, or the name cannot be one.
        AssignmentBuildError: the assignment's list is not sound.
    """
    if not name.isidentifier() or not name.islower():
        raise NewError(
            f"An exercise cannot be called '{name}': take small letters, digits and underscores, "
            "as a Python module has."
        )
    exercise_folders.use_course(root)
    if name in exercise_folders.current_exercises().folders:
        raise NewError(f"There is an exercise '{name}' already: choose another name.")
    folder = root / exercise_folders.FOLDER / name
    try:
        for file in sorted(TEMPLATE.rglob("*.txt")):
            target = folder / file.relative_to(TEMPLATE).with_suffix("")
            target.parent.mkdir(parents=True, exist_ok=True)
            text = file.read_text(encoding="utf-8").replace("NAME", name)
            target.write_text(text, encoding="utf-8")
        listing.add_exercise(root, assignment, name)
    except OSError as error:
        raise _unwritable(folder, error) from error
    return folder


def make_quiz(root: Path, name: str) -> Path:
    """Make a bank of the course at ``root`` from the example; return its file.

    Raises:
        NewError: it has that quiz, or the name cannot be one.
    """
    if not name.replace("-", "_").isidentifier():
        raise NewError(f"A quiz cannot be called '{name}': take letters, digits and hyphens.")
    file = root / "authoring" / "banks" / f"{name}.yaml"
    if file.exists():
        raise NewError(f"There is a quiz {file} already: choose another name.")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        text = (EXAMPLES / QUIZ).read_text(encoding="utf-8")
        file.write_text(text.replace("quiz: lesson", f"quiz: {name}", 1), encoding="utf-8")
    except OSError as error:
        raise _unwritable(file, error) from error
    return file


def _unwritable(place: Path, error: OSError) -> NewError:
    return NewError(
        f"{place} cannot be written ({error.strerror or error}): make room there, or choose "
        "another folder."
    )
