"""A folder of submissions goes in, nbgrader grades come out, by two doors, on real DDS."""

from __future__ import annotations

import html
import os
import subprocess
import sys
from functools import partial
from pathlib import Path
from typing import Any

import nbformat
import pytest
from nbformat import NotebookNode
from nbgrader.api import Gradebook

from autograder.assignments import submission
from autograder.corpus import Case
from autograder.examination import points
from autograder.examination.program import Program
from autograder.gradebook.course_gradebook import CourseGradebook, Grade, GradebookError
from autograder.gradebook.nbgrader_plugins import nbgrader_speedups
from autograder.gradebook.nbgrader_plugins.autograde_steps import NotReadyError
from autograder.gradebook.nbgrader_plugins.nbgrader_speedups import FeedbackExporter
from autograder.grading import engine
from autograder.grading.engine import AssignmentError
from autograder.running import runner
from tests.autograder.conftest import ASSIGNMENT, NOTEBOOK, Course
from tests.machine import needs_sandbox

pytestmark = needs_sandbox

Cases = dict[str, Case]


def grade(course: Course, **options: bool) -> dict[str, Grade]:
    engine.grade(course.root, ASSIGNMENT, **options)
    return grades(course)


def grades(course: Course) -> dict[str, Grade]:
    return {g.student: g for g in CourseGradebook(course.root).read_grades(ASSIGNMENT)}


def cells(grade: Grade) -> dict[str, float | None]:
    return grade.cells[NOTEBOOK]


def without(notebook: NotebookNode, grade_id: str) -> NotebookNode:
    notebook.cells = [c for c in notebook.cells if submission.grade_id(c) != grade_id]
    return notebook


def nbgrader(course: Course, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "nbgrader", *arguments],
        cwd=course.root, capture_output=True, text=True, timeout=170, check=False,
        env={**os.environ, "PYTHONWARNINGS": "ignore"},
    )  # fmt: skip


def test_a_class_is_graded_whatever_state_its_files_are_in(course: Course, cases: Cases) -> None:
    right = partial(cases["right-chapter"].make_submission, course.source)
    course.submit("right", right(course.released))
    course.submit(
        "wrong", cases["wrong-imu-endless"].make_submission(course.source, course.released)
    )
    course.submit("cut-off", "{" + '"cells": [')
    course.folder("empty")
    course.submit("deleted", without(right(course.released), "qos-hidden"))
    edited = right(course.released)
    for cell in edited.cells:
        if submission.grade_id(cell) == "qos-visible":
            cell.source = "100.0"
    course.submit("edited", edited)
    twice = right(course.released)
    (stub,) = (c for c in course.released.cells if submission.grade_id(c) == "qos-solution")
    twice.cells.append(nbformat.from_dict({**stub, "id": "second"}))
    course.submit("twice", twice)

    graded = {g.student: g for g in engine.grade(course.root, ASSIGNMENT)}
    found = grades(course)

    full = {"qos-visible": 10.0, "qos-hidden": 5.0, **dict.fromkeys(points.table()["qos"].manual)}
    for student in ("right", "deleted", "edited", "twice"):
        assert cells(found[student]) == full, student
    assert cells(found["wrong"]) == {**full, "qos-hidden": 3.0}
    for student, reason in {"cut-off": "not valid JSON", "empty": "There is no"}.items():
        assert found[student].score == 0
        assert found[student].needs_manual_grade, "a person decides about an unreadable file"
        assert reason in graded[student].problem
    assert not any(graded[student].problem for student in ("right", "wrong", "edited"))
    feedback = (course.root / f"feedback/deleted/{ASSIGNMENT}/{NOTEBOOK}.html").read_text()
    assert "had been deleted; it was put back" in feedback
    assert "A short burst of IMU readings is kept" in feedback


FORGED_OUTPUTS = """
import json, os
for number in range(100):
    for descriptor in range(3, 64):
        try:
            os.write(descriptor, json.dumps({"shows": number, "outputs": [5]}).encode() + b"\\n")
        except OSError:
            pass
"""


