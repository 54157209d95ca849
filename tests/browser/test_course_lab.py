"""``course lab`` as a student meets it: the first view, first messages, the first passed check."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import pytest
from playwright.sync_api import Browser, Locator, expect

from autograder import corpus
from autograder.assignments import submission
from autograder.examination import points
from course.workspace.content import content_root
from course.workspace.journal.progress import WELCOME

from .lab import Lab
from .notebook_page import NotebookPage

pytestmark = [pytest.mark.timeout(900), pytest.mark.xdist_group("browser")]

CHAPTER, EXERCISE = "ch05-building-blocks.ipynb", "ch05/qos-design.ipynb"
SOLUTION, CHECK = "qos-solution", "qos-visible"


@pytest.fixture
def student(course_lab: Lab, browser: Browser) -> Iterator[NotebookPage]:
    """A student's window on the JupyterLab that ``course lab`` has started."""
    context = browser.new_context(viewport={"width": 1280, "height": 900})
    yield NotebookPage(course_lab, context)
    context.close()
    course_lab.end_kernels()


@dataclass(frozen=True)
class Exercise:
    """The first exercise as it is handed out, and a right solution of it."""

    released: str
    solution: str


@pytest.fixture(scope="module")
def exercise(course_lab: Lab) -> Exercise:
    path = course_lab.work / EXERCISE
    source = submission.read_notebook(content_root() / "source" / EXERCISE)
    case = next(c for c in corpus.load_cases("qos") if c.name == "right-chapter")
    right = case.make_submission(source, submission.read_notebook(path))
    (solution,) = (c.source for c in right.cells if submission.grade_id(c) == SOLUTION)
    return Exercise(path.read_text(encoding="utf-8"), solution)


def place(page: NotebookPage, cell_id: str) -> int:
    """Return the place of a cell in the notebook, from 0."""
    ids: list[str] = page.page.evaluate(
        "() => window.jupyterapp.shell.currentWidget.content.widgets.map(cell => cell.model.id)"
    )
    return ids.index(cell_id)


def table(page: NotebookPage, row: str) -> Locator:
    """Return a row of the progress tables in the notebook that is shown."""
    return page.page.locator(".jp-Notebook:visible").get_by_role("row").filter(has_text=row)


def test_from_the_first_minute_to_the_first_passed_check(
    student: NotebookPage, exercise: Exercise, record_timing: Callable[[str, float], None]
) -> None:
    started = time.monotonic()
    student.open_first(str(WELCOME))
    expect(table(student, "Chapter 5")).to_contain_text("0 of ")
    expect(table(student, "Exercise 1")).to_contain_text("not checked yet")
    record_timing("from the browser's first request to the progress page", started)

    opened = time.monotonic()
    link = table(student, "Chapter 5").get_by_role("link")
    student.follow(link, CHAPTER)
    code = [
        number for number, cell in enumerate(student.cells())
        if cell.startswith("%load_ext course") or "check.robot_drives(" in cell
    ]  # fmt: skip
    for number in code:
        student.run_cell(number)
    chapter = student.page.locator(".jp-Notebook:visible")  # the welcome page is open, too
    expect(chapter).to_contain_text("Emergency stop")  # a button of the robot's
    expect(chapter).to_contain_text("Not yet: the robot stands still.")
    record_timing("from opening the chapter to the first live messages", opened)

    student.open(EXERCISE)
    expect(student.page.locator(".validate-button:visible")).to_be_visible()
    expect(student.page.get_by_text("Create Assignment")).to_have_count(0)  # instructors' alone
    student.write_cell(place(student, SOLUTION), exercise.solution)
    for name in ("qos-given", SOLUTION, CHECK):
        student.run_cell(place(student, name))
    expect(student.cell(place(student, CHECK))).to_contain_text("qos: 10 of 10 points")
    record_timing("from the browser's first request to the first passed check", started)

    student.open(str(WELCOME))
    student.run_cell(place(student, _progress_cell(student.lab)))
    expect(table(student, "Chapter 5")).to_contain_text("2 of ")
    expect(table(student, "Exercise 1")).to_contain_text("10 of 10 points (today, ")
    expect(table(student, "Exercise 1")).to_contain_text("nothing")
    assert student.errors == []
    assert student.foreign_requests() == []


def _progress_cell(lab: Lab) -> str:
    cells = json.loads((lab.work / WELCOME).read_text(encoding="utf-8"))["cells"]
    return str(next(cell["id"] for cell in cells if cell["cell_type"] == "code"))


def test_the_progress_page_can_be_read_in_both_themes_and_by_a_screen_reader(
    student: NotebookPage,
) -> None:
    student.open(str(WELCOME))
    page = student.page.locator(".jp-Notebook:visible .jp-RenderedMarkdown:has(table)")
    snapshot = page.aria_snapshot().replace("- '", "- ")  # YAML's quotes
    assert '- columnheader "Visible checks"' in snapshot
    assert '- link "Exercise 1: QoS profile design"' in snapshot
    for theme, dark in (("JupyterLab Dark", True), ("JupyterLab Light", False)):
        student.theme(theme)
        colours = page.evaluate(
            "element => [getComputedStyle(element.querySelector('td')).color,"
            " getComputedStyle(document.querySelector('.jp-Notebook')).backgroundColor]"
        )
        text, ground = (sum(map(float, c[c.index("(") + 1 : -1].split(",")[:3])) for c in colours)
        assert (text > ground) == dark


def validate(page: NotebookPage) -> str:
    """Press nbgrader's Validate button; return what its dialog says."""
    page.page.locator(".validate-button:visible").click()
    dialog = page.page.get_by_role("dialog")
    dialog.wait_for()
    said = dialog.inner_text()
    dialog.get_by_role("button", name="Ok").click()
    return said


def test_the_validate_button_fails_the_stub_with_our_report_and_passes_the_exemplar(
    student: NotebookPage, exercise: Exercise
) -> None:
    copy = student.lab.work / "ch05" / "validate.ipynb"
    copy.write_text(exercise.released, encoding="utf-8")
    student.open("ch05/validate.ipynb")
    failed = validate(student)
    assert "The following cells failed" in failed or "The following cell failed" in failed
    assert 'check("qos")' in failed
    print(failed)  # noqa: T201
    student.write_cell(place(student, SOLUTION), exercise.solution)
    for cell in points.table()["qos"].manual:
        student.write_cell(place(student, cell), "A late frame is worse than a lost one.")
    assert "Success! Your notebook passes all the tests." in validate(student)
    assert student.errors == []
