"""More time for a student: nbgrader's own extensions, also before there is a submission.

nbgrader keeps an extension with a submission. One for a student who has not handed in yet waits in
the engine's folder until the submission is entered, by whichever command.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path

from nbgrader.api import Gradebook, MissingEntry

from autograder.assignments.intake.roster import Roster
from autograder.gradebook.course_gradebook import CourseGradebook
from autograder.gradebook.waiting_extensions import WaitingExtensions
from course.errors import CourseError
from course.util.close_matches import is_it

MAX_HOURS = 10 * 366 * 24.0
"""Longest extension: with one of some thousand years no date could be reckoned."""


class ExtensionError(CourseError):
    """An extension that cannot be granted; the message says why, and what to do."""


@dataclass(frozen=True)
class Due:
    """When a student's work is due, in UTC; ``waits`` if there is no submission yet."""

    student: str
    time: datetime
    waits: bool


def grant_extensions(root: Path, assignment: str, students: list[str], hours: float) -> list[Due]:
    """Give students so many hours beyond the due date, in place of an earlier extension.

    Args:
        root: the course root.
        assignment: its name.
        students: their ids; nobody has more time unless all of them are known.
        hours: 0 takes an extension away.

    Raises:
        ExtensionError: no such assignment or student, or it is never due.
        GradebookError: there is no course at ``root``.
        GradebookUnusable: its gradebook cannot be used.
    """
    if not 0 <= hours <= MAX_HOURS:
        raise ExtensionError(f"An extension has 0 to {MAX_HOURS:g} hours, not {hours:g}.")
    course = CourseGradebook(root)
    waiting = WaitingExtensions(course.work_folder, assignment)
    known = course.read_roster()
    students = [known.student_id(name) for name in students]
    with course.open_gradebook() as book:
        due = _due_date(book, assignment)
        _require_known(known, course.root, students)
        dues = []
        for student in students:
            try:
                book.grant_extension(assignment, student, hours=hours)
            except MissingEntry:
                waiting.set_hours(student, hours)
                waits = True
            else:
                waiting.set_hours(student, 0)
                waits = False
            dues.append(Due(student, due + timedelta(hours=hours), waits))
    return dues


def _due_date(book: Gradebook, assignment: str) -> datetime:
    try:
        due: datetime | None = book.find_assignment(assignment).duedate
    except MissingEntry:
        known = ", ".join(sorted(a.name for a in book.assignments)) or "none yet"
        raise ExtensionError(
            f"There is no assignment '{assignment}' in the gradebook: there are {known}."
        ) from None
    if due is None:
        raise ExtensionError(
            f"'{assignment}' is never due, so nobody needs more time: set a date with `nbgrader db "
            f'assignment add {assignment} --duedate="2030-01-31 23:59 UTC"` first.'
        )
    return due


def _require_known(known: Roster, root: Path, students: list[str]) -> None:
    folders = root / "submitted"
    handed_in = [path.name for path in folders.iterdir()] if folders.is_dir() else []
    there = {*known.known, *map(known.student_id, handed_in)}
    for student in students:
        if student not in there:
            raise ExtensionError(
                f"The course has no student '{student}'{is_it(student, there)}: add the "
                f"student with `nbgrader db student add {student}`, then run the same command "
                "again."
            )
