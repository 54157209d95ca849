"""Quizzes as an assignment has them: a grade cell ``quiz-NAME`` stands for the quiz NAME."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from nbformat import NotebookNode

from autograder.assignments import submission
from course.errors import CourseError
from quizzes.bank import loader
from quizzes.bank.contents import Bank
from quizzes.errors import QuizError

PREFIX = "quiz-"
BANKS = Path("authoring") / "banks"
"""The folder under the course root with a course's own banks."""


class QuizMarksError(CourseError):
    """A quiz whose bank cannot be used for marking."""


def quiz_names(root: Path) -> list[str]:
    """Return the names of the quizzes that a course can use: its own, and those of the package."""
    return sorted({*loader.names(root / BANKS), *loader.names()})


def find_bank(root: Path, name: str) -> Bank:
    """Return the bank of a quiz, the course's own before one of the package.

    Raises:
        QuizMarksError: it is not sound, or has no keys.
    """
    own = root / BANKS
    try:
        found = loader.find_bank(name, own)
    except QuizError as error:
        raise QuizMarksError(str(error)) from error
    if found.keyless:
        raise QuizMarksError(
            f"{own / name}.yaml has no keys, so nothing can be marked with it: put the bank that "
            "the questions were made of there."
        )
    return found


def of_grade_cells(root: Path) -> dict[str, float]:
    """Return {grade_id: points} for the quizzes there are: one point for each concept.

    Raises:
        QuizMarksError: a bank is not sound.
    """
    return {
        f"{PREFIX}{name}": float(len(find_bank(root, name).concepts)) for name in quiz_names(root)
    }


def in_cells(notebook: NotebookNode) -> Iterator[str]:
    """Yield the names in a notebook's grade cells of quizzes, whether or not there are such."""
    for cell in notebook.cells:
        graded = bool(submission.nbgrader_metadata(cell).get("grade")) and submission.is_locked(
            cell
        )
        if graded and submission.grade_id(cell).startswith(PREFIX):
            yield submission.grade_id(cell).removeprefix(PREFIX)
