"""Submissions under other names, or without metadata, on their way into the gradebook."""

from __future__ import annotations

import csv
import io
import shutil
import unicodedata
import zipfile
from datetime import datetime
from functools import partial
from pathlib import Path

import nbformat
import pytest
from nbformat import NotebookNode
from nbgrader.api import Gradebook
from typer.testing import CliRunner

from autograder import cli
from autograder.assignments import submission
from autograder.assignments.build_notebooks import build
from autograder.class_report import attention
from autograder.class_report.class_data import collect_class
from autograder.class_report.platforms import exports, grades_csv
from autograder.commands import quiz_report
from autograder.corpus import Case
from autograder.gradebook.course_gradebook import CourseGradebook, Grade
from autograder.gradebook.nbgrader_plugins.autograde_steps import NotReadyError
from autograder.gradebook.release import make_release
from autograder.grading import engine
from course.workspace.content import content_root, copy_authoring
from tests.autograder.conftest import ASSIGNMENT, NOTEBOOK, Course
from tests.autograder.gradebook import test_quiz_marks as quiz
from tests.autograder.grading.test_grading import nbgrader
from tests.machine import needs_sandbox

pytestmark = [needs_sandbox, pytest.mark.timeout(900)]

ANSWER = "Nobody, as all of them are best effort, and a lost reading is replaced by the next."
MUELLER = unicodedata.normalize("NFC", "Müller")


def put(course: Course, student: str, place: str, notebook: NotebookNode) -> None:
    path = course.folder(student) / place
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(nbformat.writes(notebook))


def stripped(notebook: NotebookNode) -> NotebookNode:
    """Return it as Colab, or a copy into a new notebook, would leave it."""
    for number, cell in enumerate(notebook.cells):
        cell.metadata = nbformat.from_dict({})
        cell.id = f"cell-{number}"
    return notebook


def answered(notebook: NotebookNode) -> NotebookNode:
    for cell in notebook.cells:
        if submission.grade_id(cell) == "qos-explanation-loss":
            cell.source = ANSWER
    return notebook


def grade(course: Course, assignment: str = ASSIGNMENT) -> tuple[dict[str, Grade], dict[str, str]]:
    problems = {g.student: g.problem for g in engine.grade(course.root, assignment, feedback=False)}
    found = CourseGradebook(course.root).read_grades(assignment)
    return {one.student: one for one in found}, problems


def scores(course: Course, assignment: str = ASSIGNMENT) -> dict[str, str]:
    """Return {student: score} of grades.csv."""
    gradebook = CourseGradebook(course.root)
    grades_csv.write_grades(
        {assignment: gradebook.read_grades(assignment)}, course.root / "grades.csv"
    )
    rows = csv.DictReader(io.StringIO((course.root / "grades.csv").read_text()))
    return {row["student_id"]: row["score"] for row in rows}


def exported(course: Course, assignment: str = ASSIGNMENT) -> tuple[set[str], set[str]]:
    """Return who has a number in the files for Canvas and Moodle, be it one that may change."""
    data = collect_class(course.root, assignment)
    texts = [
        export(data, provisional=True).text
        for export in (exports.export_canvas, exports.export_moodle)
    ]
    students = {grade.student for grade in data.grades}
    tables = [list(csv.reader(io.StringIO(text))) for text in texts]
    canvas, moodle = (
        {s for row in table if row[-1] for s in students if s in row} for table in tables
    )
    return canvas, moodle


def by_nbgrader(course: Course) -> dict[str, str]:
    """Return {student: score} of the file that ``nbgrader export`` writes."""
    done = nbgrader(course, "export", "--to", "by-nbgrader.csv")
    assert done.returncode == 0, done.stderr
    rows = csv.DictReader(io.StringIO((course.root / "by-nbgrader.csv").read_text()))
    return {row["student_id"]: row["score"] for row in rows}


