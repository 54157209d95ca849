"""The class report: what is in it, and the files that it is written to."""

from __future__ import annotations

import statistics
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from nbformat import NotebookNode

from autograder import submission
from autograder.beside import files_beside
from autograder.gradebook import CourseGradebook
from autograder.insight import InsightError, exports, feedback, figures, needs, similarity
from autograder.insight.collect import ClassData, collect
from autograder.insight.exports import Export
from autograder.insight.own_text import GivenText, OwnText
from autograder.submission import SubmissionError

PAGE, CANVAS, MOODLE = "class-report.html", "canvas.csv", "moodle.csv"


@dataclass(frozen=True)
class ClassReport:
    """Everything that the page shows.

    ``texts`` is {student: what they wrote}, ``given`` the assignment's own code, ``threshold`` the
    similarity from which pairs are shown, ``notes`` says what is left out.
    """

    data: ClassData
    checks: tuple[figures.CheckFigures, ...]
    times: figures.Times
    feedback: list[feedback.Group]
    needs: list[needs.Need]
    likeness: similarity.Likeness
    texts: Mapping[str, OwnText]
    given: GivenText
    threshold: float
    notes: tuple[str, ...]

    @property
    def examined(self) -> int:
        """How many submissions some check was run on."""
        return len(self.times.seconds)

    @property
    def median(self) -> float:
        """The median score in points."""
        return statistics.median(grade.score for grade in self.data.grades)

    @property
    def mean(self) -> float:
        """The mean score in points."""
        return statistics.fmean(grade.score for grade in self.data.grades)

    def as_data(self) -> dict[str, Any]:
        """Return the report for machines."""
        return {
            "checks": [vars(check) for check in self.checks],
            "seconds": self.times.seconds,
            "feedback": [vars(group) for group in self.feedback],
            "needs_person": [vars(need) for need in self.needs],
            "alike": [vars(pair) for pair in self.likeness.pairs],
            "notes": list(self.notes),
        }


def make(root: Path, assignment: str, threshold: float = similarity.THRESHOLD) -> ClassReport:
    """Make the report of an assignment from the gradebook, the records and the submissions.

    Raises:
        InsightError: no such assignment, or nothing of it has been graded yet.
        GradebookError: ``root`` is no course.
    """
    data = collect(root, assignment)
    given = GivenText(_released(data))
    texts, notes = _texts(data, given)
    return ClassReport(
        data, figures.checks(data), figures.times(data), feedback.common(data),
        needs.people_needed(data), similarity.alike(texts, given, threshold), texts, given,
        threshold, (*data.notes, *notes),
    )  # fmt: skip


def write(report: ClassReport, column: str = "", *, provisional: bool = False) -> list[Path]:
    """Write the page and both exports into ``reports/ASSIGNMENT``; return the files.

    Raises:
        InsightError: the folder cannot be written.
    """
    from autograder.insight import page  # plots take a moment to import

    folder = report.data.root / "reports" / report.data.assignment
    contents = {
        PAGE: page.page(report),
        CANVAS: exports.canvas(report.data, column, provisional=provisional).text,
        MOODLE: exports.moodle(report.data, column, provisional=provisional).text,
    }
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, content in contents.items():
            # A lone surrogate (a folder name that is no UTF-8) must not cost the others' grades.
            encoded = content.encode("utf-8", "backslashreplace")
            (folder / name).write_bytes(encoded)
    except OSError as error:
        raise InsightError(
            f"The report cannot be written in {folder} ({error.strerror or error}): make room "
            "there, or make the folder writable, and run the same command again."
        ) from None
    return [folder / name for name in contents]


def export_remarks(export: Export) -> list[str]:
    """Return what an instructor has to know before importing the files, as sentences."""
    remarks = []
    if export.waiting:
        number = len(export.waiting)
        remarks.append(
            f"The exports hold {export.students} of {export.students + number} students: the "
            f"{'grade' if number == 1 else 'grades'} of the other {number} still "
            f"{'waits' if number == 1 else 'wait'} for a person (--provisional takes them in)."
        )
    if export.guarded:
        remarks.append(
            "These ids could run as a formula in a spreadsheet and were written with an apostrophe "
            f"in front, so match them by hand: {', '.join(export.guarded[:20])}."
        )
    return remarks


def _released(data: ClassData) -> dict[str, NotebookNode]:
    coursedir = CourseGradebook(data.root).coursedir
    folder = Path(coursedir.format_path(coursedir.release_directory, ".", data.assignment))
    released = {}
    for path in sorted(folder.glob("*.ipynb")):
        try:
            released[path.stem] = submission.read(path)
        except SubmissionError as error:
            raise InsightError(
                f"{error} It lies in {folder}: run `autograder release {data.assignment}` again."
            ) from None
    return released


def _texts(data: ClassData, given: GivenText) -> tuple[dict[str, OwnText], list[str]]:
    names = sorted({name for grade in data.grades for name in grade.cells})
    texts: dict[str, OwnText] = {}
    unread = []
    for grade in data.grades:
        folder = data.root / "submitted" / grade.student / data.assignment
        notebooks = {}
        for name in names:
            try:
                notebooks[name] = submission.read(folder / f"{name}.ipynb")
            except SubmissionError:
                continue  # "what needs a person" names it, and why it cannot be read
        if notebooks:
            texts[grade.student] = given.own(notebooks, files_beside(folder).files)
        else:
            unread.append(grade.student)
    if not unread:
        return texts, []
    more = f" and {len(unread) - 10} more" if len(unread) > 10 else ""
    note = f"Not compared, because no notebook can be read: {', '.join(unread[:10])}{more}."
    return texts, [note]
