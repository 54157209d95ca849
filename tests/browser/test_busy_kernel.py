"""A world's controls while the kernel is busy with a cell.

JupyterLab sends what a widget says to a subshell of the kernel (JEP 91): a thread of its own.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

import nbformat
import pytest
from playwright.sync_api import Locator, expect

from .lab import Lab
from .notebook_page import NotebookPage

pytestmark = [pytest.mark.timeout(900), pytest.mark.xdist_group("browser")]

CELL = """\
import time, course
from std_msgs.msg import String
world = course.world("warehouse")
world
"""

WAITS = {
    "wall time": "time.sleep(600)",
    "a condition": "course.until(lambda: False, 600)",
    "a message": "course.next_message(String, 'never', timeout=600)",
    "nothing": "while True: pass",
}
"""Cells that do not end by themselves, by what they wait for."""


SETTINGS = ("@jupyterlab/apputils-extension", "kernels-settings")


@pytest.fixture
def without_subshells(lab: Lab) -> Iterator[None]:
    """A JupyterLab that sends widgets' messages to the kernel's main shell, as others do."""
    lab.settings(*SETTINGS, {"commsOverSubshells": "disabled"})
    yield
    lab.settings(*SETTINGS, {})


@pytest.fixture
def page(lab: Lab, open_notebook: Callable[[str], NotebookPage]) -> NotebookPage:
    cells = [nbformat.v4.new_code_cell(source) for source in (CELL, "")]
    kernel = {"name": "python3", "display_name": "Python 3 (ipykernel)", "language": "python"}
    notebook = nbformat.v4.new_notebook(cells=cells, metadata={"kernelspec": kernel})
    nbformat.write(notebook, lab.work / "busy.ipynb")
    opened = open_notebook("busy.ipynb")
    opened.run_cell(0)
    return opened


def view_of(page: NotebookPage) -> Locator:
    return page.page.get_by_role("region", name="World")


@pytest.mark.parametrize("what", WAITS)
def test_controls_work_while_a_cell_waits_for(page: NotebookPage, what: str) -> None:
    view = view_of(page)
    expect(view.locator(".rosview-words")).to_contain_text("x 1.00 m")
    page.write_cell(1, WAITS[what])
    page.start_cell(1)
    prompt = page.cell(1).locator(".jp-InputPrompt")
    expect(prompt).to_have_text("[*]:")
    use_controls(page, view)
    expect(prompt).to_have_text("[*]:")
    page.command("notebook:interrupt-kernel")
    expect(page.cell(1)).to_contain_text("KeyboardInterrupt")
    page.write_cell(1, "[[round(x, 1) for x in row] for row in world.make_frame()['obstacles']]")
    page.run_cell(1)
    expect(page.cell(1)).to_contain_text("[[1, 8.2, 3.0, 0.2]]")
    assert page.errors == []


@pytest.mark.usefixtures("without_subshells")
def test_a_view_says_that_the_kernel_is_busy_where_controls_must_wait(page: NotebookPage) -> None:
    view = view_of(page)
    said, pause = view.locator(".rosview-status"), view.get_by_role("button", name="Pause")
    pause.click()
    expect(pause).to_have_attribute("aria-pressed", "true")
    expect(said).to_have_text("")
    page.write_cell(1, "time.sleep(600)")
    page.start_cell(1)
    expect(page.cell(1).locator(".jp-InputPrompt")).to_have_text("[*]:")
    pause.click()
    expect(said).to_have_text(
        "The kernel is busy: what you press is carried out when it is free again."
    )
    expect(pause).to_have_attribute("aria-pressed", "true")
    page.command("notebook:interrupt-kernel")
    expect(pause).to_have_attribute("aria-pressed", "false")
    expect(said).to_have_text("")


def use_controls(page: NotebookPage, view: Locator) -> None:
    """Drive, pause, go on, press the stop, and drag an obstacle."""
    place, said = view.locator("dd").first, view.locator(".rosview-words")
    canvas = view.get_by_role("application", name="warehouse from above")
    canvas.focus()
    page.page.keyboard.down("ArrowUp")
    expect(place).to_have_text(re.compile(r"x 1\.[2-9]"))
    page.page.keyboard.up("ArrowUp")
    for name in ("Pause", "Emergency stop"):
        button = view.get_by_role("button", name=name)
        for pressed in ("true", "false"):
            button.click()
            expect(button).to_have_attribute("aria-pressed", pressed)
    canvas.scroll_into_view_if_needed()
    box = canvas.bounding_box()
    assert box is not None
    metre = box["width"] / 12.24  # of 12 m with a margin on both sides
    across, down = box["x"] + 8.32 * metre, box["y"] + 7.12 * metre
    mouse = page.page.mouse
    mouse.dblclick(across, down)
    expect(said).to_contain_text("1 obstacle.")
    mouse.move(across, down)
    mouse.down()
    mouse.move(across, down - 2 * metre, steps=4)
    mouse.up()
