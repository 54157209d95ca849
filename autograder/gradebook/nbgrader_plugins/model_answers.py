"""Model answers beside the written answers in the formgrader, and nowhere else.

nbgrader's formgrader renders the graded copy with nbconvert's exporter. A preprocessor puts a cell
above each answer for this one page: nothing of it is written to a file, so it reaches neither a
release nor a graded copy nor feedback.
"""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import Any

from nbconvert.preprocessors import Preprocessor
from nbformat import NotebookNode
from nbformat.v4 import new_markdown_cell
from nbgrader.coursedir import CourseDirectory

from autograder.assignments import questions, submission
from autograder.assignments.questions import GradedQuestion
from autograder.assignments.submission import SubmissionError
from quizzes.text import rendering

FORMGRADER_KEYS = {"submission_id", "assignment_id", "notebook_id"}
"""Resources that the formgrader alone hands to its exporter; its page shows them."""


class ShowModelAnswers(Preprocessor):
    """Shows the model answer, and what the points are for, above each answer in the formgrader."""

    def preprocess(self, nb: NotebookNode, resources: Any) -> tuple[NotebookNode, Any]:
        """Put them into ``nb`` if it is the formgrader that shows it; else change nothing."""
        if not FORMGRADER_KEYS.issubset(resources):
            return nb, resources
        asked = self._load_questions(str(resources["assignment_id"]), str(resources["notebook_id"]))
        cells = []
        for cell in nb.cells:
            question = asked.get(submission.grade_id(cell))
            if question and question.model:
                cells.append(new_markdown_cell(_model_answer_html(question)))  # type: ignore[no-untyped-call]
            cells.append(cell)
        nb.cells = cells
        return nb, resources

    def _load_questions(self, assignment: str, notebook: str) -> dict[str, GradedQuestion]:
        coursedir = CourseDirectory(config=self.config)
        try:
            return questions.of_assignment(coursedir, assignment).get(notebook, {})
        except (SubmissionError, OSError) as error:
            self.log.warning("No model answers for %s: %s", assignment, error)
            return {}


def _model_answer_html(question: GradedQuestion) -> str:
    """Return a model answer as HTML that Markdown leaves as it is: it has no empty line."""
    parts = [("Model answer", question.model), ("The points, as students read it", question.rules)]
    shown = "".join(
        f"<strong>{heading}</strong>{_render_markdown(text)}" for heading, text in parts if text
    )
    style = "border-left: .3rem solid #009e73; padding: .2rem .8rem; background: #f0faf6"
    shown = "\n".join(line for line in shown.splitlines() if line.strip())
    return f'<div class="model-answer" style="{style}">{shown}</div>'


def _render_markdown(markdown: str) -> str:
    try:
        return rendering.render_block(
            markdown, Path("/nonexistent")
        )  # these texts have no pictures
    except rendering.RenderError:
        return f"<pre>{escape(markdown)}</pre>"
