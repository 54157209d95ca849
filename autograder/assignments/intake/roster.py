"""Find whose work lies in ``submitted/``, and which folders there are not what they should be."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from autograder.assignments.intake import times
from autograder.assignments.intake.handed_files.file_names import (
    find_entry,
    join_names,
    match_name,
    printable_name,
)
from autograder.assignments.intake.handed_files.handed_in import is_junk
from autograder.assignments.intake.times import UnclearTimeError
from autograder.util.work_files import walk_files
from course.util.close_matches import is_it
from quizzes.attempts.record import read_plain

GLOB = "*?[]"
HTML = '<>"'
MAX_ID_CHARS = 128
"""Characters of a student id in nbgrader's gradebook."""

MAX_TIME_BYTES = 200
"""Bytes of a ``timestamp.txt``; a date has some thirty."""

COPYING = (".part", ".partial", ".filepart", ".crdownload", ".tmp")
"""How copying programs name what they have not finished."""


@dataclass(frozen=True)
class Roster:
    """The students that a gradebook knows.

    Attributes:
        known: their ids.
        closed: nobody else may be graded: they were imported, with names, or the course's
            configuration says that students are not made on the way (``create_student``).
    """

    known: frozenset[str] = frozenset()
    closed: bool = False

    def student_id(self, name: str) -> str:
        """Return the id that a name means, of a folder or as typed: macOS writes letters otherwise.

        Every command takes names by this, so that all of them mean the same student.
        """
        return match_name(name, self.known)


def find_submissions(
    root: Path, assignment: str, roster: Roster, assignments: Collection[str] = ()
) -> tuple[list[str], dict[str, str]]:
    """Return the students whose submissions can be graded, and {folder: what is wrong with it}.

    ``assignments`` are those that the gradebook knows.
    """
    good: dict[str, str] = {}
    wrong = _stray_notebooks(root / "submitted", assignment)
    for folder in _student_folders(root / "submitted"):
        problem = _placement_problem(folder, assignment, assignments)
        if not problem and (folder / assignment).is_dir():
            student = roster.student_id(folder.name)
            problem = _bad_id(folder.name) or _stranger_problem(student, roster)
            if not problem and student in good:
                problem = wrong[good[student]] = (
                    f"There are two folders whose names read '{printable_name(student)}': put what "
                    "the student handed in into one of them, and remove the other."
                )
            elif not problem:
                good[student] = folder.name
        if problem:
            wrong[folder.name] = problem
    return sorted(s for s, name in good.items() if name not in wrong), wrong


def student_folder(root: Path, student: str) -> Path:
    """Return the folder of what a student handed in, in whichever form the name is written."""
    return find_entry(root / "submitted", student)


def remarks(folder: Path, zone: str = "") -> list[str]:
    """Return what a person should know about how a submission's folder looks.

    ``zone`` is the course's own time zone, for the time of submission.
    """
    found = []
    try:
        cut = sorted(path.name for path in folder.iterdir() if _is_partial_copy(path))
    except OSError as error:
        return [
            f"Its folder cannot be read ({error.strerror}): make it readable, then grade again."
        ]
    if cut:
        found.append(
            f"{cut[0]} looks like a copy that was interrupted: copy the submission again, then "
            "grade again."
        )
    file = folder / "timestamp.txt"
    if os.path.lexists(file):
        try:
            _read_time(file, zone)
        except UnclearTimeError as error:
            found.append(
                f"timestamp.txt is not clear: {error}. So the time of submission is unknown, and "
                "nothing is taken off for lateness: write it as in 2026-11-27 20:15 +0100, then "
                "grade again."
            )
        except (OSError, ValueError):
            found.append("timestamp.txt holds no date, so the time of submission is unknown.")
    return found


def read_timestamp(file: Path, zone: str = "") -> str | None:
    """Return a time of submission as nbgrader reads it, or None if there is none that is clear.

    ``zone`` is the course's own time zone (see `times.parse_time`).
    """
    try:
        return times.for_nbgrader(_read_time(file, zone))
    except (OSError, ValueError):
        return None


def _read_time(file: Path, zone: str) -> datetime:
    content = read_plain(file, MAX_TIME_BYTES + 1)
    if len(content) > MAX_TIME_BYTES:
        raise ValueError("too long")
    return times.parse_time(content.decode("utf-8-sig").strip(), zone)