def with_cell(text: str, source: str) -> str:
    """Return a notebook's text with one more cell at its beginning."""
    notebook = nbformat.reads(text, 4)
    notebook.cells.insert(0, nbformat.v4.new_code_cell(source))
    return nbformat.writes(notebook)


def with_nonsense(text: str) -> str:
    """Return a notebook's text with metadata that nbgrader cannot take."""
    notebook = nbformat.reads(text, 4)
    forged = {"schema_version": 3, "grade": False, "locked": False, "solution": False}
    for nonsense in (None, [], {}, "x", {**forged, "cell_type": "No space left on device"}):
        cell = nbformat.v4.new_markdown_cell("Mine.")
        cell.metadata = nbformat.from_dict({"nbgrader": nonsense, "transient": nonsense})
        notebook.cells.append(cell)
    notebook.metadata["widgets"] = 5
    return nbformat.writes(notebook)


def test_what_one_student_hands_in_never_stops_the_others(course: Course, cases: Cases) -> None:
    right = nbformat.writes(cases["right-chapter"].make_submission(course.source, course.released))
    course.submit("a-surrogate", right.replace("My idea", "My \\ud83d idea"))
    course.submit("b-version", right.replace('"nbformat": 4', '"nbformat": 4.0'))
    (course.folder("c-folder") / f"{NOTEBOOK}.ipynb").mkdir()
    os.mkfifo(course.folder("d-fifo") / f"{NOTEBOOK}.ipynb")
    course.submit("e-time", right)
    (course.folder("e-time") / "timestamp.txt").write_text("19.11.2026 um 14 Uhr")
    course.submit("f[1]", right)
    given = "camera_qos = QoSProfile(depth=80, durability=DurabilityPolicy.TRANSIENT_LOCAL)"
    helper = right.replace(given, "from my_profiles import camera_qos")
    assert helper != right
    course.submit("g-helper", helper)
    (course.folder("g-helper") / "my_profiles.py").write_text("camera_qos = 10\n")
    course.submit("h last Müller", right)
    course.submit("i-metadata", with_nonsense(right))
    course.submit("j-outputs", with_cell(right, FORGED_OUTPUTS))
    for depth in (500, 900):
        nested = f'"deep": {"[" * depth}{"]" * depth}, "kernelspec"'
        course.submit(f"k-nested-{depth}", right.replace('"kernelspec"', nested, 1))
    course.submit("l-folders", right)
    deep = course.folder("l-folders")
    for _ in range(19):
        deep = deep / "/".join(["d"] * 50)
        deep.mkdir(parents=True)
    course.submit("m-time", right)
    os.mkfifo(course.folder("m-time") / "timestamp.txt")
    course.submit("n-long", with_cell(right, f"data = '{'x' * 2_500_000}'"))
    (course.root / "submitted" / "o-link").mkdir()
    (course.root / "submitted" / "o-link" / ASSIGNMENT).symlink_to(course.folder("e-time"))
    latin = os.fsdecode(b"p-M\xfcller")
    course.submit(latin, right)

    graded = {g.student: g for g in engine.grade(course.root, ASSIGNMENT)}
    found = grades(course)

    full = (
        "a-surrogate",
        "e-time",
        "g-helper",
        "h last Müller",
        "i-metadata",
        "l-folders",
        "m-time",
    )
    for student in full:
        assert found[student].score == 15, graded[student]
    refused = ("b-version", "c-folder", "d-fifo", "k-nested-500", "k-nested-900", "n-long")
    for student in refused:
        assert found[student].score == 0
        assert found[student].needs_manual_grade
        assert graded[student].problem
    assert "no date" in graded["e-time"].problem
    assert not graded["f[1]"].entered
    assert "rename the folder" in graded["f[1]"].problem
    assert found["j-outputs"].score == 0
    text = (course.root / f"feedback/j-outputs/{ASSIGNMENT}/{NOTEBOOK}.html").read_text()
    assert "own channel" in text
    assert "2.4 MB of code" in graded["n-long"].problem
    assert "leads out of the student's own folder" in graded["o-link"].problem
    assert "rename the folder" in graded[latin].problem
    assert not {"o-link", latin} & found.keys()
    subprocess.run(["rm", "-rf", course.folder("l-folders")], check=True)


