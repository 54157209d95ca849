"""Grades as the gradebooks of learning platforms import them.

Canvas (its importer's own rules): the first columns are Student, ID, SIS User ID, SIS Login ID and
Section, the row "Points Possible" comes first, a student is found by ID, then by SIS User ID, then
by SIS Login ID, and an empty cell is no score: it *deletes* one that is there. Moodle (Grades,
Import, CSV file): any columns, mapped by hand, one of which identifies the user; an empty cell is
no grade here, too, and one row of a user it does not know makes it refuse the whole file.

So both files have everybody whom nbgrader's gradebook knows, and nobody else, and a cell stays
empty as long as there is no final grade. A student who has handed in nothing has no grade either:
that it counts as 0 is a rule of the course, which Canvas (its policy for missing submissions) and
Moodle ("exclude empty grades") each apply by themselves, and an illness or an extension is known to
neither of us. A course in which it is a 0 asks for it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from autograder.class_report.class_data import ClassData, Person
from autograder.gradebook.course_gradebook import Grade
from autograder.util.csv_text import as_csv, guard_text, is_formula

CANVAS_COLUMNS = ("Student", "ID", "SIS User ID", "SIS Login ID", "Section")
POINTS_POSSIBLE = "    Points Possible"
MOODLE_COLUMNS = ("Username", "ID number", "First name", "Last name", "Email address")


@dataclass(frozen=True)
class Export:
    """One file: its text, how many students have points in it, and whose cell is empty, and why.

    ``waiting`` are those whose grades are not complete, ``absent`` those who handed in nothing;
    ``guarded`` are ids that were written with an apostrophe in front (see `guard_text`).
    """

    text: str
    students: int
    waiting: tuple[str, ...]
    absent: tuple[str, ...]
    guarded: tuple[str, ...]


def export_canvas(
    data: ClassData, column: str = "", *, provisional: bool = False, zero_absent: bool = False
) -> Export:
    """Return the grades for the import of Canvas's gradebook.

    Args:
        data: the class.
        column: the assignment's name in Canvas, with its id, as in "Exercise 1 (4711)", if it is
            there already; the name in nbgrader if left out. Canvas makes a new one of an unknown.
        provisional: also export grades that still wait for a person, unless they are asked what
            was handed in at all.
        zero_absent: write 0 for those who have handed in nothing.
    """
    rows: list[Sequence[str]] = [
        (*CANVAS_COLUMNS, _column_header(data, column)),
        (POINTS_POSSIBLE, "", "", "", "", f"{data.max_score:g}"),
    ]
    points = _point_texts(data, provisional, zero_absent)
    for person in _known_people(data):
        cells = (_sortable_name(person), person.lms_user_id, "", person.student, "")
        rows.append((*map(guard_text, cells), points[person.student]))
    return _make_export(data, rows, points)


def export_moodle(
    data: ClassData, column: str = "", *, provisional: bool = False, zero_absent: bool = False
) -> Export:
    """Return the grades for Moodle's import of a CSV file, in points.

    The arguments are as in `export_canvas`.
    """
    rows: list[Sequence[str]] = [(*MOODLE_COLUMNS, _column_header(data, column))]
    points = _point_texts(data, provisional, zero_absent)
    for person in _known_people(data):
        cells = (
            person.student,
            person.lms_user_id,
            person.first_name,
            person.last_name,
            person.email,
        )
        rows.append((*map(guard_text, cells), points[person.student]))
    return _make_export(data, rows, points)


def _make_export(data: ClassData, rows: list[Sequence[str]], points: Mapping[str, str]) -> Export:
    empty = [student for student, shown in points.items() if not shown]
    absent = set(data.absent)
    return Export(
        as_csv(rows), len(points) - len(empty), tuple(s for s in empty if s not in absent),
        tuple(s for s in empty if s in absent), tuple(s for s in points if is_formula(s)),
    )  # fmt: skip


def _known_people(data: ClassData) -> list[Person]:
    """Return the students in the gradebook: nobody else is a participant anywhere."""
    graded = {grade.student: Person(grade.student) for grade in data.grades}
    return [person for _, person in sorted({**graded, **data.people}.items())]


def _point_texts(data: ClassData, provisional: bool, zero_absent: bool) -> dict[str, str]:
    """Return {student: what stands in the cell}, for everybody."""
    shown = {
        grade.student: f"{round(grade.score, 2):g}"
        for grade in data.grades
        if _is_exported(grade, provisional)
    }
    if zero_absent:
        shown |= dict.fromkeys(data.absent, "0")
    return {person.student: shown.get(person.student, "") for person in _known_people(data)}


def _is_exported(grade: Grade, provisional: bool) -> bool:
    """Whether a grade is passed on; never while it is not clear what was handed in."""
    return not grade.asked and (provisional or not _is_waiting(grade))


def _is_waiting(grade: Grade) -> bool:
    cells = (points for notebook in grade.cells.values() for points in notebook.values())
    return grade.needs_manual_grade or any(points is None for points in cells)


def _sortable_name(person: Person) -> str:
    names = [name for name in (person.last_name, person.first_name) if name]
    return ", ".join(names) or person.student


def _column_header(data: ClassData, column: str) -> str:
    return guard_text(column or data.assignment)
