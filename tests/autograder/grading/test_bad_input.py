"""Whatever is wrong around a class is one clear sentence, and nothing is lost."""

from __future__ import annotations

import os
import re
import resource
import shutil
import sqlite3
import subprocess
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from nbgrader.api import Gradebook

from autograder.assignments import submission
from autograder.assignments.intake import roster
from autograder.assignments.intake.handed_files import folder_digest
from autograder.class_report.platforms import grades_csv
from autograder.gradebook import course_gradebook
from autograder.gradebook import database as words
from autograder.gradebook.course_gradebook import CourseGradebook, Grade, GradebookError
from autograder.gradebook.database import (
    DiskFullError,
    GradebookLockedError,
    GradebookUnusable,
    OldGradebookError,
)
from autograder.grading import engine
from autograder.grading.engine import AssignmentError, Graded
from autograder.grading.run_progress import RunProgress
from tests.autograder.conftest import ASSIGNMENT, NOTEBOOK, Course, Undisturbed
from tests.killing import STATE, copy_outcomes, fresh_copy
from tests.machine import needs_own_mounts, needs_sandbox

# The class is graded before the first test. nbgrader swallows a time-out that strikes inside it, as
# it does any error, so it must be far off on a busy machine, too.
pytestmark = [needs_sandbox, pytest.mark.xdist_group("class"), pytest.mark.timeout(900)]


@pytest.fixture
def course(class_: Undisturbed, tmp_path: Path) -> Course:
    """A class whose submissions have been run, and not one of them entered."""
    root = fresh_copy(class_.ungraded, tmp_path / "course")
    copy_outcomes(class_.graded, root)
    return Course(root)


def grade(course: Course, progress: RunProgress = engine.QUIET) -> dict[str, Graded]:
    graded = engine.grade(course.root, ASSIGNMENT, feedback=False, progress=progress)
    return {one.student: one for one in graded}


def grades(course: Course) -> dict[str, Grade]:
    return {g.student: g for g in CourseGradebook(course.root).read_grades(ASSIGNMENT)}


def book(course: Course) -> Gradebook:
    return Gradebook(f"sqlite:///{course.root / 'gradebook.db'}")


def database(course: Course) -> sqlite3.Connection:
    return sqlite3.connect(course.root / "gradebook.db", isolation_level=None)


def test_folders_that_are_not_what_they_should_be_stop_nobody(
    course: Course, class_: Undisturbed
) -> None:
    submitted = course.root / "submitted"
    half = course.folder("half-copied")
    (half / f".{NOTEBOOK}.ipynb.x7Gh2k").write_text('{"cells": [')
    (submitted / "a-file").mkdir()
    (submitted / "a-file" / ASSIGNMENT).write_text("not a folder")
    (submitted / "one-up").mkdir()
    shutil.copy(
        course.root / "submitted/right" / ASSIGNMENT / f"{NOTEBOOK}.ipynb", submitted / "one-up"
    )
    for odd in ("tab\there", "q?", "x" * 129):
        course.folder(odd)
    (submitted / ".ipynb_checkpoints" / ASSIGNMENT).mkdir(parents=True)
    (submitted / "notes.txt").write_text("who was ill")

    graded = grade(course)
    found = grades(course)

    says = {
        "a-file": "is no folder",
        "one-up": f"move it to submitted/one-up/{ASSIGNMENT}",
        "tab\there": "characters that nobody can read: rename the folder",
        "q?": "for a pattern: rename the folder",
        "x" * 129: "at most 128 characters",
    }
    for student in (*class_.grades, "half-copied"):
        assert graded[student].entered, graded[student].problem
    for student, problem in says.items():
        assert problem in graded[student].problem
        assert not graded[student].entered
        assert student not in found
    assert "a copy that was interrupted" in graded["half-copied"].problem
    assert found["half-copied"].needs_manual_grade
    assert {student: found[student] for student in class_.grades} == class_.grades
    assert len(graded) == len(class_.grades) + len(says) + 1


