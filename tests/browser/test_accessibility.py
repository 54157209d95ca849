"""Axe-core finds nothing but trifles in a chapter, an exercise, a quiz and a feedback page.

It looks for texts of too little contrast, controls without a name, roles that do not fit, and so
on. In a notebook only texts and outputs are ours; what is around them is JupyterLab's.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import nbformat
import pytest
from playwright.sync_api import Browser, Locator, expect

from autograder import corpus
from autograder.assignments import submission
from autograder.assignments.build_notebooks import build
from autograder.corpus.trials import one_notebook
from autograder.gradebook.release import make_release
from autograder.grading import engine
from tests.machine import needs_sandbox

from .accessibility import find_grave
from .lab import Lab
from .notebook_page import NotebookPage

pytestmark = [pytest.mark.timeout(900), pytest.mark.xdist_group("browser")]

TEXTS, OUTPUTS = ".jp-Notebook .jp-RenderedMarkdown", ".jp-Notebook .jp-OutputArea-output"
THEMES = ("JupyterLab Dark", "JupyterLab Light")
TRACKER = ("@jupyterlab/notebook-extension", "tracker")


@pytest.fixture(scope="module")
def own_lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    """A lab on a working copy that nobody shares: all of its chapter is run here."""
    folder = tmp_path_factory.mktemp("accessible")
    with Lab(folder, folder / "mine", by_course=True) as running:
        yield running


@pytest.fixture
def student(own_lab: Lab, browser: Browser) -> Iterator[NotebookPage]:
    """A student's window on a working copy, in which a notebook is on the page from end to end."""
    own_lab.settings(*TRACKER, {"windowingMode": "none"})
    context = browser.new_context(viewport={"width": 1280, "height": 900})
    yield NotebookPage(own_lab, context)
    context.close()
    own_lab.end_kernels()
    own_lab.settings(*TRACKER, {})


def test_what_shuts_people_out_is_found(browser: Browser) -> None:
    page = browser.new_page()
    page.set_content('<main><button></button><p style="color: #ccc">Hardly seen</p></main>')
    found = [finding.partition(":")[0] for finding in find_grave(page, "main")]
    assert sorted(found) == ["button-name", "color-contrast"]
    page.close()


def require_accessible(student: NotebookPage) -> None:
    for theme in THEMES:
        student.theme(theme)
        assert find_grave(student.page, TEXTS, OUTPUTS) == [], theme


@pytest.mark.parametrize(
    ("path", "shows"),
    [
        ("ch05-building-blocks.ipynb", "Emergency stop"),
        ("ch05/resources.ipynb", "resources: 0 of 10 points"),
    ],
    ids=["chapter", "exercise"],
)
def test_a_notebook_whose_cells_have_run(student: NotebookPage, path: str, shows: str) -> None:
    student.open(path)
    student.run_all()
    expect(student.page.locator(".jp-Notebook")).to_contain_text(shows)
    require_accessible(student)


def test_a_quiz_before_and_after_it_is_submitted(student: NotebookPage) -> None:
    student.open("ch05-quiz/quiz.ipynb")
    student.run_all()
    quiz = student.page.locator(".quiz")
    expect(quiz.locator("fieldset").first).to_be_visible()
    require_accessible(student)
    answer_anything(quiz)
    quiz.get_by_role("button", name="Submit answers").click()
    expect(quiz.locator(".quiz-result")).to_be_visible()
    require_accessible(student)


def answer_anything(quiz: Locator) -> None:
    """Give each question of a quiz an answer, right or wrong."""
    for question in quiz.locator("fieldset").all():
        for choice in question.locator("input[type=radio], input[type=checkbox]").all()[:1]:
            choice.check()
        for number in question.locator("input[type=number]").all():
            number.fill("3")
        for places in question.locator("select").all():
            places.select_option(index=1)


@needs_sandbox
def test_a_feedback_page_and_the_page_that_leads_to_it(browser: Browser, tmp_path: Path) -> None:
    root = one_notebook(tmp_path / "course", "qos", "ch05")
    build(root)
    make_release(root, "ch05")
    source, released = (
        submission.read_notebook(root / step / "ch05" / "qos-design.ipynb")
        for step in ("source", "release")
    )
    case = next(case for case in corpus.load_cases("qos") if case.name == "wrong-lidar-deep")
    folder = root / "submitted" / "ada" / "ch05"
    folder.mkdir(parents=True)
    nbformat.write(case.make_submission(source, released), folder / "qos-design.ipynb")
    engine.grade(root, "ch05")
    page = browser.new_page()
    for name in ("index.html", "qos-design.html"):
        page.goto((root / "feedback" / "ada" / "ch05" / name).as_uri())
        assert find_grave(page) == [], name
    page.close()
