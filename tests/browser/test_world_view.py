"""The world in a real browser: it moves, takes keys and clicks, fits, and is told in words."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path

import nbformat
import pytest
from playwright.sync_api import Locator, expect

from .lab import Lab
from .notebook_page import NotebookPage

CELL = """\
import course
world = course.world("warehouse")
world
"""

pytestmark = [pytest.mark.timeout(900), pytest.mark.xdist_group("browser")]

FITS = """element => {
    const area = element.closest('.jp-OutputArea-output').getBoundingClientRect();
    const stage = element.querySelector('.rosview-stage');
    const parts = [element, ...element.querySelectorAll('button, select, canvas')];
    return parts.every(part => part.getBoundingClientRect().right <= area.right + 1) &&
        stage.scrollWidth <= stage.clientWidth + 1;
}"""
"""Whether a view and all that is in it end within its place."""

COLOURS = """canvas => new Set(
    canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data
).size"""
"""How many different values the picture's bytes have: a blank one has two."""


@pytest.fixture
def page(lab: Lab, open_notebook: Callable[[str], NotebookPage]) -> NotebookPage:
    cells = [nbformat.v4.new_code_cell(source) for source in (CELL, "")]
    kernel = {"name": "python3", "display_name": "Python 3 (ipykernel)", "language": "python"}
    notebook = nbformat.v4.new_notebook(cells=cells, metadata={"kernelspec": kernel})
    nbformat.write(notebook, lab.work / "world.ipynb")
    opened = open_notebook("world.ipynb")
    opened.run_cell(0)
    return opened


def view_of(page: NotebookPage) -> Locator:
    return page.page.get_by_role("region", name="World")


def canvas_of(page: NotebookPage) -> Locator:
    return view_of(page).get_by_role("application", name="warehouse from above")


def take_picture(page: NotebookPage, name: str) -> None:
    """Write a picture to the folder that WORLD_PICTURES names, if it does."""
    if folder := os.environ.get("WORLD_PICTURES"):
        view_of(page).screenshot(path=Path(folder) / f"world-{name}.png")


def test_keys_drive_the_stop_stops_and_a_fault_is_a_button(page: NotebookPage) -> None:
    view, keyboard = view_of(page), page.page.keyboard
    said, place = view.locator(".rosview-words"), view.locator("dd").first
    expect(said).to_contain_text("x 1.00 m, y 1.00 m")
    canvas = canvas_of(page)
    expect(canvas).to_have_accessible_description(re.compile("Arrow keys drive"))
    assert canvas.evaluate(COLOURS) > 20
    canvas.focus()
    before = page.cells()
    keyboard.down("ArrowUp")
    expect(place).to_have_text(re.compile(r"x 1\.[3-9]"))
    expect(said).to_contain_text("driving forwards")
    stop = view.get_by_role("button", name="Emergency stop")
    expect(stop).to_have_attribute("aria-pressed", "false")
    keyboard.press("Space")
    expect(stop).to_have_attribute("aria-pressed", "true")
    expect(said).to_contain_text("standing")
    expect(said).to_contain_text("Emergency stop pressed")
    keyboard.up("ArrowUp")
    stop.click()
    expect(stop).to_have_attribute("aria-pressed", "false")
    canvas.focus()
    keyboard.down("ArrowUp")
    expect(said).to_contain_text("driving forwards")
    keyboard.up("ArrowUp")
    expect(said).to_contain_text("standing")
    assert page.cells() == before, "no key has reached the notebook"
    fault = view.get_by_role("button", name="wheels jammed")
    fault.click()
    expect(fault).to_have_attribute("aria-pressed", "true")
    expect(said).to_contain_text("Faults: wheels jammed.")
    fault.click()
    expect(fault).to_have_attribute("aria-pressed", "false")
    expect(said).to_contain_text("Faults: none.")
    assert page.errors == []
    assert page.foreign_requests() == []


