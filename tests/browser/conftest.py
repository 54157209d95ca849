"""A real browser on a real JupyterLab: one of each for all tests, a window and a kernel for each.

The browser is the machine's Chromium, or one that Playwright fetches. Where that cannot be done the
tests are left out with the reason, and fail in CI.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from tests.left_out import leave_out

from . import chromium
from .lab import Lab
from .notebook_page import TIMEOUT, NotebookPage

expect.set_options(timeout=TIMEOUT)


@pytest.fixture(scope="session")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    with Lab(tmp_path_factory.mktemp("lab")) as running:
        yield running


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    with ExitStack() as stack:
        try:
            browser = stack.enter_context(chromium.started())
        except chromium.NoBrowserError as error:
            leave_out(str(error))
        yield browser


@pytest.fixture(scope="session")
def course_lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    """A JupyterLab that ``course lab`` has started on a working copy of its own."""
    folder = tmp_path_factory.mktemp("course-lab")
    with Lab(folder, folder / "mine", by_course=True) as running:
        yield running


@pytest.fixture
def record_timing(record_property: Callable[[str, object], None]) -> Callable[[str, float], None]:
    """Return a function that prints how long something took, and keeps it in a test report.

    A timing is never asserted: this machine may be busy.
    """

    def record(what: str, started: float) -> None:
        seconds = round(time.monotonic() - started, 1)
        print(f"{what}: {seconds} s")  # noqa: T201 - for whoever reads the test's log
        record_property(what, seconds)

    return record


OpenNotebook = Callable[[Path | str], NotebookPage]


@pytest.fixture
def open_notebook(lab: Lab, browser: Browser, tmp_path: Path) -> Iterator[OpenNotebook]:
    """Open notebooks of the work folder; each call gives a window of its own."""
    context = browser.new_context(viewport={"width": 1280, "height": 900})
    pages: list[NotebookPage] = []

    def open_(path: Path | str) -> NotebookPage:
        pages.append(NotebookPage(lab, context))
        pages[-1].open(str(path))
        return pages[-1]

    yield open_
    context.close()
    lab.end_kernels()
