"""Grades as the gradebooks of learning platforms import them.

Canvas (its importer's own rules): the first columns are Student, ID, SIS User ID, SIS Login ID and
Section, the row "Points Possible" comes first, a student is found by ID, then by SIS User ID, then
by SIS Login ID, and an empty cell *deletes* a score that is there. Moodle (Grades, Import, CSV
file): any columns, mapped by hand, one of which identifies the user; an empty cell deletes a grade,
and one row of a user it does not know makes it refuse the whole file. So neither file has a row for
a student whose grade is not complete.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from autograder.gradebook import Grade
from autograder.insight.collect import ClassData, Person

CANVAS_COLUMNS = ("Student", "ID", "SIS User ID", "SIS Login ID", "Section")
POINTS_POSSIBLE = "    Points Possible"
MOODLE_COLUMNS = ("Username", "ID number", "First name", "Last name", "Email address")

# The full-width forms are taken for their ASCII ones by spreadsheets in some languages.
FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n", "\0", "＝", "＋", "－", "＠")  # noqa: RUF001


@dataclass(frozen=True)
class Export:
    """One file: its text, how many students are in it, and who is left out or written otherwise.

    ``waiting`` are left out, because their grades are not complete; ``guarded`` are ids that were
    written with an apostrophe in front (see `guarded`).
    """

    text: str
    students: int
    waiting: tuple[str, ...]
    guarded: tuple[str, ...]


def canvas(data: ClassData, column: str = "", *, provisional: bool = False) -> Export:
    """Return the grades for the import of Canvas's gradebook.

    Args:
        data: the class.
        column: the assignment's name in Canvas, with its id, as in "Exercise 1 (4711)", if it is
            there already; the name in nbgrader if left out. Canvas makes a new one of an unknown.
        provisional: also export grades that still wait for a person, unless they are asked what
            was handed in at all.
    """
    rows: list[Sequence[str]] = [
        (*CANVAS_COLUMNS, _header(data, column)),
        (POINTS_POSSIBLE, "", "", "", "", f"{data.max_score:g}"),
    ]
    for person, grade in _complete(data, provisional):
        cells = (_sortable(person), person.lms_user_id, "", person.student, "")
        rows.append((*map(guarded, cells), _points(grade)))
    return _export(data, rows, len(rows) - 2, provisional)


def moodle(data: ClassData, column: str = "", *, provisional: bool = False) -> Export:
    """Return the grades for Moodle's import of a CSV file, in points; arguments as in `canvas`."""
    rows: list[Sequence[str]] = [(*MOODLE_COLUMNS, _header(data, column))]
    for person, grade in _complete(data, provisional):
        cells = (
            person.student,
            person.lms_user_id,
            person.first_name,
            person.last_name,
            person.email,
        )
        rows.append((*map(guarded, cells), _points(grade)))
    return _export(data, rows, len(rows) - 1, provisional)


def guarded(text: str) -> str:
    """Return ``text`` with an apostrophe in front if a spreadsheet would run it as a formula.

    See OWASP, "CSV Injection" (CWE-1236).
    """
    return f"'{text}" if is_formula(text) else text


def is_formula(text: str) -> bool:
    """Whether a spreadsheet could take a cell for a formula, blanks in front of it or not."""
    return text.startswith(FORMULA) or text.lstrip().startswith(FORMULA)


def as_csv(rows: Iterable[Sequence[str]]) -> str:
    """Return rows as CSV (RFC 4180)."""
    buffer = io.StringIO()
    csv.writer(buffer, lineterminator="\r\n").writerows(rows)
    return buffer.getvalue()


def _export(data: ClassData, rows: list[Sequence[str]], students: int, provisional: bool) -> Export:
    left_out = tuple(g.student for g in data.grades if not _is_exported(g, provisional))
    shown = (grade.student for grade in data.grades if grade.student not in left_out)
    odd = tuple(student for student in shown if is_formula(student))
    return Export(as_csv(rows), students, left_out, odd)


def _complete(data: ClassData, provisional: bool) -> list[tuple[Person, Grade]]:
    return [
        (data.people.get(grade.student, Person(grade.student)), grade)
        for grade in data.grades
        if _is_exported(grade, provisional)
    ]


def _is_exported(grade: Grade, provisional: bool) -> bool:
    """Whether a grade is passed on; never while it is not clear what was handed in."""
    return not grade.asked and (provisional or not _waits(grade))


def _waits(grade: Grade) -> bool:
    cells = (points for notebook in grade.cells.values() for points in notebook.values())
    return grade.needs_manual_grade or any(points is None for points in cells)


def _sortable(person: Person) -> str:
    names = [name for name in (person.last_name, person.first_name) if name]
    return ", ".join(names) or person.student


def _header(data: ClassData, column: str) -> str:
    return guarded(column or data.assignment)


def _points(grade: Grade) -> str:
    return f"{round(grade.score, 2):g}"
