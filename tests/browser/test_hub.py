"""A class on a hub: released, fetched, worked on, submitted, collected, graded, and told."""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path

import nbformat
import pytest
from playwright.sync_api import Browser, BrowserContext, Page, expect

from autograder import corpus
from autograder.assignments import listing, submission
from tests.browser import hub as hubs
from tests.machine import needs_isolation, needs_users

from .hub import Hub, StudentClient
from .lab import until
from .notebook_page import NotebookPage

pytestmark = [
    pytest.mark.timeout(900), pytest.mark.xdist_group("browser: grading"),
    pytest.mark.needs(hubs.problem()), needs_isolation, needs_users,
]  # fmt: skip

COURSE, OTHER, ASSIGNMENT, NOTEBOOK = "robots-a", "robots-b", "ch05", "qos-design"
STUDENTS = {"ana": "right-chapter", "ben": "right-sensor-data", "cleo": "wrong-stop-64"}
"""{student: the case of the corpus that they hand in}; the first works in the browser."""

PICTURES = os.environ.get("HUB_PICTURES", "")
"""A folder to put pictures of the pages into."""


def test_a_class_works_on_a_hub(
    tmp_path: Path, browser: Browser, record_timing: Callable[[str, float], None]
) -> None:
    started = time.monotonic()
    people = {"instructors": ["ida", "ivo"], "students": list(STUDENTS)}
    hub = Hub(tmp_path / "server", {COURSE: people, OTHER: {"instructors": ["ivo"]}})
    prepare_machine(hub)
    with hub:
        record_timing("until the hub was up", started)
        ida, ana = (browser.new_context(viewport={"width": 1280, "height": 900}) for _ in "ab")
        hub.sign_in(ida, "ida")
        release(hub, ida)
        clients = {name: StudentClient(hub, name) for name in list(STUDENTS)[1:]}
        hub.sign_in(ana, "ana")
        fetch_in_browser(hub, ana)
        for name, client in clients.items():
            hand_in(hub, name, client)
        work_in_browser(hub, ana)
        record_timing("until all had handed in", started)
        grade(hub)
        record_timing("until all had their feedback", started)
        see_feedback(hub, ana, clients)
        see_grades(hub, ida)
    record_timing("all", started)


def prepare_machine(hub: Hub) -> None:
    """Do what the README that `autograder new hub` writes says, and hear the hub until then."""
    assert "There is no exchange at" in refusal(hub)
    hub.exchange.mkdir()
    hub.exchange.chmod(0o755)
    assert f"Not everybody may write {hub.exchange}" in refusal(hub)
    hub.exchange.chmod(0o777)
    assert f"There is no course {COURSE} at" in refusal(hub)
    for course, grader in hubs.GRADERS.items():
        new = ["new", "course", str(hub.course_root(course)), "--course-id", course]
        tool = str(hubs.TOOLS / "autograder")
        hub.people.run(grader, tool, *new, "--exchange", str(hub.exchange))
    listing.write_list(hub.course_root(COURSE), ASSIGNMENT, ["qos"])
    hub.people.give(hubs.GRADERS[COURSE], hub.course_root(COURSE))
    hub.run_as_grader(COURSE, "autograder", "build")
    hub.run_as_grader(COURSE, "autograder", "release", ASSIGNMENT)


def refusal(hub: Hub) -> str:
    """Start the hub, which must not run; return its sentence."""
    said = hub.people.run("root", sys.executable, "-m", "jupyterhub", cwd=hub.folder, code=1)
    [sentence] = [line for line in said.splitlines() if line.startswith("jupyterhub: ")]
    assert "Traceback" not in said
    return sentence


def release(hub: Hub, context: BrowserContext) -> None:
    """Have the instructor release in the formgrader; somebody else's course is closed to her."""
    page = context.new_page()
    page.goto(f"{hub.url}/services/{COURSE}/")
    page.wait_for_url("**/formgrader/manage_assignments")
    row = page.get_by_role("row", name=ASSIGNMENT)
    row.locator(".release a").click()
    expect(page.locator(".modal-body")).to_contain_text("Successfully released", timeout=60_000)
    page.locator(".modal-footer button").first.click()
    expect(row.locator(".status")).to_contain_text("released")
    expect(page.locator(".modal-backdrop")).to_have_count(0)
    take_picture(page, "formgrader-released")
    answer = page.goto(f"{hub.url}/services/{OTHER}/formgrader")
    assert answer is not None
    assert answer.status == 403
    page.close()


def fetch_in_browser(hub: Hub, context: BrowserContext) -> None:
    """Have the first student find the course's chapter, and fetch in her assignment list."""
    page = context.new_page()
    page.goto(f"{hub.url}/hub/spawn")
    page.wait_for_url(f"**/user/ana/lab/tree/{COURSE}/start-here.ipynb", timeout=120_000)
    page.locator("#jupyterlab-splash").wait_for(state="detached")
    copy = hub.people["ana"].home / COURSE
    assert (copy / "ch05-building-blocks.ipynb").is_file()
    open_list(page)
    page.get_by_role("button", name="Fetch", exact=True).click()
    expect(page.get_by_role("button", name="Submit", exact=True)).to_be_visible()
    take_picture(page, "assignment-list-fetched")
    assert (copy / ASSIGNMENT / f"{NOTEBOOK}.ipynb").is_file()
    page.close()


