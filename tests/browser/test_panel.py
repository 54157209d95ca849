"""An operator's panel in a real browser: beside the world, below it on a narrow page, and saved."""

from __future__ import annotations

from collections.abc import Callable

import nbformat
import pytest
from playwright.sync_api import expect

from .lab import Lab
from .notebook_page import NotebookPage

CELLS = (
    'import course\ncourse.session().panel(course.world("corridor"), "navigate", "gripper/set")',
    "",
)
pytestmark = [pytest.mark.timeout(900), pytest.mark.xdist_group("browser")]


@pytest.fixture
def page(lab: Lab, open_notebook: Callable[[str], NotebookPage]) -> NotebookPage:
    cells = [nbformat.v4.new_code_cell(source) for source in CELLS]
    kernel = {"name": "python3", "display_name": "Python 3 (ipykernel)", "language": "python"}
    notebook = nbformat.v4.new_notebook(cells=cells, metadata={"kernelspec": kernel})
    nbformat.write(notebook, lab.work / "panel.ipynb")
    opened = open_notebook("panel.ipynb")
    opened.page.set_viewport_size({"width": 1400, "height": 900})
    opened.run_cell(0)
    return opened


def places(page: NotebookPage) -> list[dict[str, float]]:
    """Return the boxes of the world, the action and the service."""
    names = ("World", "Action view", "Service console")
    boxes = [page.page.get_by_role("region", name=name).bounding_box() for name in names]
    return [dict(box) for box in boxes if box is not None]


def test_instruments_are_beside_the_world_or_below_it_and_work(page: NotebookPage) -> None:
    action = page.page.get_by_role("region", name="Action view")
    expect(action).to_contain_text("Action /navigate")
    world, first, second = places(page)
    assert first["x"] >= world["x"] + world["width"]
    assert second["y"] >= first["y"] + first["height"]
    page.page.get_by_role("button", name="navigator rejects").click()
    action.get_by_label("order").fill("3")
    action.get_by_role("button", name="Send goal").click()
    expect(action).to_contain_text("The server rejected this goal.")
    page.page.set_viewport_size({"width": 1024, "height": 700})
    page.page.wait_for_function(
        """() => {
            const [world, action] = ['world', 'action'].map(
                name => document.querySelector(`.rosview-${name}`).getBoundingClientRect());
            return action.top >= world.bottom && action.left < world.right;
        }"""
    )
    assert page.errors == []


def test_a_saved_notebook_has_all_views_and_a_live_one_none_twice(page: NotebookPage) -> None:
    saved = page.page.locator(".rosview-saved")
    expect(saved).to_have_count(3)
    for copy in saved.all():
        expect(copy).to_be_hidden()
    page.write_cell(1, "course.close()")
    page.run_cell(1)
    page.restart_kernel()
    page.save()
    page.reload()
    expect(saved).to_have_count(3)
    for copy in saved.all():
        expect(copy).to_be_visible()
