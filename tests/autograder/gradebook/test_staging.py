"""All files of a submission are where nbgrader itself puts them, and the exchange knows them."""

from __future__ import annotations

import base64
import os
import shutil
import stat
from pathlib import Path

import nbformat
import pytest
from nbformat.v4 import new_code_cell
from nbgrader.api import Gradebook

from autograder.assignments import submission
from autograder.corpus import Case
from autograder.gradebook import staging
from autograder.gradebook.staging import MAX_STAGED, StagingLimits
from autograder.grading import engine
from tests.autograder.conftest import ASSIGNMENT, NOTEBOOK, Course
from tests.autograder.grading.test_grading import nbgrader
from tests.killing import fresh_copy
from tests.machine import needs_sandbox

PICTURE = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)
SECRET = "5e" * 64
PLOT = "import matplotlib.pyplot as plt\nplt.plot([1, 3, 2])\nplt.title('As ada drew it');"
PAGES = (f"{NOTEBOOK}.html", "index.html")
LIMITS = StagingLimits((".ipynb_checkpoints", "*.pyc", "__pycache__", "feedback"), 1000, 2000)


def files(folder: Path) -> dict[str, tuple[int, bytes]]:
    """Return {path: (mode, content)} of all but the notebook and the pages of feedback."""
    return {
        str(path.relative_to(folder)): (stat.S_IMODE(path.stat().st_mode), path.read_bytes())
        for path in folder.rglob("*")
        if path.is_file() and path.name not in (f"{NOTEBOOK}.ipynb", *PAGES)
    }


def own_plot(root: Path) -> bytes:
    """Return the plot of ada's own cell, as the graded copy has it."""
    graded = submission.read_notebook(
        root / "autograded" / "ada" / ASSIGNMENT / f"{NOTEBOOK}.ipynb"
    )
    (cell,) = (cell for cell in graded.cells if cell.source == PLOT)
    (output,) = cell.outputs
    return base64.b64decode(output.data["image/png"])


@pytest.fixture
def beside(course: Course, cases: dict[str, Case]) -> Course:
    """A course in which ada has handed in everything that one can think of."""
    notebook = cases["right-chapter"].make_submission(course.source, course.released)
    (answer,) = (c for c in notebook.cells if c.id == "qos-explanation-depth")
    answer.source = "My idea, see ![a plot](my%20plots/plot.png) and <img src='plot.svg'>."
    notebook.cells.append(new_code_cell(PLOT))
    course.submit("ada", notebook)
    folder = course.folder("ada")
    for name, content in {
        "my plots/plot.png": PICTURE,
        "plot.svg": b"<svg xmlns='http://www.w3.org/2000/svg'/>",
        "data/deep/values.csv": b"1,2\n",
        ".hidden": b"mine",
        "timestamp.txt": b"2030-01-31 12:00:00.000000 UTC",
        "submission_secret.txt": SECRET.encode(),
        f"{NOTEBOOK}.html": b"my own page",
        "notes.html": b"another one",
        "other.ipynb": b"{}",
        ".ipynb_checkpoints/old.txt": b"",
        "feedback/2029/page.html": b"fetched earlier",
        "helper.pyc": b"",
    }.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    return course


@needs_sandbox
@pytest.mark.timeout(900)
def test_every_file_is_where_nbgrader_itself_puts_it(beside: Course, tmp_path: Path) -> None:
    engine.grade(beside.root, ASSIGNMENT)
    by_nbgrader = fresh_copy(beside.root, tmp_path / "by-nbgrader")
    for step in ("autograded", "feedback"):
        shutil.rmtree(by_nbgrader / step)
    for step in ("autograde", "generate_feedback"):
        done = nbgrader(Course(by_nbgrader), step, ASSIGNMENT)
        assert done.returncode == 0, done.stderr

    for step in ("autograded", "feedback"):
        ours, theirs = (files(root / step / "ada") for root in (beside.root, by_nbgrader))
        # What the formgrader's address would serve as a page, and a browser run, is kept as text.
        assert ours.pop(f"{ASSIGNMENT}/{NOTEBOOK}.html.txt")[1] == b"my own page"
        page = f"{ASSIGNMENT}/notes.html"
        assert ours == {f"{name}.txt" if name == page else name: of for name, of in theirs.items()}
        assert f"{ASSIGNMENT}/my plots/plot.png" in ours
        assert ours[f"{ASSIGNMENT}/submission_secret.txt"][1] == SECRET.encode()
    assert f"{ASSIGNMENT}/feedback/2029/page.html" not in ours
    for root in (beside.root, by_nbgrader):
        page = (root / "feedback" / "ada" / ASSIGNMENT / f"{NOTEBOOK}.html").read_text()
        assert "My idea, see" in page, "a page of the student's own is not in the way"
        assert f"data:image/png;base64,{base64.b64encode(PICTURE).decode()}" in page
        assert "data:image/svg+xml;base64," in page
        assert own_plot(root).startswith(b"\x89PNG"), "what a cell of the student's own drew"
        assert f"data:image/png;base64,{base64.b64encode(own_plot(root)).decode()}" in page