def test_manual_marks_survive_a_regrade(course: Course, cases: Cases) -> None:
    course.submit("right", cases["right-chapter"].make_submission(course.source, course.released))
    grade(course)
    database = f"sqlite:///{course.root / 'gradebook.db'}"
    with Gradebook(database) as book:
        entry = book.find_grade("qos-explanation-depth", NOTEBOOK, ASSIGNMENT, "right")
        entry.manual_score = 0.5
        entry.needs_manual_grade = False
        book.db.commit()
    again = grade(course)["right"]
    assert (again.score, cells(again)["qos-explanation-depth"]) == (15.5, 0.5)


def test_what_did_not_change_is_not_run_again(
    course: Course, cases: Cases, monkeypatch: pytest.MonkeyPatch
) -> None:
    course.submit("right", cases["right-chapter"].make_submission(course.source, course.released))
    runs: list[Program] = []
    really_run = runner.run

    def spy(program: Program, files: dict[str, bytes], **options: Any) -> runner.Outcome:
        runs.append(program)
        return really_run(program, files, **options)

    monkeypatch.setattr(runner, "run", spy)
    first = grade(course)
    second = grade(course)
    assert len(runs) == 1
    assert first == second
    grade(course, fresh=True)
    assert len(runs) == 2
    course.submit(
        "right", cases["wrong-imu-single"].make_submission(course.source, course.released)
    )
    assert cells(grade(course)["right"])["qos-hidden"] == 3.0
    assert len(runs) == 3


def test_nbgraders_own_command_gives_the_same_grades(course: Course, cases: Cases) -> None:
    course.submit("right", cases["right-two-sides"].make_submission(course.source, course.released))
    wrong = without(
        cases["wrong-lidar-deep"].make_submission(course.source, course.released), "qos-visible"
    )
    course.submit("wrong", wrong)
    reasons = {"cut-off": "was cut off or damaged", "pipe": "is not a file", "deep": "is nested"}
    course.submit("cut-off", '{"cells": [')
    course.submit(
        "deep", '{"nbformat": 4, "nbformat_minor": 5, "cells": ' + "[" * 500 + "]" * 500 + "}"
    )
    os.mkfifo(course.folder("pipe") / f"{NOTEBOOK}.ipynb")
    (course.folder("wrong") / "data.bin").write_bytes(bytes(11 * 2**20))
    result = nbgrader(course, "autograde", ASSIGNMENT)
    assert result.returncode == 0, result.stderr
    by_nbgrader = grades(course)
    for student in reasons:
        assert by_nbgrader[student].score == 0
        assert by_nbgrader[student].needs_manual_grade, "a person decides about what is unreadable"
    assert cells(by_nbgrader["right"])["qos-visible"] == 10.0
    assert cells(by_nbgrader["wrong"])["qos-visible"] == 8.0
    assert nbgrader(course, "generate_feedback", ASSIGNMENT).returncode == 0
    feedback = (course.root / f"feedback/wrong/{ASSIGNMENT}/{NOTEBOOK}.html").read_text()
    assert "After a pause obstacle avoidance acts on fresh scans only." in feedback

    def said(student: str) -> str:
        file = course.root / f"feedback/{student}/{ASSIGNMENT}/{NOTEBOOK}.html"
        return html.unescape(file.read_text())

    reasons["wrong"] = "Your code was run without 'data.bin'"
    for student, reason in reasons.items():
        assert reason in said(student)
    assert grade(course, fresh=True, feedback=True) == by_nbgrader
    for student, reason in reasons.items():
        assert reason in said(student)


