"""A class takes the quiz; nbgrader gets points for answers, by two doors, and for nothing else."""

from __future__ import annotations

import html
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import nbformat
import pytest

from autograder.assignments import quiz_cells, submission
from autograder.assignments.build_notebooks import build
from autograder.class_report.attention import people_needed
from autograder.class_report.class_data import collect_class
from autograder.examination.verdict import Verdict
from autograder.gradebook.course_gradebook import CourseGradebook, Grade
from autograder.gradebook.quizzes import quiz_marks
from autograder.gradebook.release import make_release
from autograder.grading import engine
from autograder.grading.engine import Graded
from autograder.grading.run_progress import Collecting
from course.workspace.content import content_root, copy_authoring
from course.workspace.student_version import student_versions
from quizzes.bank import selection
from quizzes.bank.loader import load_bank
from quizzes.bank.selection import PaperItem
from quizzes.notebook.quiz import Quiz
from tests.machine import needs_isolation

ASSIGNMENT, NOTEBOOK, CELL = "ch05-quiz", "quiz", "quiz-ch05"
FILE = "quiz-ch05.attempts.jsonl"


@pytest.fixture(scope="module")
def released(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = copy_authoring(content_root(), tmp_path_factory.mktemp("course"))
    build(root)
    make_release(root, ASSIGNMENT)
    return root


@pytest.fixture
def root(released: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(released, tmp_path / "course"))


HandIn = Callable[..., Path]


@pytest.fixture
def hand_in(root: Path) -> HandIn:
    """Take the quiz with so many right answers in each attempt, and hand the folder in."""

    def make(student: str, *rights: int, login: str = "") -> Path:
        folder = root / "submitted" / student / ASSIGNMENT
        folder.mkdir(parents=True)
        shutil.copy(root / "release" / ASSIGNMENT / f"{NOTEBOOK}.ipynb", folder)
        take(folder, login or student, *rights)
        return folder

    return make


def take(folder: Path, student: str, *rights: int) -> None:
    quiz = Quiz(load_bank("ch05"), student=student, folder=folder)
    for right in rights:
        if quiz.result is not None:
            quiz.retry()
        for item in quiz.items:
            quiz.answer(
                item.number, selection.right_answer(item) if item.number <= right else wrong(item)
            )
        quiz.submit()


def wrong(item: PaperItem) -> str | float:
    """Return an answer that fits the question and is not right."""
    key = selection.right_answer(item)
    if isinstance(key, float):
        return key + 1000
    if item.variant.kind in ("ordering", "matching"):
        return key[1:] + key[0]
    return next(letter for letter in item.letters if letter not in key)


def grades(root: Path) -> dict[str, Grade]:
    return {grade.student: grade for grade in CourseGradebook(root).read_grades(ASSIGNMENT)}


def points(root: Path) -> dict[str, float | None]:
    return {name: grade.cells[NOTEBOOK][CELL] for name, grade in grades(root).items()}


def verdict(folder: Path, student: str = "ada") -> Verdict:
    return quiz_marks.mark_best_attempt(load_bank("ch05"), folder, student)


@needs_isolation
def test_the_best_attempt_becomes_points(root: Path, hand_in: HandIn) -> None:
    hand_in("ada", 5)
    hand_in("alan", 1, 4, 2)
    hand_in("never", login="never")
    folder = hand_in("copied", 0)
    shutil.copy(root / "submitted" / "ada" / ASSIGNMENT / FILE, folder / FILE)
    forged = hand_in("forged", 0) / FILE
    line = json.loads(forged.read_text())
    forged.write_text(json.dumps({**line, "score": 5.0, "right": 5, "passed": True}) + "\n")
    hand_in("hasty", *[1] * 6)
    lost = hand_in("lost", 3)
    (lost / f"{NOTEBOOK}.ipynb").unlink()
    crashed = hand_in("crashed", 3)
    notebook = submission.read_notebook(crashed / f"{NOTEBOOK}.ipynb")
    notebook.cells.insert(0, nbformat.v4.new_code_cell("import os; os._exit(3)"))
    nbformat.write(notebook, crashed / f"{NOTEBOOK}.ipynb")

    graded: dict[str, Graded] = {}
    engine.grade(root, ASSIGNMENT, progress=Collecting(graded, then=engine.QUIET))
    found = points(root)

    assert graded["ada"].outcomes[NOTEBOOK].notes == [], "the quiz's own cells run in a subject"
    assert found["ada"] == 5.0
    best = verdict(root / "submitted" / "alan" / ASSIGNMENT).score
    assert found["alan"] == best
    assert 4 <= best < 5
    assert found["never"] == 0.0
    assert found["forged"] == verdict(forged.parent).score < 2
    assert found["copied"] is None, "the answers are right, but a person says whether they count"
    assert found["crashed"] == verdict(crashed).score >= 3
    assert grades(root)["lost"].score == verdict(lost).score >= 3
    assert {name for name, grade in grades(root).items() if grade.needs_manual_grade} == {
        "copied",
        "hasty",
        "lost",
    }
    needs = {
        student: n.why
        for n in people_needed(collect_class(root, ASSIGNMENT))
        for student in n.students
    }
    assert "more than # attempts were submitted within # seconds" in needs["hasty"]
    for student, says in {
        "alan": "The best of 3 attempts counts: number 2.",
        "copied": "made under the login 'ada'",
        "never": f"There is no {FILE} in the submission",
    }.items():
        page = root / "feedback" / student / ASSIGNMENT / f"{NOTEBOOK}.html"
        assert says in html.unescape(page.read_text())


@needs_isolation
def test_nbgraders_own_command_gives_the_same_points(root: Path, hand_in: HandIn) -> None:
    hand_in("ada", 5)
    hand_in("alan", 2)
    done = subprocess.run(
        [sys.executable, "-m", "nbgrader", "autograde", ASSIGNMENT],
        cwd=root, capture_output=True, text=True, timeout=170, check=False,
        env={**os.environ, "PYTHONWARNINGS": "ignore"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    by_nbgrader = points(root)
    engine.grade(root, ASSIGNMENT)
    assert points(root) == by_nbgrader
    assert by_nbgrader["ada"] == 5.0


@needs_isolation
def test_a_new_attempt_counts_when_graded_again(root: Path, hand_in: HandIn) -> None:
    folder = hand_in("ada", 1)
    engine.grade(root, ASSIGNMENT)
    before = points(root)["ada"]
    take(folder, "ada", 5)
    engine.grade(root, ASSIGNMENT)
    assert (before is not None and before < 5, points(root)["ada"]) == (True, 5.0)


@needs_isolation
def test_a_changed_grade_cell_earns_nothing(root: Path, hand_in: HandIn) -> None:
    folder = hand_in("ada", 0)
    notebook = submission.read_notebook(folder / f"{NOTEBOOK}.ipynb")
    for cell in notebook.cells:
        if submission.grade_id(cell) == CELL:
            cell.source = "5.0"
    nbformat.write(notebook, folder / f"{NOTEBOOK}.ipynb")
    engine.grade(root, ASSIGNMENT)
    assert points(root)["ada"] == verdict(folder).score < 2


def test_attempts_that_look_machine_made_go_to_a_person_with_the_reason(tmp_path: Path) -> None:
    take(tmp_path, "ada", 2, 5)
    assert (verdict(tmp_path).score, verdict(tmp_path).needs_human) == (5.0, False)
    lines = (tmp_path / FILE).read_text().splitlines()
    far = [json.dumps({**json.loads(lines[1]), "attempt": number}) for number in (21, 22)]
    (tmp_path / FILE).write_text("\n".join([lines[0], *far]))
    found = verdict(tmp_path)
    assert 2 <= found.score < 5
    assert (found.max_score, found.needs_human) == (5.0, True)
    assert found.notes[0].startswith("The one attempt that counts is number 1.")
    assert "of 3 attempts 2 are beyond the first 20" in found.checks[-1].actual
    (tmp_path / FILE).write_text("\n".join(far))
    found = verdict(tmp_path)
    assert (found.score, found.needs_human) == (0.0, True)
    assert "of 2 attempts 2 are beyond the first 20" in found.checks[0].actual


@pytest.mark.parametrize("kind", ["link", "folder", "pipe", "rubbish", "empty"])
def test_something_else_in_the_place_of_the_file_earns_nothing(tmp_path: Path, kind: str) -> None:
    folder = tmp_path / "submission"
    folder.mkdir()
    path = folder / FILE
    if kind == "link":
        (tmp_path / "elsewhere").mkdir()
        take(tmp_path / "elsewhere", "ada", 5)
        path.symlink_to(tmp_path / "elsewhere" / FILE)
    elif kind == "folder":
        path.mkdir()
    elif kind == "pipe":
        os.mkfifo(path)
    else:
        path.write_bytes(b"\x00rubbish" * 100 if kind == "rubbish" else b"")
    found = verdict(folder)
    asked = kind != "empty"  # what may have been attempts waits for a person
    assert (found.score, found.max_score, found.needs_human) == (0.0, 5.0, asked)
    assert {check.status for check in found.checks} == {"not_examined" if asked else "not_checked"}


def test_attempts_on_another_edition_go_to_a_person(tmp_path: Path) -> None:
    take(tmp_path, "ada", 5)
    path = tmp_path / FILE
    path.write_text(path.read_text().replace(load_bank("ch05").edition, "0" * 16))
    found = verdict(tmp_path)
    assert (found.score, found.needs_human) == (0.0, True)
    assert "another edition" in found.checks[0].actual


def test_a_verdict_tells_what_was_wrong_and_not_the_key(tmp_path: Path) -> None:
    take(tmp_path, "ada", 0)
    found = verdict(tmp_path)
    assert all(check.rationale and check.actual.startswith("The answer was:")
               for check in found.checks if not check.passed)  # fmt: skip
    assert not any(check.expected for check in found.checks)
    assert Verdict.from_data(json.loads(json.dumps(found.as_data()))) == found


def test_the_quiz_has_points_of_its_own_and_the_release_holds_no_key(root: Path) -> None:
    assert quiz_cells.of_grade_cells(root)[CELL] == 5.0
    folder = root / "release" / ASSIGNMENT
    assert [path.name for path in folder.rglob("*") if path.is_file()] == [f"{NOTEBOOK}.ipynb"]
    text = student_versions(root)[Path(ASSIGNMENT) / f"{NOTEBOOK}.ipynb"]
    for misconception in load_bank("ch05").misconceptions:
        assert misconception not in text