@needs_sandbox
def test_the_exchange_hands_feedback_out_to_whoever_has_the_secret(
    beside: Course, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # What cannot be run has feedback, too, and nobody's marks of the exchange stop the others.
    for student, (time, secret) in {
        "bob": (b"2030-01-31 12:00:00.000000 UTC", b"b0" * 64),
        "cy": (b"01/02/2030 12:00", b"c" * 9),
        "dan": (b"", b"\xff"),
        "eve": (b"2030-01-31 12:00 UTC", b"e" * 2000),
    }.items():
        beside.submit(student, "{")
        (beside.folder(student) / "timestamp.txt").write_bytes(time)
        (beside.folder(student) / "submission_secret.txt").write_bytes(secret)
    beside.submit("fay", "{")
    (beside.folder("fay") / "submission_secret.txt").write_bytes(b"f" * 9)
    engine.grade(beside.root, ASSIGNMENT)
    with Gradebook(f"sqlite:///{beside.root / 'gradebook.db'}") as book:
        assert book.find_submission(ASSIGNMENT, "cy").timestamp is None, "nobody is late by it"
    exchange, cache = tmp_path / "exchange", tmp_path / "cache" / "ros2-course"
    exchange.mkdir()
    monkeypatch.setenv("JUPYTER_DATA_DIR", str(tmp_path))
    options = (f"--Exchange.root={exchange}", f"--Exchange.cache={cache.parent}")
    done = nbgrader(beside, "release_feedback", ASSIGNMENT, *options)
    assert done.returncode == 0, done.stderr
    for student in ("ada", "bob", "cy", "dan", "eve", "fay"):
        assert f"Releasing feedback for student '{student}'" in done.stderr

    mine = cache / f"ada+{ASSIGNMENT}+2030-01-31 12:00:00.000000 UTC"
    shutil.copytree(beside.folder("ada"), mine)
    home = tmp_path / "home"
    home.mkdir()
    done = nbgrader(
        Course(home), "fetch_feedback", ASSIGNMENT, "--course=ros2-course", *options,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    (page,) = home.rglob("*.html")
    assert "All exercises of this assignment" not in page.read_text(), "it would lead nowhere"
    assert "15 of 20 points so far" in page.read_text()
    assert (beside.root / "feedback" / "ada" / ASSIGNMENT / "index.html").is_file()
    assert (
        page.read_bytes()
        == (beside.root / "feedback" / "ada" / ASSIGNMENT / f"{NOTEBOOK}.html").read_bytes()
    )


def test_what_is_not_copied_is_said(tmp_path: Path) -> None:
    submitted, staged = tmp_path / "submitted", tmp_path / "staged"
    (submitted / f"{NOTEBOOK}.html").mkdir(parents=True)
    staged.mkdir()
    (submitted / f"{NOTEBOOK}.html" / "style.css").touch()
    (submitted / "secret").symlink_to("/etc/passwd")
    os.mkfifo(submitted / "pipe")
    (submitted / "large").write_bytes(bytes(1001))
    for name in ("a", "b", "c"):
        (submitted / name).write_bytes(bytes(700))
    (submitted / "submission_secret.txt").symlink_to("/etc/hostname")
    staging.copy_marks(submitted, staged)
    said = staging.copy_files(submitted, staged, LIMITS, [NOTEBOOK])
    marks = ["submission_secret.txt", "timestamp.txt"]
    assert sorted(path.name for path in staged.rglob("*")) == ["a", "b", *marks]
    assert len((staged / "submission_secret.txt").read_text()) == 64, "it is one that nobody knows"
    assert (staged / "timestamp.txt").read_text() == ""
    assert said == [
        "'secret' is missing in the graded copy and the feedback: a link is not followed.",
        "'c', 'large' is missing in the graded copy and the feedback: it is too large.",
    ]


def test_there_is_a_limit_to_how_many_are_copied(tmp_path: Path) -> None:
    submitted, staged = tmp_path / "submitted", tmp_path / "staged"
    for folder in (submitted, staged):
        folder.mkdir()
    for number in range(MAX_STAGED + 3):
        (submitted / f"{number:04}").touch()
    said = staging.copy_files(submitted, staged, LIMITS, [NOTEBOOK])
    assert said == [
        "3 files are missing in the graded copy and the feedback: 500 are copied.",
    ]
    assert len(list(staged.iterdir())) == MAX_STAGED


def test_a_name_in_any_encoding_is_copied(tmp_path: Path, course: Course) -> None:
    latin = os.fsdecode(b"Bild-\xfc.png")
    course.submit("ada", nbformat.writes(course.released))
    (course.folder("ada") / latin).write_bytes(PICTURE)
    staged = tmp_path / "staged"
    staged.mkdir()
    assert staging.copy_files(course.folder("ada"), staged, LIMITS, [NOTEBOOK]) == []
    assert (staged / latin).read_bytes() == PICTURE


def test_what_lay_around_a_notebook_in_a_folder_is_put_beside_it(tmp_path: Path) -> None:
    (tmp_path / "mine.png").write_bytes(b"mine")
    (tmp_path / "folder").mkdir()
    names = ["plot.png", "data/a.csv", "mine.png", "mine.png/x", "folder", "../out", "/out"]
    names += ["feedback/old.html", "timestamp.txt", f"{NOTEBOOK}.html/x"]
    files = dict.fromkeys(names, b"new")
    staging.copy_around(files, tmp_path, LIMITS, [NOTEBOOK])
    found = {str(p.relative_to(tmp_path)) for p in tmp_path.rglob("*") if p.is_file()}
    assert found == {"mine.png", "plot.png", "data/a.csv"}
    assert (tmp_path / "mine.png").read_bytes() == b"mine"
