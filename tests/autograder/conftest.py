"""A course root as an instructor has it: built, released, ready to collect submissions."""

from __future__ import annotations

import itertools
import shutil
import time
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import nbformat
import pytest
from nbformat import NotebookNode
from nbgrader.api import Gradebook

from autograder import corpus
from autograder.assignments import submission
from autograder.assignments.build_notebooks import build
from autograder.corpus import Case
from autograder.corpus.trials import one_notebook
from autograder.examination import points
from autograder.gradebook.course_gradebook import Grade
from autograder.gradebook.release import make_release
from autograder.grading import engine
from autograder.observe.examiner.spinner import Spinner
from course import Session
from tests.killing import Engine, fresh_copy
from tests.left_out import leave_out
from tests.machine import sandbox_problem

ASSIGNMENT, NOTEBOOK = "ch05", "qos-design"


@dataclass(frozen=True)
class Course:
    """A released course in a folder of its own."""

    root: Path

    @property
    def source(self) -> NotebookNode:
        return submission.read_notebook(self.root / "source" / ASSIGNMENT / f"{NOTEBOOK}.ipynb")

    @property
    def released(self) -> NotebookNode:
        return submission.read_notebook(self.root / "release" / ASSIGNMENT / f"{NOTEBOOK}.ipynb")

    def folder(self, student: str) -> Path:
        folder = self.root / "submitted" / student / ASSIGNMENT
        folder.mkdir(parents=True, exist_ok=True)
        return folder

    def submit(self, student: str, notebook: NotebookNode | str) -> Path:
        path = self.folder(student) / f"{NOTEBOOK}.ipynb"
        if isinstance(notebook, str):
            path.write_text(notebook, encoding="utf-8")
        else:
            nbformat.write(notebook, path)
        return path


@pytest.fixture
def session() -> Iterator[Session]:
    """A session of rclpy in this process."""
    with Session() as session:
        yield session


@pytest.fixture
def spinner(session: Session) -> Iterator[Spinner]:
    """What runs the callbacks of an examiner's nodes, in that session's context."""
    with closing(Spinner(session.context)) as spinner:
        yield spinner


@pytest.fixture(scope="session")
def released_course(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = one_notebook(tmp_path_factory.mktemp("course"), "qos", ASSIGNMENT)
    build(root)
    make_release(root, ASSIGNMENT)
    return root


@pytest.fixture
def course(released_course: Path, tmp_path: Path) -> Course:
    root = tmp_path / "course"
    shutil.copytree(released_course, root)
    return Course(root)


@pytest.fixture(scope="session")
def cases() -> dict[str, Case]:
    return {case.name: case for case in corpus.load_cases("qos")}


@dataclass(frozen=True)
class Undisturbed:
    """A class before and after it was graded by an engine that nobody disturbed."""

    ungraded: Path
    graded: Path
    grades: dict[str, Grade]
    seconds: float


@pytest.fixture(scope="session")
def class_(
    released_course: Path, cases: dict[str, Case], tmp_path_factory: pytest.TempPathFactory
) -> Undisturbed:
    folder = tmp_path_factory.mktemp("class")
    course = Course(fresh_copy(released_course, folder / "ungraded"))
    for student, case in {"right": "right-chapter", "same": "right-chapter",
                          "wrong": "wrong-imu-single"}.items():  # fmt: skip
        course.submit(student, cases[case].make_submission(course.source, course.released))
    course.submit("cut-off", "{")
    whole = Engine(fresh_copy(course.root, folder / "graded"), ASSIGNMENT, folder / "scratch")
    started = time.monotonic()
    whole.finish()
    return Undisturbed(course.root, whole.root, whole.grades(), time.monotonic() - started)


PEOPLE = {
    "ann": ("Ann", "O'Hara"), "bob": ("Bob", "<b>Bee"), "cy": ("Cy", "Young"),
    "-dan": ("Dan", "Dent"), "eve": ("Eve", "Ever"), "late": ("Lee", "Late"),
    "zoe": ("Zoe", "Zest"),
}  # fmt: skip
"""The class of `graded_course`: "late" hands in after the grading, "zoe" never."""


def mark_written_answers(course: Course, *students: str) -> None:
    with Gradebook(f"sqlite:///{course.root / 'gradebook.db'}") as book:
        for student, cell in itertools.product(students, points.table()["qos"].manual):
            entry = book.find_grade(cell, NOTEBOOK, ASSIGNMENT, student)
            entry.manual_score, entry.needs_manual_grade = 1.25, False  # half of what it is worth
        book.db.commit()


@pytest.fixture(scope="session")
def graded_course(
    released_course: Path, cases: dict[str, Case], tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """A class that was really graded, with names and a due date; half of it waits for marks."""
    if problem := sandbox_problem():
        leave_out(problem)
    course = Course(Path(shutil.copytree(
        released_course, tmp_path_factory.mktemp("graded") / "course"
    )))  # fmt: skip
    with Gradebook(f"sqlite:///{course.root / 'gradebook.db'}") as book:
        book.update_or_create_assignment(ASSIGNMENT, duedate="2026-04-30 12:00:00 UTC")
        for student, (first, last) in PEOPLE.items():
            book.add_student(student, first_name=first, last_name=last)
    for student, case in {
        "ann": "right-two-sides", "bob": "wrong-imu-endless", "cy": "wrong-imu-endless",
        "-dan": "right-two-sides",
    }.items():  # fmt: skip
        notebook = cases[case].make_submission(course.source, course.released)
        notebook.metadata["authors"] = [{"name": student}]  # no two files are the same
        course.submit(student, notebook)
    (course.folder("ann") / "timestamp.txt").write_text("2026-04-30 14:05:00 UTC")
    course.submit("eve", "{" + '"cells": [')
    engine.grade(course.root, ASSIGNMENT)
    mark_written_answers(course, "ann", "-dan")
    engine.grade(course.root, ASSIGNMENT)
    course.folder("late")
    return course.root


@pytest.fixture
def graded(graded_course: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(graded_course, tmp_path / "graded"))