def test_nbgrader_validate_passes_the_exemplar_and_fails_the_stub(course: Course) -> None:
    exemplar = course.root / "source" / ASSIGNMENT / f"{NOTEBOOK}.ipynb"
    result = nbgrader(course, "validate", str(exemplar))
    assert "Success! Your notebook passes all the tests." in result.stdout, result.stdout
    stub = course.root / "release" / ASSIGNMENT / f"{NOTEBOOK}.ipynb"
    result = nbgrader(course, "validate", str(stub))
    assert "VALIDATION FAILED" in result.stdout, result.stdout


def test_the_release_gives_nothing_away(course: Course) -> None:
    folder = course.root / "release" / ASSIGNMENT
    files = {path.name for path in folder.rglob("*") if path.is_file()}
    assert files == {f"{NOTEBOOK}.ipynb", f"{NOTEBOOK}.svg"}
    text = (folder / f"{NOTEBOOK}.ipynb").read_text()
    for secret in (
        "SOLUTION",
        "HIDDEN TESTS",
        'part=\\"hidden\\"',
        "depth=5",
        "Policy.BEST_EFFORT",
    ):
        assert secret not in text


def test_an_unknown_assignment_names_those_there_are(course: Course) -> None:
    with pytest.raises(AssignmentError, match=r"no assignment 'ch06'.*there are ch05"):
        engine.grade(course.root, "ch06")


def test_an_assignment_that_is_not_released_says_so(course: Course) -> None:
    source = course.root / "source" / "ch06"
    source.mkdir()
    (source / "x.ipynb").write_text(nbformat.writes(course.source))
    with pytest.raises(AssignmentError, match="run `autograder release ch06` first"):
        engine.grade(course.root, "ch06")


@pytest.mark.parametrize(
    ("step", "content", "wrong", "command"),
    [
        ("release", None, "missing", "autograder release ch05"),
        ("release", "{", "damaged", "autograder release ch05"),
        ("source", None, "missing", "autograder build"),
        ("source", "{", "damaged", "autograder build"),
    ],
)
def test_what_the_instructor_lacks_is_not_blamed_on_a_submission(
    course: Course, step: str, content: str | None, wrong: str, command: str
) -> None:
    course.submit("ada", "{")
    path = course.root / step / ASSIGNMENT / f"{NOTEBOOK}.ipynb"
    path.unlink()
    if content is not None:
        path.write_text(content)
    sentence = rf"The instructor's .*{step}/{ASSIGNMENT}/.* is {wrong}.*`{command}`, then grade"
    with pytest.raises(NotReadyError, match=sentence):
        engine.grade(course.root, ASSIGNMENT)
    assert grades(course) == {}


def test_a_notebook_that_is_not_released_yet_is_not_graded(course: Course) -> None:
    course.submit("ada", "{")
    source = course.root / "source" / ASSIGNMENT / f"{NOTEBOOK}.ipynb"
    source.with_name("next-week.ipynb").write_bytes(source.read_bytes())
    assert list(grade(course)["ada"].cells) == [NOTEBOOK]


def test_an_empty_class_says_where_files_belong(course: Course) -> None:
    with pytest.raises(AssignmentError, match=r"Nobody has submitted 'ch05' yet"):
        engine.grade(course.root, ASSIGNMENT)


def test_a_folder_that_is_no_course_says_so(tmp_path: Path) -> None:
    with pytest.raises(GradebookError, match=r"no nbgrader_config\.py"):
        engine.grade(tmp_path, ASSIGNMENT)


def test_a_warm_up_compiles_what_feedback_is_made_with(course: Course) -> None:
    compiled = nbgrader_speedups._compiled._codes
    compiled.clear()
    FeedbackExporter.warm_up(course.released)
    assert {"index.html.j2", "base.html.j2"} <= {
        Path(code.co_filename).name for code in compiled.values()
    }
    FeedbackExporter.warm_up(nbformat.from_dict({"cells": 3}))  # that is for nbgrader to tell
