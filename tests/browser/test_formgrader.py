"""The formgrader on our assignment: listed, graded, opened, and given points by hand."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import nbformat
import pytest
from nbgrader.api import Gradebook
from playwright.sync_api import Browser, FrameLocator, Locator, expect

from autograder import corpus
from autograder.assignments import questions, submission
from autograder.assignments.build_notebooks import build
from autograder.corpus.trials import one_notebook
from autograder.examination import points
from autograder.gradebook.release import make_release
from tests.machine import needs_sandbox

from .lab import Lab, until
from .notebook_page import NotebookPage

pytestmark = [
    pytest.mark.timeout(900), pytest.mark.xdist_group("browser: grading"),
    needs_sandbox,
]  # fmt: skip

ASSIGNMENT, NOTEBOOK = "ch05", "qos-design"
EXPLANATIONS = list(points.table()["qos"].manual)


@pytest.fixture
def course_root(tmp_path: Path) -> Path:
    """A course with one exercise, released, and one submission that has not been graded."""
    root = one_notebook(tmp_path / "course", "qos", ASSIGNMENT)
    build(root)
    make_release(root, ASSIGNMENT)
    source, released = (
        submission.read_notebook(root / step / ASSIGNMENT / f"{NOTEBOOK}.ipynb")
        for step in ("source", "release")
    )
    case = next(c for c in corpus.load_cases("qos") if c.name == "wrong-lidar-deep")
    folder = root / "submitted" / "ada" / ASSIGNMENT
    folder.mkdir(parents=True)
    nbformat.write(case.make_submission(source, released), folder / f"{NOTEBOOK}.ipynb")
    return root


@pytest.fixture
def instructor(course_root: Path, tmp_path: Path, browser: Browser) -> Iterator[NotebookPage]:
    """An instructor's window on a JupyterLab that runs in the course root."""
    with Lab(tmp_path, course_root) as lab:
        context = browser.new_context(viewport={"width": 1280, "height": 900})
        yield NotebookPage(lab, context)
        context.close()
        lab.end_kernels()


def formgrader(instructor: NotebookPage) -> FrameLocator:
    """Open the formgrader by JupyterLab's menu."""
    instructor.page.goto(f"{instructor.lab.url}/lab")
    instructor.page.locator("#jupyterlab-splash").wait_for(state="detached")
    instructor.page.get_by_role("menuitem", name="Nbgrader").click()
    instructor.page.get_by_role("menuitem", name="Formgrader", exact=True).click()
    return instructor.page.frame_locator("iframe")


def answer(frame: FrameLocator, cell: str) -> Locator:
    """Return the bar of a written answer, with its buttons."""
    return frame.locator(".panel-heading", has=frame.locator(f"#{cell}"))


def marks(root: Path) -> dict[str, float | None]:
    with Gradebook(f"sqlite:///{root / 'gradebook.db'}") as book:
        handed_in = book.find_submission_notebook(NOTEBOOK, ASSIGNMENT, "ada")
        return {grade.name: grade.manual_score for grade in handed_in.grades}


def test_an_instructor_grades_our_assignment_in_the_formgrader(
    instructor: NotebookPage, course_root: Path
) -> None:
    frame = formgrader(instructor)
    row = frame.get_by_role("row").filter(has=frame.get_by_role("link", name=ASSIGNMENT))
    expect(row.locator(".num-submissions")).to_have_text("1")
    row.locator(".num-submissions a").click()
    ada = frame.get_by_role("row").filter(has_text="ada")
    ada.locator(".autograde a").click()
    said = frame.get_by_role("dialog")
    expect(said).to_contain_text("Successfully autograded 'ch05' for student 'ada'.")
    said.get_by_role("button", name="OK").click()
    expect(ada.locator(".score")).to_have_text("13 / 20")
    expect(ada.locator(".status")).to_contain_text("needs manual grading")

    frame.get_by_role("link", name="Manual Grading").click()
    for link in (ASSIGNMENT, NOTEBOOK, "Submission #1"):
        frame.get_by_role("link", name=link, exact=True).click()
    expect(frame.locator("body")).to_contain_text("qos: 8 of 10 points")
    # Above each answer stands what it should say, and what the points are for.
    source = submission.read_notebook(course_root / "source" / ASSIGNMENT / f"{NOTEBOOK}.ipynb")
    models = [q.model.splitlines()[0] for q in questions.of_notebook(source, NOTEBOOK).values()
              if q.written]  # fmt: skip
    beside = frame.locator(".model-answer")
    expect(beside).to_have_count(len(EXPLANATIONS))
    for number, model in enumerate(models):
        expect(beside.nth(number)).to_contain_text(model.replace("`", ""))
        expect(beside.nth(number)).to_contain_text("2.5 points, or a part of these")
    full, part = EXPLANATIONS
    for cell in EXPLANATIONS:
        # The page asks for the marks after it was drawn; what is given before they came is lost.
        expect(frame.locator(f"#{cell}")).to_have_class(re.compile("needs_manual_grade"))

    def await_marks(given: dict[str, float]) -> None:
        until(
            lambda: marks(course_root).items() >= given.items(),
            60, lambda: f"the points did not reach the gradebook: {marks(course_root)}",
        )  # fmt: skip

    answer(frame, full).get_by_role("button", name="Full credit").click()
    answer(frame, part).get_by_role("button", name="No credit").click()
    await_marks({full: 2.5, part: 0.0})
    frame.locator(f"#{part}").fill("1.5")
    frame.locator(f"#{part}").press("Tab")
    await_marks({full: 2.5, part: 1.5})
    for step in ("autograded", "release"):
        for path in (course_root / step).rglob("*.ipynb"):
            assert not any(model in path.read_text("utf-8") for model in models), path
    # nbgrader's own page asks for MathJax; nothing else leaves the machine, and it works without.
    hosts = {urlsplit(url).hostname for url in instructor.foreign_requests()}
    assert hosts <= {"cdnjs.cloudflare.com"}
