"""What an assignment asks: graded cells by their questions, and how a person marks answers.

All of it stands in the assignment's own source: a written answer is called by the heading above it,
the text under that heading is the question, the text under the heading one level up says what a
point and half a point are for, and the solution region of the answer's cell is the model answer.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from nbformat import NotebookNode
from nbgrader.coursedir import CourseDirectory

from autograder.assignments import cells, submission
from autograder.assignments.quiz_cells import PREFIX
from autograder.assignments.submission import SubmissionError
from autograder.examination import points
from quizzes.text import rendering

PARTS = {"visible": "Checks in the notebook", "hidden": "Checks at grading"}
"""What the parts of an exam are called; another one is called by its own name."""

_HEADING = re.compile(r"(#{1,6})\s+(.+?)\s*#*\s*")
_FENCE = re.compile(r"\s*(```|~~~)")


@dataclass(frozen=True)
class GradedQuestion:
    """A graded cell of an assignment.

    Attributes:
        notebook, grade_id: the cell.
        title: what it is called, as plain text.
        written: whether a person marks it.
        max_points: what it is worth.
        text: the question, Markdown without its heading; empty if it is no written answer.
        rules: what the marks are for, Markdown, as students read it above the questions.
        model: the model answer, Markdown or code; empty if the notebook has none (a release).
        stub: what stands in a cell that nobody has answered.
    """

    notebook: str
    grade_id: str
    title: str
    written: bool
    max_points: float
    text: str = ""
    rules: str = ""
    model: str = ""
    stub: str = ""


Asked = Mapping[str, Mapping[str, GradedQuestion]]
"""The questions of an assignment: {notebook: {grade id: question}}."""


@dataclass
class _Section:
    level: int
    title: str
    body: str


def of_notebook(notebook: NotebookNode, name: str) -> dict[str, GradedQuestion]:
    """Return {grade id: question} in the order of the cells; headings count in locked cells only.

    Args:
        notebook: any version of it; only the source has the model answers.
        name: the notebook's.
    """
    found: dict[str, GradedQuestion] = {}
    above: list[_Section] = []
    for cell in notebook.cells:
        data = submission.nbgrader_metadata(cell)
        grade_id = submission.grade_id(cell)
        if data.get("grade") and grade_id:
            title = _free_title(_cell_title(grade_id, above), {q.title for q in found.values()})
            found[grade_id] = _make_question(cell, name, title, above)
        elif cell.cell_type == "markdown" and submission.is_locked(cell):
            for section in _split_sections(cell.source):
                above = [s for s in above if s.level < section.level] + [section]
    return found


def of_assignment(
    coursedir: CourseDirectory, assignment: str
) -> dict[str, dict[str, GradedQuestion]]:
    """Return {notebook: {grade id: question}} from an assignment's source; what is not there, not.

    Raises:
        SubmissionError: a notebook of the source cannot be read.
    """
    folder = Path(coursedir.format_path(coursedir.source_directory, ".", assignment))
    return {
        path.stem: dict(_of_file(path, path.stat().st_mtime_ns))
        for path in sorted(folder.glob("*.ipynb"))
    }


def known_questions(
    coursedir: CourseDirectory, assignment: str
) -> dict[str, dict[str, GradedQuestion]]:
    """Return what `of_assignment` does, and nothing where the source cannot be read."""
    try:
        return of_assignment(coursedir, assignment)
    except (SubmissionError, OSError):
        return {}  # then cells are called by their grade ids: better than no word about them


def describe_cell(asked: Asked, notebook: str, grade_id: str) -> str:
    """Return what a graded cell is called where the reader does not see its exercise."""
    question = asked.get(notebook, {}).get(grade_id)
    exercise = title_of_notebook(notebook)
    return f"“{question.title if question else grade_id}” of {exercise}"


def title_of_notebook(notebook: str) -> str:
    """Return what an exercise is called: its title in the table of points, or its file's name."""
    for entry in points.table().values():
        if entry.notebook == notebook:
            return entry.title
    return notebook


@lru_cache(maxsize=64)
def _of_file(path: Path, _changed_ns: int) -> Mapping[str, GradedQuestion]:
    return of_notebook(submission.read_notebook(path), path.stem)


def _make_question(
    cell: NotebookNode, name: str, title: str, above: list[_Section]
) -> GradedQuestion:
    data = submission.nbgrader_metadata(cell)
    grade_id, worth = submission.grade_id(cell), float(data.get("points") or 0)
    if not data.get("solution"):
        return GradedQuestion(name, grade_id, title, False, worth)
    return GradedQuestion(
        name, grade_id, title, True, worth,
        text=above[-1].body if above else "",
        rules=above[-2].body if len(above) > 1 and above[-2].level > 1 else "",
        model="\n".join(
            line for mark, line in cells.marked_lines(cell.source) if mark == "SOLUTION"
        ),
        stub="\n".join(line for mark, line in cells.marked_lines(cell.source) if not mark).strip(),
    )  # fmt: skip


def _cell_title(grade_id: str, above: list[_Section]) -> str:
    if grade_id in points.grade_cells():
        _, part = points.grade_cells()[grade_id]
        return PARTS.get(part, part.capitalize())
    if grade_id.startswith(PREFIX):
        return "Quiz"
    return above[-1].title if above else grade_id


def _free_title(title: str, taken: set[str]) -> str:
    """Return a title that no other cell has: the second under one heading gets a number."""
    number = 2
    wanted = title
    while wanted in taken:
        wanted, number = f"{title} ({number})", number + 1
    return wanted


def _split_sections(source: str) -> Iterator[_Section]:
    """Yield the sections that begin in a Markdown cell."""
    section, fenced = None, ""
    for line in source.splitlines():
        if fence := _FENCE.match(line):
            fenced = "" if fenced == fence[1] else fenced or fence[1]
        if not fenced and (heading := _HEADING.fullmatch(line)):
            if section:
                yield section
            section = _Section(len(heading[1]), rendering.render_plain(heading[2]), "")
        elif section:
            section.body = f"{section.body}\n{line}".strip("\n")
    if section:
        yield section
