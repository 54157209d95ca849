"""What a feedback page says of its grades; the template ``course_feedback`` shows it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from nbformat import NotebookNode
from nbgrader.api import Gradebook

from autograder.assignments import submission
from autograder.assignments.intake import roster
from autograder.gradebook.feedback import sheets
from autograder.gradebook.feedback.sheets import ExerciseSheet, SheetLine
from autograder.gradebook.staging import SECRET

TEMPLATES = Path(__file__).parent / "templates"
TEMPLATE = "course_feedback"
INDEX = "index.html"
"""A student's page about all exercises of an assignment, beside the pages of each."""


@dataclass(frozen=True)
class Feedback:
    """What the template shows beside the notebook itself.

    ``index`` is the link to the page about all exercises, empty where that does not lie beside it;
    ``has_math`` says that a script has to draw formulas.
    """

    title: str
    total: str
    lines: tuple[SheetLine, ...]
    late: str = ""
    index: str = ""
    has_math: bool = False

    def of_cell(self, cell: NotebookNode) -> SheetLine | None:
        """Return what a cell earned, if it is graded."""
        if not submission.nbgrader_metadata(cell).get("grade"):
            return None
        name = submission.grade_id(cell)
        return next((line for line in self.lines if line.grade_id == name), None)


def describe_feedback(notebook: NotebookNode, resources: Any, converter: Any) -> Feedback:
    """Return what the page of a notebook says, from the gradebook.

    Args:
        notebook: the graded copy, with the comments that nbgrader has put into it.
        resources: nbgrader's, of which the names and the gradebook's address are used; without
            them nobody's page is made (while templates are warmed up), and it says nothing.
        converter: nbgrader's, which knows the course.
    """
    names = resources.get("nbgrader", {})
    if "student" not in names or converter is None:
        return Feedback("Feedback", "", ())
    with Gradebook(names["db_url"]) as gradebook:
        sheet = sheets.read_sheet(
            gradebook, converter.coursedir, names["assignment"], names["student"]
        )
    exercise = next(
        (found for found in sheet.exercises if found.notebook == names["notebook"]),
        ExerciseSheet(names["notebook"], names["notebook"], ()),
    )
    late = sheets.describe_lateness(sheet.seconds_late, exercise.penalty)
    has_index = names["notebook"] != Path(INDEX).stem and not _goes_alone(converter, names)
    return Feedback(
        exercise.title, exercise.score_sentence, exercise.lines, late, INDEX if has_index else "",
        any("$" in cell.source for cell in notebook.cells if cell.cell_type == "markdown"),
    )  # fmt: skip


def _goes_alone(converter: Any, names: Any) -> bool:
    """Whether a student fetches the page through the exchange: it hands out only notebooks' pages.

    A link to the page about all exercises would lead nowhere there.
    """
    folder = roster.student_folder(Path(converter.coursedir.root), names["student"])
    secret = folder / str(names["assignment"]) / SECRET
    return secret.exists()
