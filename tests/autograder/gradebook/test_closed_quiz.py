"""A course's own closed quiz, from its bank to the gradebook; the keys stay where the bank is."""

from __future__ import annotations

import html
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

import quizzes
from autograder.assignments.build_notebooks import build
from autograder.assignments.quiz_cells import QuizMarksError
from autograder.assignments.quiz_sheets import QuizSheetError
from autograder.commands import quiz_report
from autograder.commands.quiz_command import QuizCommandError
from autograder.gradebook.course_gradebook import CourseGradebook
from autograder.gradebook.release import ReleaseError, make_release
from autograder.grading import engine
from course.workspace.content import content_root, copy_authoring
from course.workspace.working_copy import make_copy
from quizzes.bank import loader, schema, selection
from quizzes.marking import closed_quizzes
from tests.autograder.gradebook.test_quiz_marks import wrong
from tests.machine import needs_isolation
from tests.quizzes import sample

QUIZ = ASSIGNMENT = "midterm"
SHEET = closed_quizzes.sheet_filename(QUIZ)
TEXT = """\
# %% nbgrader={"grade": false, "grade_id": "take", "locked": true, "schema_version": 3, "solution": false}
import quizzes

quiz = quizzes.load("midterm")
quiz.show()

# %% nbgrader={"grade": true, "grade_id": "quiz-midterm", "locked": true, "points": 0, "schema_version": 3, "solution": false}
quiz
"""  # noqa: E501 - the percent format has a cell's metadata on one line


def course(folder: Path, **changes: Any) -> Path:
    """Return a course with nothing but a quiz of its own."""
    root = copy_authoring(content_root(), folder)
    authoring = root / "authoring"
    for left in ("chapters", "assignments"):
        shutil.rmtree(authoring / left)
    (authoring / "assignments" / ASSIGNMENT).mkdir(parents=True)
    (authoring / "assignments" / ASSIGNMENT / "exam.py").write_text(TEXT)
    write_bank(root, **changes)
    return root


def write_bank(root: Path, text: str = "", **changes: Any) -> None:
    if text:
        (root / "authoring" / "banks").mkdir(exist_ok=True)
        (root / "authoring" / "banks" / f"{QUIZ}.yaml").write_text(text)
        return
    data = {**sample.data(), "quiz": QUIZ, "closed": True, **changes}
    sample.write(root / "authoring" / "banks", data).rename(
        root / "authoring" / "banks" / f"{QUIZ}.yaml"
    )


@pytest.fixture
def root(tmp_path: Path) -> Path:
    root = course(tmp_path / "course")
    build(root)
    make_release(root, ASSIGNMENT)
    return root


def hand_in(root: Path, student: str, *, right: int) -> Path:
    folder = root / "submitted" / student / ASSIGNMENT
    shutil.copytree(root / "release" / ASSIGNMENT, folder)
    quiz = quizzes.load(QUIZ, student=student, folder=folder)
    bank = loader.load_bank(QUIZ, root / "authoring" / "banks")
    for item in selection.draw(bank, student, 1).items:
        quiz.answer(
            item.number, selection.right_answer(item) if item.number <= right else wrong(item)
        )
    quiz.submit()
    return folder


def points(root: Path) -> dict[str, float | None]:
    grades = CourseGradebook(root).read_grades(ASSIGNMENT)
    return {grade.student: grade.cells["exam"][f"quiz-{QUIZ}"] for grade in grades}


def test_students_get_questions_and_pictures_and_no_key(root: Path, tmp_path: Path) -> None:
    released = root / "release" / ASSIGNMENT
    files = {str(path.relative_to(released)) for path in released.rglob("*") if path.is_file()}
    assert files == {"exam.ipynb", SHEET, "assets/dot.svg"}
    make_copy(tmp_path / "copy", root)
    for folder in (released, tmp_path / "copy" / ASSIGNMENT):
        assert quizzes.load(QUIZ, folder=folder).bank.keyless
        for path in (folder / name for name in files):
            assert sample.SECRET.lower() not in path.read_text(encoding="utf-8").lower(), path
    assert build(root, check=True)