def test_obstacles_are_added_dragged_and_moved_by_keys(page: NotebookPage) -> None:
    view, mouse, canvas = view_of(page), page.page.mouse, canvas_of(page)
    said, chosen = view.locator(".rosview-words"), view.get_by_label("Obstacle", exact=True)
    expect(said).to_contain_text("0 obstacles")
    canvas.scroll_into_view_if_needed()
    box = canvas.bounding_box()
    assert box is not None
    metre = box["width"] / 12.24  # of 12 m with a margin on both sides

    def point(x: float, y: float) -> tuple[float, float]:
        return box["x"] + (x + 0.12) * metre, box["y"] + (8.12 - y) * metre

    mouse.dblclick(*point(8.2, 1.0))
    expect(said).to_contain_text("1 obstacle.")
    mouse.move(*point(8.2, 1.0))
    mouse.down()
    mouse.move(*point(8.2, 3.0), steps=4)
    mouse.up()
    expect_obstacle(page, 8.2, 3.0)
    canvas.focus()
    page.page.keyboard.press("Shift+ArrowLeft")
    expect_obstacle(page, 8.1, 3.0)
    view.get_by_role("button", name="Add one in front").click()
    expect(said).to_contain_text("2 obstacles")
    expect(chosen.locator("option")).to_have_count(2)
    canvas.focus()
    page.page.keyboard.press("Delete")
    expect(said).to_contain_text("1 obstacle.")
    assert page.errors == []


def expect_obstacle(page: NotebookPage, x: float, y: float) -> None:
    """Wait in the kernel until the only obstacle is at a place, to 5 cm."""
    near = f"abs(o[0][1] - {x}) < 0.05 and abs(o[0][2] - {y}) < 0.05"
    page.write_cell(
        1, f"course.until(lambda: [1 for o in [world.make_frame()['obstacles']] if {near}])"
    )
    page.run_cell(1)
    expect(page.cell(1)).to_contain_text("[1]")


def test_topics_show_what_they_carry_and_time_stands_still(page: NotebookPage) -> None:
    view = view_of(page)
    view.get_by_text("What the topics carry").click()
    scan = view.get_by_role("button", name="/scan")
    expect(scan).to_have_attribute("aria-expanded", "false")
    scan.click()
    expect(scan).to_have_attribute("aria-expanded", "true")
    expect(view.locator("tr", has=page.page.locator("pre")).locator("visible=true")).to_have_text(
        re.compile(r"\d m")
    )
    pause, time = view.get_by_role("button", name="Pause"), view.locator(".rosworld-time")
    pause.click()
    expect(pause).to_have_attribute("aria-pressed", "true")
    expect(time).to_contain_text("paused")
    shown = time.inner_text()
    view.get_by_role("button", name="Step 0.1 s").click()
    expect(time).not_to_have_text(shown)
    pause.click()
    expect(time).not_to_contain_text("paused")
    assert page.errors == []


def test_nothing_is_cut_off_and_both_themes_have_their_colours(page: NotebookPage) -> None:
    view, canvas = view_of(page), canvas_of(page)
    expect(view.locator(".rosview-words")).to_contain_text("Warehouse")
    view.get_by_text("What the topics carry").click()
    floor = "canvas => [...canvas.getContext('2d').getImageData(3, 3, 1, 1).data.slice(0, 3)]"
    take_picture(page, "light")
    light = canvas.evaluate(floor)
    page.theme("JupyterLab Dark")
    page.page.wait_for_function(
        "([canvas, light]) => canvas.getContext('2d').getImageData(3, 3, 1, 1).data[0] < light / 2",
        arg=[canvas.element_handle(), light[0]],
    )
    take_picture(page, "dark")
    page.theme("JupyterLab Light")
    for name, width in (("1024", 1024), ("200", 640)):  # and 1280 at 200 %
        page.page.set_viewport_size({"width": width, "height": 768})
        page.page.wait_for_function(f"element => ({FITS})(element)", arg=view.element_handle())
        take_picture(page, name)


def test_a_saved_notebook_shows_the_last_picture(page: NotebookPage) -> None:
    view = view_of(page)
    seen = "course.until(lambda: '1 ob' in world.widget.words)"
    page.write_cell(1, f"world.add_obstacle(4, 1)\n{seen}\ncourse.close()")
    page.run_cell(1)
    expect(view.locator(".rosview-status")).to_contain_text("The session has been closed.")
    for control in view.locator("button, select").all():
        expect(control).to_be_disabled()
    page.restart_kernel()
    page.save()
    page.reload()
    saved = page.page.locator(".rosview-saved")
    expect(saved).to_contain_text("1 obstacle.")
    picture = saved.get_by_role("img", name="World")
    expect(picture).to_be_visible()
    assert picture.evaluate("image => image.naturalWidth") == 720
