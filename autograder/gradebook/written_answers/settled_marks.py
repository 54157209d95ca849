"""What a person has marked in a submission, and whether it must be looked at again.

nbgrader asks for every mark again once a submission is autograded. A person need look again only at
what is different: an answer that changed, or one that is worth another number of points. They saw
the graded copy, so its content is remembered until the new one is entered.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from urllib.parse import unquote

from nbformat import NotebookNode
from nbgrader.api import Gradebook, MissingEntry

from autograder.assignments import questions, submission
from autograder.assignments.questions import Asked
from autograder.assignments.submission import SubmissionError
from autograder.gradebook import staging
from autograder.util.state_table import StateTable
from autograder.util.work_files import walk_files

KIND = "marked"

CellName = tuple[str, str]
"""A notebook and a grade id in it."""


@dataclass(frozen=True)
class SettledMark:
    """One cell as a person has marked it.

    Attributes:
        auto: its automatic points, or None where only a person gives any.
        points: what it was worth, or None if no graded copy says so.
        content: digest of the answer, or of the whole program where an exam looks at that; empty
            if no graded copy says so.
    """

    auto: float | None
    points: float | None = None
    content: str = ""


MarkedCells = dict[CellName, SettledMark]


def with_copy(scores: Mapping[CellName, float | None], copy: Path) -> MarkedCells:
    """Return cells as they stand in the graded ``copy`` of a submission.

    Args:
        scores: {cell: automatic points} of those that are meant.
        copy: the folder with its notebooks.
    """
    marked = {cell: SettledMark(auto) for cell, auto in scores.items()}
    for notebook in {notebook for notebook, _ in scores}:
        try:
            found = submission.read_notebook(copy / f"{notebook}.ipynb")
        except SubmissionError:  # it is gone: nobody can tell
            continue
        for cell in found.cells:
            name = (notebook, submission.grade_id(cell))
            data = submission.nbgrader_metadata(cell)
            if name in marked and data.get("grade"):
                content = (
                    _digest_answer(cell, copy)
                    if data.get("solution")
                    else _digest_program(found, copy)
                )
                marked[name] = replace(marked[name], points=data.get("points"), content=content)
    return marked


def find_changes(before: MarkedCells, after: MarkedCells, *, same: bool) -> dict[CellName, str]:
    """Return {cell: why it must be looked at again}, for those of ``before`` that must be.

    ``same`` says that the whole submission is the one that was marked.
    """
    found = {}
    for name, old in before.items():
        new = after.get(name)
        if new is None:  # the assignment has lost the cell since
            continue
        if old.points is not None and new.points is not None and old.points != new.points:
            found[name] = f"{new.points:g} points now, not {old.points:g}"
        elif old.content != new.content if old.content else not same:
            found[name] = "it changed"
        elif old.auto != new.auto:
            found[name] = "the checks find something else"
    return found


def describe_changes(asked: Mapping[str, str]) -> str:
    """Return the sentence that says what must be marked again, and why; empty if nothing.

    ``asked`` is {what the answer is called: why}.
    """
    if not asked:
        return ""
    answers = ", ".join(f"{called} ({why})" for called, why in asked.items())
    return f"To be marked again: {answers}."


class Marks:
    """The marks that people gave for one assignment, while nbgrader enters submissions again."""

    def __init__(self, work: Path, assignment: str, asked: Asked) -> None:
        """Keep in the folder ``work`` what a run that is ended in between must not lose.

        The questions ``asked`` are what answers are called by.
        """
        self._assignment = assignment
        self._questions = asked
        self._table = StateTable(work, KIND, assignment)

    def remember(self, book: Gradebook, student: str, copy: Path) -> None:
        """Note what is marked for good, and what it is of: the graded ``copy`` is replaced next.

        Raises:
            OSError: it cannot be written down.
        """
        try:
            notebooks = book.find_submission(self._assignment, student).notebooks
        except MissingEntry:
            return
        scores = {
            (notebook.name, grade.name): grade.auto_score
            for notebook in notebooks
            for grade in notebook.grades
            if grade.manual_score is not None and not grade.needs_manual_grade
        }
        # Of a run that was ended in between: its marks are asked for, and the copy may be gone.
        if before := {**self.remembered_cells(student), **with_copy(scores, copy)}:
            rows = [[*name, asdict(marked)] for name, marked in before.items()]
            self._table.put(json.dumps(rows), student)

    def settle(self, book: Gradebook, student: str, copy: Path, *, same: bool) -> str:
        """Take the marks of what is still the same for good again, once a student is entered.

        Return the sentence that says what is to be marked again, and why; empty if nothing.
        """
        before = self.remembered_cells(student)
        if not before:
            return ""
        grades = {}
        for notebook, cell in before:
            with suppress(MissingEntry):  # the assignment has lost the cell since
                grades[notebook, cell] = book.find_grade(cell, notebook, self._assignment, student)
        scores = {name: grade.auto_score for name, grade in grades.items()}
        asked = find_changes(before, with_copy(scores, copy), same=same)
        for name, grade in grades.items():
            if name not in asked and grade.manual_score is not None:
                grade.needs_manual_grade = False
        book.db.commit()
        self._table.remove(student)
        return describe_changes({
            questions.describe_cell(self._questions, *name): why
            for name, why in asked.items()
        })  # fmt: skip

    def remembered_cells(self, student: str) -> MarkedCells:
        """Return what is remembered of a student who is not entered yet."""
        rows = json.loads(self._table.get(student) or "[]")
        try:
            return {(notebook, cell): SettledMark(**marked) for notebook, cell, marked in rows}
        except (ValueError, TypeError):  # of another version
            return {}


def _digest_answer(cell: NotebookNode, folder: Path) -> str:
    """Return a digest of an answer: its text, and the pictures and files that it names."""
    attached = json.dumps(cell.get("attachments", {}), sort_keys=True)
    text = unquote(cell.source)
    named = [path for path in _files_beside(folder) if path.name in text]
    return _digest_contents([cell.source.strip(), attached], named)


def _digest_program(notebook: NotebookNode, folder: Path) -> str:
    """Return a digest of all that a student's code is."""
    code = [
        cell.source
        for cell in notebook.cells
        if cell.cell_type == "code" and not submission.is_locked(cell)
    ]
    return _digest_contents(code, _files_beside(folder))


def _files_beside(folder: Path) -> list[Path]:
    """Return the files beside the notebooks that are a student's work."""
    others = (staging.TIME, staging.SECRET)
    paths = (p for p in walk_files(folder) if p.suffix != ".ipynb" and p.name not in others)
    return sorted(path for path in paths if path.is_file())


def _digest_contents(texts: Iterable[str], files: Iterable[Path]) -> str:
    state = hashlib.sha256(json.dumps(list(texts)).encode())
    for path in files:
        state.update(os.fsencode(path.name) + b"\0" + path.read_bytes())
    return state.hexdigest()