@needs_isolation
def test_the_instructors_keys_make_points_by_two_doors(root: Path) -> None:
    hand_in(root, "ada", right=5)
    folder = hand_in(root, "alan", right=2)
    (folder / SHEET).unlink()  # nothing is marked by what a student hands in
    engine.grade(root, ASSIGNMENT)
    found = points(root)
    assert found["ada"] == 5.0
    assert found["alan"] is not None
    assert 2 <= found["alan"] < 5
    page = root / "feedback" / "alan" / ASSIGNMENT / "exam.html"
    assert f"{sample.SECRET} no such number." in html.unescape(page.read_text())
    done = subprocess.run(
        [sys.executable, "-m", "nbgrader", "autograde", ASSIGNMENT, "--force"],
        cwd=root, capture_output=True, text=True, timeout=170, check=False,
        env={**os.environ, "PYTHONWARNINGS": "ignore"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert points(root) == found
    [report] = quiz_report.of_assignment(root, ASSIGNMENT)
    assert report.as_data()["learners"] == 2


@needs_isolation
def test_a_mended_key_changes_the_points(root: Path) -> None:
    hand_in(root, "ada", right=5)
    engine.grade(root, ASSIGNMENT)
    mended = sample.data()
    for variant in mended["concepts"][2]["variants"]:  # the numbers
        variant["answer"] += 7
    write_bank(root, concepts=mended["concepts"])
    engine.grade(root, ASSIGNMENT)
    assert points(root) == {"ada": 4.0}


def test_a_bank_with_keys_that_nobody_would_get_is_refused(tmp_path: Path) -> None:
    root = course(tmp_path / "course", closed=False)
    with pytest.raises(QuizSheetError, match=r"midterm.yaml does not reach students.*closed: true"):
        build(root)
    assert not (root / "source").exists()


def test_questions_in_the_place_of_the_bank_are_refused(root: Path) -> None:
    sheet = root / "source" / ASSIGNMENT / SHEET
    shutil.copy(sheet, root / "authoring" / "banks" / f"{QUIZ}.yaml")
    with pytest.raises(QuizMarksError, match="has no keys, so nothing can be marked with it"):
        build(root)


def test_questions_that_are_not_in_step_with_the_bank_are_not_released(root: Path) -> None:
    data = sample.data()
    data["concepts"][0]["variants"][0]["stem"] = "What else?"
    write_bank(root, concepts=data["concepts"])
    with pytest.raises(ReleaseError, match=rf"{SHEET} is not in step with the quiz: run"):
        make_release(root, ASSIGNMENT)
    build(root)
    make_release(root, ASSIGNMENT)
    assert "What else?" in (root / "release" / ASSIGNMENT / SHEET).read_text()


def test_a_bank_in_the_place_of_the_questions_is_not_released(root: Path) -> None:
    shutil.copy(root / "authoring" / "banks" / f"{QUIZ}.yaml", root / "source" / ASSIGNMENT / SHEET)
    with pytest.raises(ReleaseError, match="is not in step with the quiz"):
        make_release(root, ASSIGNMENT)
    assert yaml.safe_load((root / "release" / ASSIGNMENT / SHEET).read_text())["keyless"]


@needs_isolation
def test_three_questions_with_one_variant_each_are_an_exam(tmp_path: Path) -> None:
    """From a bank that has nothing to teach to its points, its feedback and its report."""
    text = (schema.EXAMPLES / "exam.yaml").read_text().replace("quiz: exam", f"quiz: {QUIZ}")
    root = course(tmp_path / "course", text=text)
    build(root)
    make_release(root, ASSIGNMENT)
    hand_in(root, "ada", right=3)
    hand_in(root, "alan", right=1)
    engine.grade(root, ASSIGNMENT)
    found = points(root)
    assert found["ada"] == 3.0
    assert found["alan"] is not None
    assert 1 <= found["alan"] < 3
    page = html.unescape((root / "feedback" / "alan" / ASSIGNMENT / "exam.html").read_text())
    assert "The answer was:" in page
    assert "Compute a rate from a period." in page
    assert ">None<" not in page
    assert "was: 20 Hz" not in page, "a closed quiz does not give its key away"
    [report] = quiz_report.of_assignment(root, ASSIGNMENT)
    assert report.as_data()["learners"] == 2
    assert report.as_data()["misconceptions"] == []
    assert sorted(path.name for path in report.files) == [
        f"quiz-{QUIZ}-items.csv", f"quiz-{QUIZ}-report.html",
    ]  # fmt: skip
    assert "believes" not in report.files[0].read_text()


def test_a_quizs_name_stands_for_its_assignment(root: Path) -> None:
    (root / "source" / ASSIGNMENT).rename(root / "source" / "week-7")
    assert quiz_report.assignment_of(root, QUIZ) == "week-7"
    assert quiz_report.assignment_of(root, "week-7") == "week-7"
    assert quiz_report.assignment_of(root, "nothing") == "nothing", "which the report refuses"
    shutil.copytree(root / "source" / "week-7", root / "source" / "week-8")
    with pytest.raises(QuizCommandError, match="is in the assignments week-7, week-8: name one"):
        quiz_report.assignment_of(root, QUIZ)
