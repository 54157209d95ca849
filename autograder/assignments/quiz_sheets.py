"""Question sheets of an assignment's closed quizzes: what students get in place of the bank."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from nbformat import NotebookNode

from autograder.assignments import quiz_cells
from course.errors import CourseError
from quizzes.bank import loader
from quizzes.marking import closed_quizzes


class QuizSheetError(CourseError):
    """A quiz whose questions cannot be handed out; the message says what to change."""


def of_notebooks(root: Path, notebooks: Iterable[NotebookNode]) -> dict[Path, bytes]:
    """Return {path in the assignment's folder: content} of sheets and the pictures in them.

    Args:
        root: the course root, with banks of its own.
        notebooks: the instructor's notebooks of one assignment.

    Raises:
        QuizMarksError: a bank is not sound.
        QuizSheetError: students could not open the quiz, or a picture cannot be read.
    """
    own, known = loader.names(root / quiz_cells.BANKS), quiz_cells.quiz_names(root)
    found: dict[Path, bytes] = {}
    for notebook in notebooks:
        for name in quiz_cells.in_cells(notebook):
            if name not in known:
                continue
            bank = quiz_cells.find_bank(root, name)
            if bank.closed:
                found[Path(closed_quizzes.sheet_filename(name))] = closed_quizzes.make_sheet(
                    bank
                ).encode()
                found |= {Path(source): _read_picture(bank.folder / source)
                          for source in closed_quizzes.picture_files(bank)}  # fmt: skip
            elif name in own:
                raise QuizSheetError(
                    f"{root / quiz_cells.BANKS / name}.yaml does not reach students with its keys: "
                    "write 'closed: true' into it, and they get its questions without them."
                )
    return found


def _read_picture(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise QuizSheetError(f"{path} cannot be read ({error.strerror or error}).") from error
