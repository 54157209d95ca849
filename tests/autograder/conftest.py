"""A course root as an instructor has it: built, released, ready to collect submissions."""

from __future__ import annotations

import shutil
import time
from dataclasses import dataclass
from pathlib import Path

import nbformat
import pytest
from nbformat import NotebookNode

from autograder import corpus, submission
from autograder.build import build
from autograder.corpus import Case
from autograder.corpus.trials import one_notebook
from autograder.gradebook import Grade
from autograder.release import release
from tests.killing import Engine, fresh_copy

SUBMISSIONS = Path(__file__).parents[1] / "submissions"
ASSIGNMENT, NOTEBOOK = "ch05", "qos-design"


@dataclass(frozen=True)
class Course:
    """A released course in a folder of its own."""

    root: Path

    @property
    def source(self) -> NotebookNode:
        return submission.read(self.root / "source" / ASSIGNMENT / f"{NOTEBOOK}.ipynb")

    @property
    def released(self) -> NotebookNode:
        return submission.read(self.root / "release" / ASSIGNMENT / f"{NOTEBOOK}.ipynb")

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


@pytest.fixture(scope="session")
def released_course(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = one_notebook(tmp_path_factory.mktemp("course"), "qos")
    build(root)
    release(root, ASSIGNMENT)
    return root


@pytest.fixture
def course(released_course: Path, tmp_path: Path) -> Course:
    root = tmp_path / "course"
    shutil.copytree(released_course, root)
    return Course(root)


@pytest.fixture(scope="session")
def cases() -> dict[str, Case]:
    return {case.name: case for case in corpus.load(SUBMISSIONS, "qos")}


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
        course.submit(student, cases[case].submission(course.source, course.released))
    course.submit("cut-off", "{")
    whole = Engine(fresh_copy(course.root, folder / "graded"), ASSIGNMENT, folder / "scratch")
    started = time.monotonic()
    whole.finish()
    return Undisturbed(course.root, whole.root, whole.grades(), time.monotonic() - started)
