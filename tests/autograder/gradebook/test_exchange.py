"""The whole way of nbgrader's exchange, between users who may not look into each other's homes."""

from __future__ import annotations

import base64
import re
import shutil
import signal
import subprocess
import sys
import time
from contextlib import suppress
from datetime import UTC, datetime, timedelta
from pathlib import Path

import nbformat
import psutil
import pytest
from nbgrader.api import Gradebook

from autograder.assignments import submission
from autograder.corpus import Case
from tests.autograder.conftest import ASSIGNMENT, NOTEBOOK, Course
from tests.autograder.gradebook.test_staging import PICTURE
from tests.machine import needs_users
from tests.people import People, finished

pytestmark = [needs_users, pytest.mark.timeout(900)]

NBGRADER = (sys.executable, "-m", "nbgrader")
AUTOGRADER = (str(Path(sys.executable).with_name("autograder")),)
PENALTY = """
from nbgrader.plugins import LateSubmissionPlugin


class OnePoint(LateSubmissionPlugin):
    def late_submission_penalty(self, student_id, score, total_seconds_late):
        return 1.5


c.AssignLatePenalties.plugin_class = OnePoint
"""


def prepare(people: People, released_course: Path) -> tuple[Path, Path]:
    """Give the teacher a released course and everybody an exchange; return both."""
    exchange = people.folder / "exchange"
    exchange.mkdir()
    exchange.chmod(0o777)
    root = people["teacher"].home / "course"
    shutil.copytree(released_course, root)
    where = f"\nc.Exchange.root = {str(exchange)!r}\n"
    with (root / "nbgrader_config.py").open("a") as config:
        config.write(where + PENALTY)
    people.give("teacher", root)
    for name in ("ada", "bob"):
        jupyter = people[name].home / ".jupyter"
        jupyter.mkdir()
        (jupyter / "nbgrader_config.py").write_text(
            f"c = get_config()\nc.CourseDirectory.course_id = 'ros2-course'{where}"
        )
        people.give(name, jupyter)
    return root, exchange


def both(people: People, *command: str) -> None:
    """Run a command as each of the students, side by side."""
    for process in [people.start(name, *NBGRADER, *command) for name in ("ada", "bob")]:
        finished(process)


def work(people: People, name: str, course: Course, case: Case, answer: str) -> None:
    """Have a student work on what they fetched: their own is changed, not replaced."""
    path = people[name].home / ASSIGNMENT / f"{NOTEBOOK}.ipynb"
    fetched = submission.read_notebook(path)
    notebook = case.make_submission(course.source, fetched)
    (cell,) = (c for c in notebook.cells if c.id == "qos-explanation-depth")
    cell.source = answer
    nbformat.write(notebook, path)


