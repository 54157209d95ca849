"""A person looks again at what changed, and at nothing else."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import nbformat
import pytest
from nbgrader.api import Gradebook

from autograder.assignments import submission
from autograder.assignments.build_notebooks import build
from autograder.examination import points
from autograder.gradebook.release import make_release
from autograder.gradebook.written_answers import settled_marks
from autograder.gradebook.written_answers.settled_marks import Marks, SettledMark
from autograder.grading import engine
from autograder.util.state_table import StateTable
from tests.autograder.conftest import ASSIGNMENT, NOTEBOOK, Course, Undisturbed
from tests.killing import fresh_copy
from tests.machine import needs_sandbox

pytestmark = [needs_sandbox, pytest.mark.xdist_group("class"), pytest.mark.timeout(900)]

ANSWERS = tuple(points.table()["qos"].manual)


@pytest.fixture
def course(class_: Undisturbed, tmp_path: Path) -> Course:
    """A graded class in which a person has marked all of what 'right' wrote, and one check."""
    course = Course(fresh_copy(class_.graded, tmp_path / "course"))
    with book(course) as gradebook:
        for cell in (*ANSWERS, "qos-visible"):
            grade = gradebook.find_grade(cell, NOTEBOOK, ASSIGNMENT, "right")
            grade.manual_score, grade.needs_manual_grade = 0.5, False
        gradebook.db.commit()
    return course


def book(course: Course) -> Gradebook:
    return Gradebook(f"sqlite:///{course.root / 'gradebook.db'}")


def asked(course: Course) -> set[str]:
    """Return the cells of 'right' that a person is asked to mark, with every mark still there."""
    with book(course) as gradebook:
        found = gradebook.find_submission_notebook(NOTEBOOK, ASSIGNMENT, "right").grades
        assert {
            g.name: g.manual_score for g in found if g.manual_score is not None
        } == dict.fromkeys((*ANSWERS, "qos-visible"), 0.5)
        return {grade.name for grade in found if grade.needs_manual_grade}


def grade(course: Course) -> str:
    """Grade what 'right' handed in; return what is said of it."""
    (done,) = engine.grade(course.root, ASSIGNMENT, students=["right"], feedback=False)
    return done.problem


def hand_in(course: Course, change: Callable[[dict[str, nbformat.NotebookNode]], None]) -> None:
    notebook = submission.read_notebook(course.folder("right") / f"{NOTEBOOK}.ipynb")
    change({submission.grade_id(cell): cell for cell in notebook.cells})
    course.submit("right", notebook)


def test_an_answer_that_is_worth_more_is_looked_at_again(course: Course) -> None:
    build(course.root, points={**points.of_grade_cells(), "qos-explanation-loss": 2.0})
    make_release(course.root, ASSIGNMENT)
    said = grade(course)
    assert (
        "To be marked again: “A lost camera frame” of Exercise 1: QoS profile design "
        "(2 points now, not 2.5)." in said
    )
    assert asked(course) == {"qos-explanation-loss"}
    assert grade(course) == "", "it is said once"
    assert asked(course) == {"qos-explanation-loss"}


def test_of_another_hand_in_only_the_answers_that_changed_are_asked_for(course: Course) -> None:
    def change(cells: dict[str, nbformat.NotebookNode]) -> None:
        cells["qos-explanation-depth"].source += "\n\n![as I drew it](drawing.png)\n"

    (course.folder("right") / "drawing.png").write_bytes(b"one")
    (course.folder("right") / "timestamp.txt").write_text("2030-01-31 12:00:00 UTC")
    hand_in(course, change)
    said = grade(course)
    assert "“History and depth” of Exercise 1: QoS profile design (it changed)" in said
    assert "qos-explanation" not in said
    assert "qos-explanation-depth" in asked(course)
    assert "qos-explanation-loss" not in asked(course)

    with book(course) as gradebook:
        for cell in (*ANSWERS, "qos-visible"):
            mark = gradebook.find_grade(cell, NOTEBOOK, ASSIGNMENT, "right")
            mark.needs_manual_grade = False
        gradebook.db.commit()
    (course.folder("right") / "drawing.png").write_bytes(b"two")
    grade(course)
    assert asked(course) == {"qos-explanation-depth", "qos-visible"}, "the file is their work, too"


def test_a_blank_line_at_the_end_is_no_other_answer(course: Course) -> None:
    def change(cells: dict[str, nbformat.NotebookNode]) -> None:
        cells["qos-explanation-depth"].source += "\n"

    hand_in(course, change)
    assert grade(course) == ""
    assert asked(course) == set()


def test_an_engine_that_ends_in_between_forgets_no_mark(
    course: Course, monkeypatch: pytest.MonkeyPatch
) -> None:
    def ends(*_: object, **__: object) -> str:
        raise SystemExit

    (course.folder("right") / "timestamp.txt").write_text("2030-01-31 12:00:00 UTC")
    with monkeypatch.context() as patched:
        patched.setattr(Marks, "settle", ends)
        with pytest.raises(SystemExit):
            grade(course)
    assert asked(course) == {*ANSWERS, "qos-visible"}, "nbgrader asks for all of them again"
    assert grade(course) == ""
    assert asked(course) == set()


@pytest.mark.parametrize(
    ("old", "new", "same", "why"),
    [
        (SettledMark(None, 1.0, "a"), SettledMark(None, 1.0, "a"), False, ""),
        (SettledMark(None, 1.0, "a"), SettledMark(None, 1.0, "b"), True, "it changed"),
        (SettledMark(None, 1.0, "a"), SettledMark(None, 0.5, "a"), True, "0.5 points now, not 1"),
        (
            SettledMark(3.0, 5.0, "a"),
            SettledMark(4.0, 5.0, "a"),
            True,
            "the checks find something else",
        ),
        (SettledMark(None), SettledMark(None, 1.0, "a"), True, ""),
        (SettledMark(None), SettledMark(None, 1.0, "a"), False, "it changed"),
        (SettledMark(3.0), SettledMark(4.0, 5.0, "a"), True, "the checks find something else"),
    ],
)
def test_what_must_be_looked_at_again(
    old: SettledMark, new: SettledMark, same: bool, why: str
) -> None:
    cell = ("notebook", "cell")
    assert settled_marks.find_changes({cell: old}, {cell: new}, same=same) == (
        {cell: why} if why else {}
    )
    assert settled_marks.find_changes({cell: old}, {}, same=same) == {}


def test_what_was_marked_is_kept_and_that_of_another_version_is_not_read(course: Course) -> None:
    marks = Marks(course.root / ".autograder", ASSIGNMENT, {})
    copy = course.root / "autograded" / "right" / ASSIGNMENT
    with book(course) as gradebook:
        for student in ("right", "wrong", "nobody"):
            marks.remember(gradebook, student, copy)
    assert {cell for _, cell in marks.remembered_cells("right")} == {*ANSWERS, "qos-visible"}
    assert all(cell.content and cell.points for cell in marks.remembered_cells("right").values())
    assert marks.remembered_cells("wrong") == marks.remembered_cells("nobody") == {}
    StateTable(course.root / ".autograder", settled_marks.KIND, ASSIGNMENT).put('[["a"]]', "right")
    assert marks.remembered_cells("right") == {}