def test_why_it_could_not_be_run_stands_where_a_person_grades(course: Course) -> None:
    grade(course)
    copy = submission.read_notebook(
        course.root / "autograded" / "cut-off" / ASSIGNMENT / f"{NOTEBOOK}.ipynb"
    )
    shown = [
        output["data"]["text/plain"]
        for cell in copy.cells
        if submission.grade_id(cell) == "qos-visible"
        for output in cell.outputs
    ]
    assert "not valid JSON" in shown[0]


def test_nobody_is_graded_who_is_not_in_the_class(course: Course, class_: Undisturbed) -> None:
    with book(course) as people:
        for student in ("right", "same", "cut-off"):
            people.add_student(student, last_name=student.title())
        people.add_student("wrongly", email="w@example.org")
    graded = grade(course)
    assert "no student 'wrong' (is it 'wrongly'?)" in graded["wrong"].problem
    assert "nbgrader db student add wrong" in graded["wrong"].problem
    assert set(grades(course)) == {"right", "same", "cut-off"}
    with book(course) as people:
        people.add_student("wrong")
    grade(course)
    assert grades(course) == class_.grades


class LocksTheGradebook(RunProgress):
    """Another program that takes the gradebook while the engine is at work."""

    def __init__(self, connection: sqlite3.Connection) -> None:
        self._connection = connection

    def begin(self, submissions: int, notebooks: int, unchanged: int) -> None:
        self._connection.execute("BEGIN EXCLUSIVE")


