"""A student's page about all exercises: ``feedback/STUDENT/ASSIGNMENT/index.html``.

It needs nothing but the pages of feedback beside it: no script, no style, no request.
"""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any
from urllib.parse import quote

from nbgrader.api import Gradebook
from nbgrader.coursedir import CourseDirectory
from traitlets.config import Config

from autograder.gradebook.feedback import sheets
from autograder.gradebook.feedback.feedback_page import INDEX
from autograder.gradebook.feedback.sheets import Exercise, Line, Sheet
from autograder.util.files import write_whole

_STYLE = """
:root { color-scheme: light dark; }
body { font: 1rem/1.5 system-ui, sans-serif; max-width: 48rem; margin: 2rem auto; padding: 0 1rem; }
table { border-collapse: collapse; width: 100%; margin: 1rem 0; }
th, td { text-align: left; padding: .25rem .6rem; border-bottom: 1px solid #8888;
  vertical-align: top; overflow-wrap: anywhere; font-weight: normal; }
thead th, tfoot th, tfoot td, .exercise th, .exercise td { font-weight: 600; }
tbody th { padding-left: 1.6rem; }
.exercise th { padding-left: .6rem; }
td { white-space: nowrap; }
.waits { font-style: italic; }
.late { font-weight: 600; }
"""


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
    title = f"{sheet.assignment}: feedback for {sheet.name}"
    body = "".join(_exercise_rows(exercise) for exercise in sheet.exercises)
    late = f'<p class="late">{escape(sheet.late_sentence)}</p>' if sheet.late_sentence else ""
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta http-equiv="Content-Security-Policy" '
        "content=\"default-src 'none'; style-src 'unsafe-inline'\">"
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}</title><style>{_STYLE}</style></head>\n"
        f"<body><main><h1>{escape(title)}</h1>"
        f"<p><strong>{escape(sheet.score_sentence)}</strong></p>{late}{_handed_in(sheet)}"
        '<table><thead><tr><th scope="col">Exercise</th><th scope="col">Points</th></tr></thead>'
        f"<tbody>{body}</tbody></table></main></body></html>\n"
    )


def _exercise_rows(exercise: Exercise) -> str:
    link = quote(f"{exercise.notebook}.html")
    penalty = f"<tr><th>Late</th><td>-{exercise.penalty:g}</td></tr>" if exercise.penalty else ""
    return (
        f'<tr class="exercise"><th scope="row"><a href="{link}">{escape(exercise.title)}</a></th>'
        f"<td>{exercise.score:g} of {exercise.max_score:g}</td></tr>"
        + "".join(_line_row(line, link) for line in exercise.lines)
        + penalty
    )


def _line_row(line: Line, link: str) -> str:
    kind = ' class="waits"' if line.waits else ""
    comment = ", with a comment" if line.comment else ""
    return (
        f'<tr><th scope="row"><a href="{link}#{quote(line.grade_id)}">{escape(line.title)}</a></th>'
        f"<td{kind}>{escape(line.said)}{comment}</td></tr>"
    )


def _handed_in(sheet: Sheet) -> str:
    if sheet.handed_in is None:
        return ""
    return f"<p>Handed in on {sheet.handed_in:%Y-%m-%d at %H:%M} UTC.</p>"


def configure_feedback(config: Config) -> None:
    """Have feedback be written with its index page, unless a ``config`` says otherwise."""
    chosen: Any = config.GenerateFeedback
    if "post_convert_hook" not in chosen:
        chosen.post_convert_hook = IndexPages(config)
