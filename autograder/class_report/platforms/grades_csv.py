"""``grades.csv``: a line for each grade in the gradebook, for spreadsheets and other programs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from autograder.gradebook.course_gradebook import Grade
from autograder.util.csv_text import as_csv, guard_text
from autograder.util.work_files import write_whole

HEAD = ("assignment", "student_id", "score", "max_score", "needs_manual_grade")
LATE = ("total_seconds_late", "late_submission_penalty")
"""Columns at the end, as nbgrader calls them; the score is less the penalty already."""


def write_grades(grades: Mapping[str, list[Grade]], path: Path) -> None:
    """Write one line a student and assignment; a cell that waits for a manual grade is empty.

    The score is empty, too, while a person is asked what was handed in at all (`Grade.asked`).

    ``grades`` has the grades of each assignment. A text that a spreadsheet would run as a formula
    has an apostrophe in front.

    Raises:
        OSError: it cannot be written; what stood there before still does.
    """
    lines = [(assignment, grade) for assignment, found in grades.items() for grade in found]
    columns = sorted({(n, c) for _, g in lines for n, cells in g.cells.items() for c in cells})
    rows = [[*HEAD, *(guard_text(f"{notebook}:{cell}") for notebook, cell in columns), *LATE]]
    for assignment, grade in lines:
        points = [grade.cells.get(notebook, {}).get(cell) for notebook, cell in columns]
        # What may be zero only because nobody knows yet what was handed in is no number.
        score = "" if grade.asked else grade.score
        found = (score, grade.max_score, grade.needs_manual_grade)
        texts = [guard_text(assignment), guard_text(grade.student), *map(str, found)]
        late = (str(grade.seconds_late), str(grade.penalty))
        rows.append([*texts, *("" if p is None else str(p) for p in points), *late])
    write_whole(path, as_csv(rows))