def test_work_and_feedback_go_through_the_exchange(
    released_course: Path, cases: dict[str, Case], tmp_path: Path
) -> None:
    people = People(tmp_path, ["teacher", "ada", "bob"])
    root, exchange = prepare(people, released_course)
    people.run("teacher", *NBGRADER, "release_assignment", ASSIGNMENT, cwd=root)
    both(people, "fetch_assignment", ASSIGNMENT)
    course = Course(root)
    work(people, "ada", course, cases["right-chapter"], "See ![my plot](plot.png), says ada.")
    (people["ada"].home / ASSIGNMENT / "plot.png").write_bytes(PICTURE)
    people.give("ada", people["ada"].home)
    work(people, "bob", course, cases["wrong-imu-single"], "What bob thinks.")
    both(people, "submit", ASSIGNMENT)

    with Gradebook(f"sqlite:///{root / 'gradebook.db'}") as gradebook:
        an_hour_ago = datetime.now(UTC).replace(tzinfo=None) - timedelta(hours=1)
        gradebook.update_or_create_assignment(ASSIGNMENT, duedate=an_hour_ago)
    people.run("teacher", *NBGRADER, "collect", ASSIGNMENT, cwd=root)
    people.run("teacher", *AUTOGRADER, "extend", ASSIGNMENT, "ada", "--hours", "24", cwd=root)
    table = people.run("teacher", *AUTOGRADER, "grade", ASSIGNMENT, "--trust-submissions", cwd=root)
    assert "-1.5" in table
    people.run("teacher", *NBGRADER, "release_feedback", ASSIGNMENT, cwd=root)
    both(people, "fetch_feedback", ASSIGNMENT)

    pages = {}
    for name in ("ada", "bob"):
        fetched = people[name].home / ASSIGNMENT / "feedback"
        (page,) = fetched.rglob("*.html")
        assert page.stat().st_uid == people[name].number
        made = root / "feedback" / name / ASSIGNMENT / page.name
        pages[name] = page.read_text(encoding="utf-8")
        assert pages[name] == made.read_text(encoding="utf-8")
    assert "says ada" in pages["ada"]
    assert f"data:image/png;base64,{base64.b64encode(PICTURE).decode()}" in pages["ada"]
    assert "Handed in" not in pages["ada"], "the extension counts"
    assert "What bob thinks" in pages["bob"]
    assert "says ada" not in pages["bob"]
    assert re.search("Handed in .* late: 1.5 points off", pages["bob"])
    graded = root / "autograded" / "ada" / ASSIGNMENT / "plot.png"
    assert graded.read_bytes() == PICTURE, "where the formgrader shows it"

    adas = next((people["ada"].home / ASSIGNMENT / "feedback").rglob("*.html"))
    for closed in (
        ("cat", str(adas)),
        ("ls", str(exchange / "ros2-course" / "feedback")),
        ("ls", str(exchange / "ros2-course" / "inbound")),
        ("ls", str(root)),
    ):
        process = people.start("bob", *closed)
        out, err = process.communicate(timeout=60)
        assert process.returncode != 0
        assert "Permission denied" in err
        assert out == ""


def test_a_watch_brings_work_and_feedback_through_the_exchange(
    released_course: Path, cases: dict[str, Case], tmp_path: Path
) -> None:
    people = People(tmp_path, ["teacher", "ada", "bob"])
    root, exchange = prepare(people, released_course)
    people.run("teacher", *NBGRADER, "release_assignment", ASSIGNMENT, cwd=root)
    both(people, "fetch_assignment", ASSIGNMENT)
    for name in ("ada", "bob"):
        work(people, name, Course(root), cases["wrong-stub"], f"What {name} thinks.")
        people.give(name, people[name].home)
    both(people, "submit", ASSIGNMENT)
    # Bob hands in for Ada, later than she did.
    inbound = exchange / "ros2-course" / "inbound"
    [hers] = inbound.glob("ada+*")
    [his] = inbound.glob("bob+*")
    people.run("bob", "cp", "-r", str(his), str(inbound / his.name.replace("bob+", "ada+")))

    watch = people.start(
        "teacher", *AUTOGRADER, "watch", ASSIGNMENT, "--trust-submissions", "--every", "0.5",
        cwd=root,
    )  # fmt: skip
    released = exchange / "ros2-course" / "feedback"
    deadline = time.monotonic() + 600
    try:
        while not (released.is_dir() and len(list(released.glob("*[!p].html"))) == 4):
            with suppress(subprocess.TimeoutExpired):
                watch.wait(0.1)
            assert watch.poll() is None, watch.communicate()
            assert time.monotonic() < deadline, "feedback is not released"
    finally:
        for process in psutil.Process(watch.pid).children():
            process.terminate()  # bubblewrap would leave it running
        said, _ = watch.communicate(timeout=60)
    assert watch.returncode == 128 + signal.SIGTERM
    assert "was put there by bob, not by ada: it is left there" in said
    assert "collected ada, bob; graded ada, bob; released feedback for 2 students" in said
    assert (root / "submitted" / "ada" / ASSIGNMENT / "timestamp.txt").read_text() == (
        hers / "timestamp.txt"
    ).read_text()
    both(people, "fetch_feedback", ASSIGNMENT)
    for name in ("ada", "bob"):
        [page] = (people[name].home / ASSIGNMENT / "feedback").rglob("*.html")
        assert f"What {name} thinks" in page.read_text(encoding="utf-8")