def claim(course: Course, *arguments: str, assignment: str = ASSIGNMENT) -> str:
    done = CliRunner().invoke(
        cli.app, ["claim", assignment, *arguments, "--root", str(course.root)]
    )
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        return str(done.exception)
    return done.output


def test_a_score_is_never_zero_because_of_a_name_or_lost_metadata(
    course: Course, cases: dict[str, Case]
) -> None:
    right = partial(cases["right-chapter"].make_submission, course.source, course.released)
    wrong = partial(cases["wrong-imu-single"].make_submission, course.source, course.released)
    put(course, "renamed", f"{NOTEBOOK} (1).ipynb", right())
    put(course, "stripped", f"{NOTEBOOK}.ipynb", stripped(answered(right())))
    put(course, unicodedata.normalize("NFD", MUELLER), f"{ASSIGNMENT}/{NOTEBOOK}.ipynb", right())
    put(course, "two", "a.ipynb", right())
    put(course, "two", "b\n[/red].ipynb", wrong())
    lost = stripped(right())
    lost.cells = [c for c in lost.cells if "camera_qos" not in c.source]
    lost.cells.append(nbformat.v4.new_code_cell("profile = my_profile()"))
    put(course, "lost", f"{NOTEBOOK}.ipynb", lost)
    (course.folder("document") / "report.pdf").write_bytes(b"%PDF")
    course.submit("damaged", '{"cells": [')
    with zipfile.ZipFile(course.folder("zipped") / "hand-in.zip", "w") as archive:
        archive.writestr("ch05/my work.ipynb", nbformat.writes(right()))

    found, problems = grade(course)

    for student in ("renamed", "stripped", MUELLER, "zipped"):
        assert found[student].score == 15, problems[student]
        assert found[student].asked == {}
    assert f"'{NOTEBOOK} (1).ipynb' holds its cells" in problems["renamed"]
    answer = found["stripped"].cells[NOTEBOOK]["qos-explanation-loss"]
    assert answer is None, "it waits for a person"
    asked = {"two", "lost", "document"}
    for student in asked:
        assert found[student].needs_manual_grade
        assert NOTEBOOK in found[student].asked
        assert f"autograder claim {ASSIGNMENT} {student} {NOTEBOOK}" in problems[student]
        assert problems[student].isprintable()
    assert "'b\\n[/red].ipynb'" in problems["two"]
    assert "damaged" in found["damaged"].asked[NOTEBOOK], "it cannot be read"
    asked.add("damaged")
    written = scores(course)
    assert {student for student, score in written.items() if not score} == asked
    assert exported(course) == (set(found) - asked,) * 2
    urgent = {s for need in attention.people_needed(collect_class(course.root, ASSIGNMENT))
              if need.urgent for s in need.students}  # fmt: skip
    assert asked <= urgent
    table = CliRunner().invoke(cli.app, ["grade", ASSIGNMENT, "--root", str(course.root)])
    assert "? of 20" in table.output

    assert "there is 'a.ipynb' and 'b\\n[/red].ipynb'" in claim(course, "two", NOTEBOOK, "c.ipynb")
    assert "is 'b\\n[/red].ipynb'" in claim(course, "two", NOTEBOOK, "b\\n[/red].ipynb")
    assert "was not handed in" in claim(course, "document", NOTEBOOK, "--nothing")
    found, problems = grade(course)
    assert found["two"].cells[NOTEBOOK]["qos-hidden"] == 3.0
    assert found["document"].score == 0
    assert not found["document"].needs_manual_grade
    assert {**found["two"].asked, **found["document"].asked} == {}
    assert scores(course)["document"] == "0.0"
    assert (course.folder("two") / "a.ipynb").is_file()

    with Gradebook(f"sqlite:///{course.root / 'gradebook.db'}") as book:
        for name, points in {"qos-visible": 3.0, "qos-hidden": 1.0}.items():
            entry = book.find_grade(name, NOTEBOOK, ASSIGNMENT, "lost")
            entry.manual_score, entry.needs_manual_grade = points, False
        book.db.commit()
    assert CourseGradebook(course.root).read_grades(ASSIGNMENT)
    settled = {g.student: g for g in CourseGradebook(course.root).read_grades(ASSIGNMENT)}["lost"]
    assert (settled.asked, settled.score) == ({}, 4.0)


