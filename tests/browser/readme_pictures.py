"""Takes the pictures of the README: ``python -m tests.browser.readme_pictures``.

One shows a check of a student whose LIDAR has the wrong QoS, the other the report of the demo's
class.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import nbformat
from playwright.sync_api import Browser

from autograder import corpus
from autograder.assignments import submission
from autograder.class_report.report_files import make_report, write_report
from autograder.commands import demo_command
from course.workspace.content import content_root

from . import chromium
from .lab import Lab
from .notebook_page import NotebookPage

PICTURES = Path(__file__).resolve().parents[2] / ".pictures"
EXERCISE, CASE = "ch05/qos-design.ipynb", "wrong-lidar-deep"
CELLS = ("qos-given", "qos-solution", "qos-visible")
SCALE = 1.5  # pixels of the picture for one of the page: sharp where a page is zoomed


def picture_check(browser: Browser, folder: Path) -> None:
    """Take a picture of a check that has found a fault."""
    with Lab(folder, folder / "mine", by_course=True) as lab:
        path = lab.work / EXERCISE
        source = submission.read_notebook(content_root() / "source" / EXERCISE)
        released = submission.read_notebook(path)
        case = next(case for case in corpus.load_cases("qos") if case.name == CASE)
        nbformat.write(case.make_submission(source, released), path)
        context = browser.new_context(
            viewport={"width": 1100, "height": 760}, device_scale_factor=SCALE
        )
        page = NotebookPage(lab, context)
        page.open(EXERCISE)
        page.command("application:toggle-left-area")
        ids = [submission.grade_id(cell) for cell in submission.read_notebook(path).cells]
        for name in CELLS:
            page.run_cell(ids.index(name))
        page.scroll_to(ids.index(CELLS[-1]))
        page.screenshot(PICTURES / "check.png")
        context.close()


def picture_report(browser: Browser, folder: Path) -> None:
    """Take a picture of the report on the demo's class."""
    course = demo_command.run_demo(folder / "demo").root
    written, *_ = write_report(make_report(course, demo_command.ASSIGNMENT))
    context = browser.new_context(
        viewport={"width": 1000, "height": 1000}, device_scale_factor=SCALE
    )
    page = context.new_page()
    page.goto(written.as_uri())
    page.screenshot(path=PICTURES / "report.png")
    context.close()


if __name__ == "__main__":
    PICTURES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as place, chromium.started() as running:
        picture_check(running, Path(place))
        picture_report(running, Path(place))
