"""Records the README's moving picture: ``python -m tests.browser.readme_recording``.

The reference design of exercise 2 drives the robot to the dock around an obstacle. It is made of
the view's own pictures, on simulated time, so that it comes out the same each time.
"""

from __future__ import annotations

import io
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from PIL import Image
from playwright.sync_api import Browser, Page

import course
from autograder.assignments import submission
from course.workspace.content import content_root

from . import chromium
from .readme_pictures import PICTURES

EXERCISE, CELLS = "ch05/architecture.ipynb", ("architecture-given", "architecture-solution")
RECORDING = PICTURES / "drive.webp"
OBSTACLE = (6.4, 1.3, 0.25)  # x, y, radius in m
FRAME_S = 0.25  # of the world between two frames
SHOWN_MS = 90  # that a frame is shown: the robot is seen to drive 2.8 times as fast
LAST_MS = 1500
LONGEST_S = 45.0
SIZE = {"width": 640, "height": 430}
MAX_BYTES = 1_000_000


def load_design() -> Any:
    """Return the reference design, from the notebook with its solutions."""
    notebook = submission.read_notebook(content_root() / "source" / EXERCISE)
    cells = {submission.grade_id(cell): cell.source for cell in notebook.cells}
    namespace: dict[str, Any] = {}
    for name in CELLS:
        exec(cells[name].replace("%load_ext course", ""), namespace)
    return namespace["design"]


def drive(design: Any) -> Iterator[str]:
    """Yield pictures of the floor, as SVG, until the robot has arrived."""
    with course.Session(sim_time=True) as session:
        world = session.world("warehouse")
        world.add_obstacle(*OBSTACLE)
        trip = design.drive(world, to="dock")
        yield world.picture()
        while not trip.arrived:
            assert session.sim.now < LONGEST_S, trip
            session.sim.advance(FRAME_S, step=0.05)
            yield world.picture()
        assert not trip.touched, trip


def photograph(page: Page, svg: str) -> Image.Image:
    """Return a picture as the browser draws it."""
    sized = svg.replace("<svg ", '<svg style="width:100%;height:100%" ', 1)
    page.set_content(f'<body style="margin:0;background:#f4f6f8">{sized}</body>')
    return Image.open(io.BytesIO(page.screenshot())).convert("RGB")


def record(browser: Browser, target: Path) -> None:
    """Drive, and write what was seen to a file that a browser plays again and again."""
    page = browser.new_page(viewport=SIZE)
    frames = [photograph(page, svg) for svg in drive(load_design())]
    times = [SHOWN_MS] * (len(frames) - 1) + [LAST_MS]
    frames[0].save(
        target, save_all=True, append_images=frames[1:], duration=times, loop=0,
        quality=60, method=6,
    )  # fmt: skip
    assert target.stat().st_size < MAX_BYTES, target.stat().st_size


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place, chromium.started() as running:
        made = Path(place) / RECORDING.name
        record(running, made)
        RECORDING.write_bytes(made.read_bytes())
