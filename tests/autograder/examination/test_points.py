"""The table of points: one place, and sums that a course can rely on."""

from __future__ import annotations

import pytest

from autograder import exercises
from autograder.assignments import listing
from autograder.examination import points
from course.workspace.content import content_root

EXERCISES = points.table()


def test_every_exercise_has_its_points() -> None:
    assert sorted(EXERCISES) == exercises.exercise_names()
    assert EXERCISES


def test_chapter_5_has_100_points() -> None:
    listed = listing.of_course(content_root())["ch05"].exercises
    totals = [
        sum(sum(part.values()) for part in entry.parts.values()) + sum(entry.manual.values())
        for entry in map(EXERCISES.__getitem__, listed)
    ]
    assert sum(totals) == 100


@pytest.mark.parametrize("exam", EXERCISES)
def test_each_exercise_has_written_answers_and_its_own_notebook(exam: str) -> None:
    entry = EXERCISES[exam]
    assert entry.manual
    assert all(cell.startswith(f"{exam}-explanation-") for cell in entry.manual)
    assert [other.notebook for other in EXERCISES.values()].count(entry.notebook) == 1


@pytest.mark.parametrize("exam", EXERCISES)
def test_an_exercise_has_20_points_half_of_them_for_checks_that_a_student_sees(exam: str) -> None:
    entry = EXERCISES[exam]
    parts = {name: sum(part.values()) for name, part in entry.parts.items()}
    assert sum(parts.values()) + sum(entry.manual.values()) == pytest.approx(20)
    assert parts["visible"] >= 10


@pytest.mark.parametrize("exam", EXERCISES)
def test_who_breaks_a_check_without_points_loses_those_of_another(exam: str) -> None:
    checks = exercises.load_exam(exam).checks

    def needs(name: str) -> set[str]:
        direct = checks[name].needs
        return {*direct, *(need for other in direct for need in needs(other))}

    worth = {name: n for part in EXERCISES[exam].parts.values() for name, n in part.items()}
    lost_with = {need for name, number in worth.items() if number for need in needs(name)}
    assert {name for name, number in worth.items() if not number} <= lost_with


def test_grade_cells_are_named_by_exam_and_part() -> None:
    assert points.grade_cells()["qos-visible"] == ("qos", "visible")
    assert points.of_grade_cells()["qos-visible"] == sum(points.of_part("qos", "visible").values())
    assert points.of_part("nothing", "visible") == {}