def open_list(page: Page) -> None:
    """Open the assignment list by JupyterLab's menu."""
    page.get_by_role("menuitem", name="Nbgrader").click()
    page.get_by_role("menuitem", name="Assignment List", exact=True).click()


def hand_in(hub: Hub, name: str, client: StudentClient) -> None:
    """Have a student fetch, work in a way that the corpus knows, and submit."""
    [found] = client.assignments(COURSE)
    assert (found["status"], found["assignment_id"]) == ("released", ASSIGNMENT)
    assert client.assignments(OTHER) == []  # the student does not take that course
    client.act("fetch", COURSE, ASSIGNMENT)
    file = hub.people[name].home / COURSE / ASSIGNMENT / f"{NOTEBOOK}.ipynb"
    nbformat.write(handed_in(hub, name), file)
    hub.people.give(name, file)
    listed = client.act("submit", COURSE, ASSIGNMENT)
    assert "submitted" in {one["status"] for one in listed}


def handed_in(hub: Hub, name: str) -> nbformat.NotebookNode:
    """Return what a student hands in."""
    source, released = (
        submission.read_notebook(hub.course_root(COURSE) / step / ASSIGNMENT / f"{NOTEBOOK}.ipynb")
        for step in ("source", "release")
    )
    case = next(c for c in corpus.load_cases("qos") if c.name == STUDENTS[name])
    return case.make_submission(source, released)


def work_in_browser(hub: Hub, context: BrowserContext) -> None:
    """Have the first student write her work, check it, and submit by the list's button."""
    window = NotebookPage(hub.server_of("ana"), context)  # type: ignore[arg-type]
    window.open(f"{COURSE}/{ASSIGNMENT}/{NOTEBOOK}.ipynb")
    before = window.cells()
    work = [cell.source for cell in handed_in(hub, "ana").cells]
    assert len(before) == len(work)
    for number, source in enumerate(work):
        if before[number] != source:
            window.write_cell(number, source)
    window.run_all()
    window.save()
    take_picture(window.page, "notebook-checked")
    open_list(window.page)
    window.page.get_by_role("button", name="Submit", exact=True).click()
    inbound = hub.exchange / COURSE / "inbound"
    until(
        lambda: any(path.name.startswith("ana+") for path in inbound.iterdir()), 60.0,
        lambda: f"ana's work does not come in: {hub.log()[-3000:]}",
    )  # fmt: skip
    take_picture(window.page, "assignment-list-submitted")
    window.page.close()


def grade(hub: Hub) -> None:
    """Have the grader's watch collect, grade and release feedback, until all have theirs."""
    tool = str(hubs.TOOLS / "autograder")
    log = hub.people.folder / "watch.log"
    root = hub.course_root(COURSE)
    watch = hub.people.start(
        hubs.GRADERS[COURSE], tool, "watch", ASSIGNMENT, "--every", "1", cwd=root, log=log
    )
    try:
        until(
            lambda: "released feedback for 3 students" in log.read_text("utf-8")
            or watch.poll() is not None,
            300.0, lambda: log.read_text("utf-8"),
        )  # fmt: skip
        assert "released feedback for 3 students" in log.read_text("utf-8"), log.read_text("utf-8")
    finally:
        hubs.send_signal(watch, signal.SIGINT)
        watch.wait(timeout=60)


def see_feedback(hub: Hub, context: BrowserContext, clients: dict[str, StudentClient]) -> None:
    """See that each student's feedback comes back, in the list of each."""
    for name, client in clients.items():
        client.act("fetch_feedback", COURSE, ASSIGNMENT)
        pages = list((hub.people[name].home / COURSE / ASSIGNMENT).glob("feedback/*/*.html"))
        assert pages, name
        assert "emergency stop" in pages[0].read_text("utf-8"), name
    page = context.new_page()
    page.goto(f"{hub.url}/user/ana/lab")
    page.locator("#jupyterlab-splash").wait_for(state="detached")
    open_list(page)
    page.get_by_role("button", name="Fetch Feedback").click()
    expect(page.get_by_text("(view feedback)")).to_be_visible(timeout=60_000)
    take_picture(page, "assignment-list-feedback")
    page.close()


def see_grades(hub: Hub, context: BrowserContext) -> None:
    """See that the formgrader has the three, in a tab of its own."""
    page = context.new_page()
    page.goto(f"{hub.url}/services/{COURSE}/formgrader/gradebook/{ASSIGNMENT}/{NOTEBOOK}")
    expect(page.get_by_role("row")).to_have_count(1 + len(STUDENTS), timeout=60_000)
    take_picture(page, "formgrader-graded")
    page.goto(f"{hub.url}/hub/home")
    take_picture(page, "hub-home")
    page.close()


def take_picture(page: Page, name: str) -> None:
    """Keep a picture of a page, if somebody wants to look at it."""
    if PICTURES:
        page.screenshot(path=f"{PICTURES}/{name}.png")