@pytest.fixture
def quiz_course(tmp_path: Path) -> Course:
    root = copy_authoring(content_root(), tmp_path / "course")
    build(root)
    make_release(root, quiz.ASSIGNMENT)
    return Course(root)


def hand_in_attempts(course: Course, student: str, files: dict[str, int], login: str = "") -> None:
    """Hand the quiz in, with an attempts file of each name and so many right answers."""
    folder = course.root / "submitted" / student / quiz.ASSIGNMENT
    folder.mkdir(parents=True)
    shutil.copy(course.root / "release" / quiz.ASSIGNMENT / f"{quiz.NOTEBOOK}.ipynb", folder)
    for number, (name, right) in enumerate(files.items()):
        made = course.root / "made" / student / str(number)
        made.mkdir(parents=True)
        quiz.take(made, login or student, right)
        (made / quiz.FILE).rename(folder / name)


def test_a_quiz_waits_until_a_person_has_said_which_attempts_count(quiz_course: Course) -> None:
    course, assignment, other = quiz_course, quiz.ASSIGNMENT, "quiz-ch05.attempts (1).jsonl"
    with Gradebook(f"sqlite:///{course.root / 'gradebook.db'}") as book:
        book.add_student("bob")  # is in the class, and has handed in nothing
    hand_in_attempts(course, "renamed", {"answers.json": 5})
    hand_in_attempts(course, "two", {"a.txt": 2, "b.txt": 5})
    hand_in_attempts(course, "poorer", {quiz.FILE: 1, other: 5})
    hand_in_attempts(course, "borrowed", {quiz.FILE: 5}, login="bob")
    hand_in_attempts(course, "picture", {})
    (course.root / "submitted" / "picture" / assignment / "screen.png").write_bytes(b"PNG")
    hand_in_attempts(course, "nothing", {})

    found, problems = grade(course, assignment)

    asked = {"two", "poorer", "borrowed", "picture"}
    assert (found["renamed"].score, found["nothing"].score) == (5.0, 0.0)
    assert {student for student, one in found.items() if one.needs_manual_grade} == asked
    assert {student for student, one in found.items() if one.asked} == asked
    for student in asked:
        assert found[student].cells[quiz.NOTEBOOK][quiz.CELL] is None
        assert f"`autograder claim {assignment} {student} {quiz.CELL} " in problems[student]
    assert {student for student, score in scores(course, assignment).items() if not score} == asked
    assert exported(course, assignment) == (set(found) - asked,) * 2
    hand_in_attempts(course, "up", {quiz.FILE: 5})
    folder = course.root / "submitted" / "up"
    (folder / assignment).rename(folder / "Ch05-Quiz")
    with Gradebook(f"sqlite:///{course.root / 'gradebook.db'}") as book:
        book.add_student("up")
    assert by_nbgrader(course) == {"renamed": "5.0", "nothing": "0.0", "bob": "0.0"}

    claims = {"two": "b.txt", "poorer": other, "borrowed": quiz.FILE, "picture": "--nothing"}
    for student, file in claims.items():
        claim(course, student, quiz.CELL, file, assignment=assignment)
    found, problems = grade(course, assignment)
    assert {student: one.score for student, one in found.items()} == {
        **dict.fromkeys(found, 5.0), "nothing": 0.0, "picture": 0.0,
    }  # fmt: skip
    assert not any(one.needs_manual_grade or one.asked for one in found.values())
    assert exported(course, assignment) == (set(found),) * 2
    assert by_nbgrader(course) == {**{s: str(one.score) for s, one in found.items()}, "bob": "0.0"}


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("nobody", NOTEBOOK, "a.ipynb"), "has handed in for 'ch05'"),
        (("ana", "qos", "a.ipynb"), f"'qos' is no notebook of 'ch05': there are '{NOTEBOOK}'"),
        (("ana", NOTEBOOK), "Name one file"),
        (("ana", NOTEBOOK, "a.ipynb", "--nothing"), "Name one file"),
        (("ana", NOTEBOOK, "a.ipynb"), "a.ipynb is not valid JSON"),
        (("ana", NOTEBOOK, "../../bob/ch05/a.ipynb"), "There is no '../../bob/ch05/a.ipynb'"),
    ],
)
def test_a_claim_that_cannot_be_is_one_sentence(
    course: Course, arguments: tuple[str, ...], said: str
) -> None:
    (course.folder("ana") / "a.ipynb").write_text("{")
    (course.folder("bob") / "a.ipynb").write_text("{}")
    assert said in claim(course, *arguments)
    assert not (course.root / "claims.json").exists()


