"""A student's page about all exercises: ``feedback/STUDENT/ASSIGNMENT/index.html``.

It needs nothing but the pages of feedback beside it: no script, no style, no request.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

from nbgrader.api import Gradebook
from nbgrader.coursedir import CourseDirectory
from traitlets.config import Config

from autograder.gradebook.feedback import sheets
from autograder.gradebook.feedback.feedback_page import INDEX
from autograder.gradebook.feedback.sheets import ExerciseSheet, Sheet, SheetLine
from autograder.util.work_files import write_whole
from quizzes.text.html_pages import fill_template

_TEMPLATE = Path(__file__).with_name("index_page.html.jinja")


@dataclass(frozen=True)
class IndexRow:
    """A graded cell: its title, where it stands in the feedback, and what is said of it."""

    title: str
    link: str
    said: str
    waits: bool


@dataclass(frozen=True)
class IndexPart:
    """An exercise, the rows of its cells, and what lateness takes off, if anything."""

    title: str
    link: str
    said: str
    rows: list[IndexRow]
    penalty: str


class IndexPages:
    """Writes the index page once nbgrader has written a student's feedback.

    It is nbgrader's ``GenerateFeedback.post_convert_hook``, so that `autograder grade`, `nbgrader
    generate_feedback` and the formgrader's button do the same.
    """

    def __init__(self, config: Config) -> None:
        """Use the course of a ``config``, as it is by the time that feedback is written."""
        self._config = config

    def __call__(self, assignment: str, student: str, notebooks: Sequence[str]) -> None:
        """Write the page of the student whose graded ``notebooks`` were shown, of their folder."""
        if not notebooks:
            return
        graded = Path(notebooks[0]).parent  # the names that nbgrader hands over can be patterns
        assignment, student = graded.name, graded.parent.name
        coursedir = CourseDirectory(config=self._config)
        place = coursedir.format_path(coursedir.feedback_directory, student, assignment)
        write_page(coursedir, assignment, student, Path(place))


def write_page(coursedir: CourseDirectory, assignment: str, student: str, folder: Path) -> None:
    """Write the index page into a ``folder`` of feedback pages.

    A notebook that is called "index" has this name for its own page: then nothing is written.

    Raises:
        MissingEntry: there is no such submission.
        OSError: it cannot be written.
    """
    with Gradebook(coursedir.db_url, coursedir.course_id) as gradebook:
        sheet = sheets.read_sheet(gradebook, coursedir, assignment, student)
    if Path(INDEX).stem not in {exercise.notebook for exercise in sheet.exercises}:
        write_whole(folder / INDEX, render_page(sheet))


def render_page(sheet: Sheet) -> str:
    """Return a sheet as one HTML page."""
    return fill_template(
        _TEMPLATE,
        title=f"{sheet.assignment}: feedback for {sheet.name}",
        sheet=sheet,
        handed_in=f"{sheet.handed_in:%Y-%m-%d at %H:%M}" if sheet.handed_in else "",
        parts=[_show_exercise(exercise) for exercise in sheet.exercises],
    )


def _show_exercise(exercise: ExerciseSheet) -> IndexPart:
    link = quote(f"{exercise.notebook}.html")
    return IndexPart(
        exercise.title,
        link,
        f"{exercise.score:g} of {exercise.max_score:g}",
        [_show_line(line, link) for line in exercise.lines],
        f"{exercise.penalty:g}" if exercise.penalty else "",
    )


def _show_line(line: SheetLine, link: str) -> IndexRow:
    said = f"{line.said}, with a comment" if line.comment else line.said
    return IndexRow(line.title, f"{link}#{quote(line.grade_id)}", said, line.waits)


def configure_feedback(config: Config) -> None:
    """Have feedback be written with its index page, unless a ``config`` says otherwise."""
    chosen: Any = config.GenerateFeedback
    if "post_convert_hook" not in chosen:
        chosen.post_convert_hook = IndexPages(config)