def test_a_locked_gradebook_is_one_sentence(
    course: Course, class_: Undisturbed, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(course_gradebook, "LOCK_PATIENCE_S", 0.0)
    with closing(database(course)) as other:
        with pytest.raises(GradebookLockedError, match="Another program holds the gradebook"):
            grade(course, LocksTheGradebook(other))
        with pytest.raises(GradebookLockedError, match="Another program holds the gradebook"):
            grade(course)
        other.execute("ROLLBACK")
    grade(course)
    assert grades(course) == class_.grades


@pytest.mark.parametrize(
    "change",
    ["UPDATE alembic_version SET version_num = '167914646830'", "DROP TABLE alembic_version"],
)
def test_an_older_gradebook_says_how_to_upgrade_it(course: Course, change: str) -> None:
    with closing(database(course)) as older:
        older.execute(change)
    before = (course.root / "gradebook.db").read_bytes()
    with pytest.raises(OldGradebookError, match="run `nbgrader db upgrade`"):
        grade(course)
    assert (course.root / "gradebook.db").read_bytes() == before


def test_a_gradebook_that_is_none_says_so(course: Course) -> None:
    (course.root / "gradebook.db").write_text("this is no database, but a long enough text" * 99)
    with pytest.raises(GradebookUnusable, match="is damaged"):
        grade(course)


FULL = """
set -e
mount -t tmpfs -o size=64m none "$1"
cp -r "$2/." "$1"
rest=$(( $(stat -f -c '%a * %S' "$1") ))
head -c $(( rest - 200000 )) /dev/zero > "$1/ballast"
set +e
autograder grade {assignment} --root "$1" 2>"$3/said"
echo $? > "$3/code"
rm "$1/ballast"
autograder grade {assignment} --root "$1" 2>"$3/said-later"
echo $? > "$3/code-later"
cp -r "$1/gradebook.db" "$1/nbgrader_config.py" "$1/.autograder" "$3"
"""


def test_a_disk_that_fills_up_in_the_middle_is_one_sentence(
    course: Course, class_: Undisturbed, tmp_path: Path
) -> None:
    disk, result = tmp_path / "disk", tmp_path / "result"
    disk.mkdir()
    result.mkdir()
    script = FULL.format(assignment=ASSIGNMENT)
    done = subprocess.run(
        ["unshare", "-rm", "bash", "-c", script, "bash", disk, course.root, result],
        env={**os.environ, "TMPDIR": str(tmp_path)}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    said = (result / "said").read_text()
    assert (result / "code").read_text() == "1\n", said
    assert "make room there" in said
    assert len(said.strip().splitlines()) == 1
    assert ((result / "code-later").read_text(), (result / "said-later").read_text()) == ("0\n", "")
    assert grades(Course(result)) == class_.grades


SHORT = """
set -e
{shortage}
set +e
autograder grade {assignment} --root "$1" 2>"$1/said"
echo $? > "$1/code"
"""


@needs_own_mounts
@pytest.mark.parametrize(
    ("shortage", "sentence"),
    [
        ('mount -t tmpfs -o nr_inodes=2 none "$TMPDIR"', "make room"),
        ('mount -t tmpfs -o nr_inodes=3 none "$TMPDIR"', "make room"),
        ("ulimit -n 48", "could not be started|cannot be sandboxed"),
    ],
)
def test_what_the_machine_is_short_of_costs_no_student_a_grade(
    course: Course, class_: Undisturbed, tmp_path: Path, shortage: str, sentence: str
) -> None:
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    (course.root / STATE).unlink()
    script = SHORT.format(assignment=ASSIGNMENT, shortage=shortage)
    done = subprocess.run(
        ["unshare", "-rm", "bash", "-c", script, "bash", course.root],
        env={**os.environ, "TMPDIR": str(scratch)}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    said = (course.root / "said").read_text()
    assert (course.root / "code").read_text() == "1\n", said
    assert re.search(sentence, said), said
    assert len(said.strip().splitlines()) == 1, said
    copy_outcomes(class_.graded, course.root)
    grade(course)
    assert grades(course) == class_.grades


def test_every_full_disk_is_recognised() -> None:
    for said in (
        "database or disk is full",
        "[Errno 28] No space left on device",
        "Disk quota exceeded",
    ):
        assert isinstance(words.unusable_error(said, Path("/c")), DiskFullError)
    assert words.unusable_error("InvalidEntry: no such thing", Path("/c")) is None


def test_a_disk_is_full_only_if_there_is_no_room(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said = "ValidationError: No space left on device"
    assert words.disk_full_error(said, Path("/c"), [tmp_path, tmp_path]) is None
    assert list(tmp_path.iterdir()) == []
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (words.MIN_FREE_BYTES - 1, limits[1]))
    try:
        assert isinstance(words.disk_full_error(said, Path("/c"), [tmp_path]), DiskFullError)
        assert words.disk_full_error("ValidationError: no", Path("/c"), [tmp_path]) is None
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)


def named(function: Callable[..., Any]) -> Callable[..., Any]:
    function.__name__ = "autograde"
    return function


@pytest.mark.parametrize("said", ["No space left on device", "database is locked"])
def test_what_a_student_writes_into_nbgraders_log_is_about_that_student_only(
    course: Course, monkeypatch: pytest.MonkeyPatch, said: str
) -> None:
    book = CourseGradebook(course.root)
    log = f"[ERROR] Traceback ...\nValidationError: On instance: {{'cell_type': '{said}'}}\n"
    answer = {"success": False, "log": log, "error": "NbGraderException: See the above traceback"}
    monkeypatch.setattr(book._api, "autograde", named(lambda *_, **__: answer))
    started = time.monotonic()
    with pytest.raises(GradebookError, match=r"ValidationError: On instance"):
        book.autograde(ASSIGNMENT, "forger")
    assert time.monotonic() - started < course_gradebook.LOCK_PATIENCE_S


def test_whatever_goes_wrong_with_one_submission_stops_nobody(
    course: Course, class_: Undisturbed, monkeypatch: pytest.MonkeyPatch
) -> None:
    for student in ("looked-at", "staged", "entered"):
        shutil.copytree(course.root / "submitted" / "right", course.root / "submitted" / student)
    of_folder, remarks = folder_digest.of_folder, roster.remarks
    autograde = CourseGradebook.autograde
    refused: list[str] = []

    def fails_to_look(folder: Path) -> str:
        if "looked-at" in folder.parts:
            raise RecursionError("too deep")
        return of_folder(folder)

    def fails_to_stage(folder: Path, zone: str = "") -> list[str]:
        if "staged" in folder.parts:
            raise UnicodeError("no text")
        return remarks(folder, zone)

    def fails_to_enter(self: CourseGradebook, assignment: str, student: str) -> None:
        if student == "entered" and not refused:
            refused.append(student)
            raise GradebookError("nbgrader cannot.")
        autograde(self, assignment, student)

    monkeypatch.setattr(folder_digest, "of_folder", fails_to_look)
    monkeypatch.setattr(roster, "remarks", fails_to_stage)
    monkeypatch.setattr(CourseGradebook, "autograde", fails_to_enter)
    graded = grade(course)
    found = grades(course)

    reasons = {
        "looked-at": "(RecursionError: too deep): a person has to look at it",
        "staged": "(UnicodeError: no text): a person has to look at it",
        "entered": "nbgrader cannot.",
    }
    for student, reason in reasons.items():
        assert graded[student].entered
        assert reason in graded[student].problem
        assert graded[student].points == found[student].score == 0
        assert found[student].needs_manual_grade
        copy = course.root / "autograded" / student / ASSIGNMENT / f"{NOTEBOOK}.ipynb"
        assert reason in copy.read_text(), "a person sees it there, and the student in the feedback"
    assert {student: found[student] for student in class_.grades} == class_.grades

    monkeypatch.undo()
    later = grade(course)
    assert {later[student].points for student in reasons} == {graded["right"].points}


def test_grades_stand_although_feedback_on_them_cannot_be_written(
    course: Course, class_: Undisturbed, monkeypatch: pytest.MonkeyPatch
) -> None:
    generate = CourseGradebook.generate_feedback

    def fails(self: CourseGradebook, assignment: str, student: str) -> None:
        if student == "right":
            raise GradebookError("nbconvert cannot.")
        generate(self, assignment, student)

    monkeypatch.setattr(CourseGradebook, "generate_feedback", fails)
    graded = {one.student: one for one in engine.grade(course.root, ASSIGNMENT)}
    assert graded["right"].problem == "It is graded, but there is no feedback: nbconvert cannot."
    assert grades(course) == class_.grades
    monkeypatch.undo()
    graded = {one.student: one for one in engine.grade(course.root, ASSIGNMENT)}
    assert graded["right"].problem == ""
    assert (course.root / "feedback" / "right" / ASSIGNMENT / f"{NOTEBOOK}.html").is_file()


def test_who_is_left_out_by_the_configuration_is_left_out(
    course: Course, class_: Undisturbed
) -> None:
    with (course.root / "nbgrader_config.py").open("a") as config:
        config.write("\nc.CourseDirectory.student_id_exclude = 'same,nobody'\n")
    graded = grade(course)
    assert "student_id_exclude" in graded["same"].problem
    rest = {student: one for student, one in class_.grades.items() if student != "same"}
    assert grades(course) == rest


def test_nobody_at_all_is_one_sentence(course: Course) -> None:
    shutil.rmtree(course.root / "submitted")
    with pytest.raises(AssignmentError, match="Nobody has submitted"):
        grade(course)


def test_the_grades_of_every_assignment_are_written(tmp_path: Path) -> None:
    design = Grade("ada", 3.0, 5.0, False, {"design": {"a": 3.0}}, seconds_late=3600.0, penalty=1.5)
    quiz = Grade("ada", 1.0, 2.0, True, {"quiz": {"q": None}})
    grades_csv.write_grades({"ch05": [design], "ch05-quiz": [quiz]}, tmp_path / "grades.csv")
    head, *lines = (tmp_path / "grades.csv").read_text().splitlines()
    late = ",total_seconds_late,late_submission_penalty"
    assert head.endswith(f"needs_manual_grade,design:a,quiz:q{late}")
    assert lines == [
        "ch05,ada,3.0,5.0,False,3.0,,3600.0,1.5",
        "ch05-quiz,ada,1.0,2.0,True,,,0.0,0.0",
    ]


def test_a_spreadsheet_runs_nothing_of_what_a_student_is_called(tmp_path: Path) -> None:
    found = [Grade("=1+1", 3.0, 5.0, False, {"@nb": {"cell": 3.0, "text": None}})]
    grades_csv.write_grades({"-ch05": found}, tmp_path / "grades.csv")
    head, line = (tmp_path / "grades.csv").read_text().splitlines()
    assert head.startswith(
        "assignment,student_id,score,max_score,needs_manual_grade,'@nb:cell,'@nb:text,"
    )
    assert line == "'-ch05,'=1+1,3.0,5.0,False,3.0,,0.0,0.0"
