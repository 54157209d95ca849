"""The course's own nbgrader: its configuration, its gradebook, and the calls that we make."""

from __future__ import annotations

import csv
import logging
import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from nbgrader.api import Gradebook, MissingEntry
from nbgrader.apps import NbGraderAPI
from nbgrader.coursedir import CourseDirectory
from traitlets.config import Config
from traitlets.config.loader import PyFileConfigLoader

from autograder.nbgrader_bridge import RestoreCells
from course.errors import CourseError


class GradebookError(CourseError):
    """nbgrader could not do what was asked; the message carries its own last words."""


class DiskFullError(CourseError):
    """There is no room for the gradebook or what nbgrader writes: the whole run has to stop."""


@dataclass(frozen=True)
class Grade:
    """One student's result: points earned and possible, and whether a person must still look.

    ``cells`` is {notebook: {grade id: points, or None while a manual grade is missing}}.
    """

    student: str
    score: float
    max_score: float
    needs_manual_grade: bool
    cells: dict[str, dict[str, float | None]]


class CourseGradebook:
    """nbgrader on one course root (the folder with ``nbgrader_config.py``)."""

    def __init__(self, root: Path, *, staged: str = "") -> None:
        """Use the course at ``root``.

        ``staged`` names a folder of submissions whose cells have been restored already; nbgrader
        then reads these in place of ``submitted``.
        """
        self.root = root.resolve()
        config = _config(self.root)
        config.CourseDirectory.root = str(self.root)
        if staged:
            config.CourseDirectory.submitted_directory = staged
            steps = config.Autograde.sanitize_preprocessors
            config.Autograde.sanitize_preprocessors = [s for s in steps if s is not RestoreCells]
        self.config: Config = config
        self.coursedir = CourseDirectory(config=config)
        self._api = NbGraderAPI(coursedir=self.coursedir, config=config)
        self._api.log_level = logging.ERROR

    def generate_assignment(self, assignment: str) -> None:
        """Make the student version of an assignment and enter it into the gradebook."""
        self._call(self._api.generate_assignment, assignment, force=True, create=True)

    def autograde(self, assignment: str, student: str) -> None:
        """Enter one student's scores."""
        self._call(self._api.autograde, assignment, student, force=True, create=True)

    def generate_feedback(self, assignment: str, student: str) -> None:
        """Write one student's feedback as HTML."""
        self._call(self._api.generate_feedback, assignment, student, force=True)

    def assignments(self) -> list[str]:
        """Return the assignments that have been released into the gradebook."""
        with self._open() as gradebook:
            return sorted(assignment.name for assignment in gradebook.assignments)

    def grades(self, assignment: str) -> list[Grade]:
        """Return the grades of an assignment, one a student, sorted by student."""
        with self._open() as gradebook:
            submissions = gradebook.assignment_submissions(assignment)
            return sorted((_grade(s) for s in submissions), key=lambda grade: grade.student)

    def _call(self, method: Any, *arguments: Any, **options: Any) -> None:
        with _quiet():
            result = method(*arguments, **options)
        if not result["success"]:
            said = f"{result.get('log', '')}\n{result.get('error') or ''}"
            if any(full in said for full in ("disk is full", "No space left on device")):
                raise DiskFullError(
                    f"The disk of {self.root} is full: make room there and run the same command "
                    "again; what was graded so far is kept."
                )
            raise GradebookError(
                f"nbgrader's {method.__name__} failed for {' and '.join(arguments)}: {_why(said)}"
            )

    @contextmanager
    def _open(self) -> Iterator[Gradebook]:
        try:
            with _quiet(), Gradebook(self.coursedir.db_url, self.coursedir.course_id) as gradebook:
                yield gradebook
        except MissingEntry as error:
            raise GradebookError(
                f"The gradebook in {self.root} has no such entry: {error}"
            ) from None


def _why(said: str) -> str:
    """Return the line of nbgrader's log that names the cause: of a traceback, the last line."""
    lines = [line.strip() for line in said.splitlines() if line.strip()]
    causes = [line for line in lines if re.match(r"[\w.]+(Error|Exception|Entry)\b", line)]
    return (causes or lines or ["no reason given"])[-1]


def _grade(submission: Any) -> Grade:
    cells: dict[str, dict[str, float | None]] = {}
    for notebook in submission.notebooks:
        cells[notebook.name] = {
            grade.name: None
            if grade.needs_manual_grade and grade.manual_score is None
            else float(grade.score)
            for grade in notebook.grades
        }
    return Grade(
        submission.student.id,
        float(submission.score),
        float(submission.max_score),
        bool(submission.needs_manual_grade),
        cells,
    )


def write_csv(grades: list[Grade], assignment: str, path: Path) -> None:
    """Write one line a student; a cell that waits for a manual grade is empty."""
    columns = sorted({(n, c) for g in grades for n, cells in g.cells.items() for c in cells})
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        head = ["assignment", "student_id", "score", "max_score", "needs_manual_grade"]
        writer.writerow(head + [f"{notebook}:{cell}" for notebook, cell in columns])
        for grade in grades:
            points = [grade.cells.get(notebook, {}).get(cell) for notebook, cell in columns]
            row = [
                assignment,
                grade.student,
                grade.score,
                grade.max_score,
                grade.needs_manual_grade,
            ]
            writer.writerow([*row, *("" if p is None else p for p in points)])


def _config(root: Path) -> Config:
    if not (root / "nbgrader_config.py").is_file():
        raise GradebookError(
            f"There is no nbgrader_config.py in {root}: name the course root with --root, or start "
            "in the folder that `autograder release` was run for."
        )
    loader = PyFileConfigLoader("nbgrader_config.py", path=str(root))
    return Config(loader.load_config())


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep nbgrader's and SQLAlchemy's deprecation chatter off the screen."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield
