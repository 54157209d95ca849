"""Exercise 2's "Try it" in a real browser: a design drives the robot, and says how that goes."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path

import nbformat
import pytest
from playwright.sync_api import expect

from autograder.assignments import submission
from course.workspace.content import content_root

from .lab import Lab
from .notebook_page import NotebookPage

EXERCISE = content_root() / "source" / "ch05" / "architecture.ipynb"
pytestmark = [pytest.mark.timeout(900), pytest.mark.xdist_group("browser")]


@pytest.fixture
def page(lab: Lab, open_notebook: Callable[[str], NotebookPage]) -> NotebookPage:
    """A notebook of the exercise's given cell, the reference design, and what "Try it" says."""
    notebook = submission.read_notebook(EXERCISE)
    cells = {submission.grade_id(cell): cell.source for cell in notebook.cells}
    (tried,) = re.findall(r"```python\n(.*?)```", cells["architecture-try-it"], re.DOTALL)
    sources = cells["architecture-given"], cells["architecture-solution"], tried
    kernel = {"name": "python3", "display_name": "Python 3 (ipykernel)", "language": "python"}
    written = nbformat.v4.new_notebook(
        cells=[nbformat.v4.new_code_cell(source) for source in sources],
        metadata={"kernelspec": kernel},
    )
    nbformat.write(written, lab.work / "drive.ipynb")
    return open_notebook("drive.ipynb")


def test_a_design_drives_the_robot_to_the_dock_before_ones_eyes(page: NotebookPage) -> None:
    page.run_all()
    page.scroll_to(2)
    trip, world = page.page.get_by_role("status"), page.page.get_by_role("region", name="World")
    expect(trip.get_by_text("The robot is on its way to dock.")).to_be_visible()
    words = world.locator(".rosview-words")
    expect(words).to_contain_text("The planned path has")
    expect(words).to_contain_text("Your nodes found")
    if folder := os.environ.get("WORLD_PICTURES"):
        page.screenshot(Path(folder) / "drive.png")
    expect(trip.get_by_text("The robot arrived at dock after")).to_be_visible()
    expect(words).to_contain_text("The robot arrived at dock")
    assert page.errors == []