def of_people(people: Mapping[str, bool], create: bool) -> Roster:
    """Return the roster that a gradebook's students make.

    Args:
        people: {student id: whether a name or an address is known}.
        create: whether nbgrader may make students that it does not know.
    """
    return Roster(frozenset(people), not create or any(people.values()))


def _student_folders(submitted: Path) -> Iterator[Path]:
    if submitted.is_dir():
        yield from sorted(
            path for path in submitted.iterdir() if path.is_dir() and not is_junk(path.name)
        )


def _stray_notebooks(submitted: Path, assignment: str) -> dict[str, str]:
    """Return what is wrong with notebooks that lie in no student's folder, by their names."""
    return {
        path.name: f"submitted/{printable_name(path.name)} is in no student's folder: move it to "
        f"submitted/STUDENT/{assignment} if somebody handed it in, or out of submitted if not; "
        "then grade again."
        for path in (sorted(submitted.glob("*.ipynb")) if submitted.is_dir() else [])
        if path.is_file()
    }


def _placement_problem(folder: Path, assignment: str, assignments: Collection[str] = ()) -> str:
    """Return what is wrong if a student's work is not where nbgrader looks for it.

    ``assignments`` are those that the gradebook knows: what lies in their folders is theirs.
    """
    place = folder / assignment
    if place.is_dir():
        return _link_problem(folder, place)
    there = f"submitted/{printable_name(folder.name)}"
    if place.exists() or place.is_symlink():
        return f"{there}/{assignment} is no folder: put the submission's files in one."
    if names := unclaimed_names(folder, assignments):
        verb, them = ("is", "it") if len(names) == 1 else ("are", "them")
        return (
            f"There is no {there}/{assignment}, but there {verb} {join_names(names)} in {there}: "
            f"move {them} to {there}/{assignment} if that is this assignment's work, or out of "
            f"{there} if not; then grade again."
        )
    return ""


def unclaimed_names(folder: Path, assignments: Collection[str] = ()) -> list[str]:
    """Return what lies in a student's folder and is no assignment's.

    ``assignments`` are those that the gradebook knows; others have a source or a release.
    """
    root = folder.parents[1]
    known = {*assignments}
    for step in ("source", "release"):
        known |= {path.name for path in (root / step).glob("*")}
    try:
        there = sorted(folder.iterdir())
    except OSError:
        return []
    return [
        path.name for path in there
        if path.name not in known and not is_junk(path.name)
        and (not path.is_dir() or walk_files(path))
    ]  # fmt: skip


def _link_problem(folder: Path, place: Path) -> str:
    """Return what is wrong if a link leads from a student's folder to what others handed in.

    That all of ``submitted`` or a student's folder is a link to another disk, say, is an
    instructor's choice.
    """
    home, others = folder.resolve(), folder.parent.resolve()
    if folder.is_symlink() and home.is_relative_to(others):
        return (
            f"submitted/{folder.name} is a link to what another student handed in: put the "
            "submission's own files there, then grade again."
        )
    if not place.resolve().is_relative_to(home):
        return (
            f"submitted/{folder.name}/{place.name} is a link that leads out of the student's own "
            "folder: put the submission's own files there, then grade again."
        )
    return ""


def _bad_id(student: str) -> str:
    if set(student) & set(GLOB):
        return (
            f"nbgrader takes one of the characters {' '.join(GLOB)} in the folder name '{student}' "
            "for a pattern: rename the folder."
        )
    if set(student) & set(HTML):
        return (
            f"nbgrader's pages take one of the characters {' '.join(HTML)} in the folder name "
            f"'{student}' for HTML: rename the folder."
        )
    if not student.isprintable():
        return (
            f"The folder name {student!a} has characters that nobody can read: rename the folder."
        )
    if len(student) > MAX_ID_CHARS:
        return (
            f"A student id has at most {MAX_ID_CHARS} characters in the gradebook, and this "
            f"folder's name {len(student)}: rename the folder."
        )
    return ""


def _stranger_problem(student: str, roster: Roster) -> str:
    if not roster.closed or student in roster.known:
        return ""
    return (
        f"The course has no student '{student}'{is_it(student, roster.known)}: rename the folder, "
        f"or add the student with `nbgrader db student add {student}`, then grade again."
    )


def _is_partial_copy(path: Path) -> bool:
    # rsync writes `.name.ipynb.a1B2c3` beside what is to become `name.ipynb`.
    hidden = path.name.startswith(".") and ".ipynb." in path.name
    return hidden or path.name.endswith(COPYING)