def test_a_claim_of_no_assignment_names_those_there_are(tmp_path: Path, course: Course) -> None:
    done = CliRunner().invoke(
        cli.app, ["claim", "ch06", "ana", "x", "y", "--root", str(course.root)]
    )
    assert "there is 'ch05'" in str(done.exception)


def test_a_damaged_source_is_not_blamed_on_what_is_claimed(course: Course) -> None:
    (course.folder("ana") / "a.ipynb").write_text("{")
    (course.root / "source" / ASSIGNMENT / f"{NOTEBOOK}.ipynb").write_text("{")
    said = claim(course, "ana", NOTEBOOK, "a.ipynb")
    assert f"The instructor's {course.root}/source/{ASSIGNMENT}/{NOTEBOOK}.ipynb is damaged" in said
    assert "make it again with `autograder build`" in said
    (course.root / "source" / ASSIGNMENT).rename(course.root / "source" / "week-7")
    with pytest.raises(NotReadyError, match=r"week-7/.* is damaged.*`autograder build`"):
        quiz_report.assignment_of(course.root, "ch05")  # as a quiz's name


def test_nbgraders_own_command_asks_where_it_would_give_zero(
    course: Course, cases: dict[str, Case]
) -> None:
    second = nbformat.v4.new_notebook(metadata=course.source.metadata)
    flags = {"schema_version": 3, "locked": True, "solution": False}
    text = {**flags, "grade": False, "grade_id": "second-text"}
    test = {**flags, "grade": True, "grade_id": "second-test", "points": 2}
    second.cells = [
        nbformat.v4.new_markdown_cell("# Second", id="a", metadata={"nbgrader": text}),
        nbformat.v4.new_code_cell("assert 1 + 1 == 2", id="b", metadata={"nbgrader": test}),
    ]
    nbformat.write(second, course.root / "source" / ASSIGNMENT / "second.ipynb")
    CourseGradebook(course.root).generate_assignment(ASSIGNMENT)
    put(course, "renamed", "second.ipynb", second)
    right = cases["right-chapter"].make_submission(course.source, course.released)
    put(course, "renamed", f"{NOTEBOOK} (1).ipynb", right)
    put(course, "left-out", "second.ipynb", second)
    (course.folder("renamed") / "timestamp.txt").write_text("2026-07-27 20:15:05 CEST\n")

    done = nbgrader(course, "autograde", ASSIGNMENT)

    assert done.returncode == 0, done.stderr
    found = {g.student: g for g in CourseGradebook(course.root).read_grades(ASSIGNMENT)}
    assert found["renamed"].needs_manual_grade
    assert f"`autograder grade {ASSIGNMENT}` takes it" in found["renamed"].asked[NOTEBOOK]
    assert set(found["renamed"].cells[NOTEBOOK].values()) == {None}
    assert not found["left-out"].needs_manual_grade
    assert found["left-out"].score == 2
    with Gradebook(f"sqlite:///{course.root / 'gradebook.db'}") as book:
        time = book.find_submission(ASSIGNMENT, "renamed").timestamp
    assert time == datetime(2026, 7, 27, 18, 15, 5)
