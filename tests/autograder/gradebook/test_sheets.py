"""What students read of their grades: each answer by its question, what waits, what is late."""

from __future__ import annotations

import re
import subprocess
import sys
from datetime import datetime
from html.parser import HTMLParser
from pathlib import Path

import pytest
from nbgrader.api import Gradebook

from autograder.assignments import questions, submission
from autograder.gradebook.course_gradebook import CourseGradebook
from autograder.gradebook.feedback import index_page, sheets
from autograder.gradebook.feedback.sheets import ExerciseSheet, Sheet, SheetLine
from autograder.grading import engine
from tests.autograder.conftest import ASSIGNMENT, NOTEBOOK, Course, mark_written_answers

pytestmark = pytest.mark.xdist_group("graded class")

EVIL = '<script>alert(1)</script>"&'


class Text(HTMLParser):
    """A page as a reader has it: its text, its links, and what it would load."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.words: list[str] = []
        self.links: list[str] = []
        self.ids: set[str] = set()
        self.loads: list[str] = []
        self._hidden = 0
        self.feed(page)
        self.close()
        self.text = " ".join(" ".join(self.words).split())

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = dict(attrs)
        self._hidden += tag in ("style", "script")
        self.ids |= {found["id"] or ""} if "id" in found else set()
        if tag == "a":
            self.links.append(found.get("href") or "")
        if tag in ("script", "link", "img", "iframe") or any(
            name.startswith("on") for name in found
        ):
            self.loads.append(f"{tag} {found}")

    def handle_endtag(self, tag: str) -> None:
        self._hidden -= tag in ("style", "script")

    def handle_data(self, data: str) -> None:
        if not self._hidden:
            self.words.append(data)


def page(root: Path, student: str, name: str) -> Text:
    return Text((root / "feedback" / student / ASSIGNMENT / f"{name}.html").read_text("utf-8"))


# The words


@pytest.mark.parametrize(
    ("line", "said"),
    [
        (SheetLine("a", "A", 0.0, 1.0, waits=True, written=True), "waits for its mark (1 point)"),
        (SheetLine("a", "A", 0.0, 5.0, waits=True), "waits for a person (5 points)"),
        (SheetLine("a", "A", 3.0, 5.0, waits=True), "3 of 5 points so far, waits for a person"),
        (SheetLine("a", "A", 0.5, 1.0, waits=True, marked=True, written=True),
         "0.5 of 1 point, to be looked at again"),
        (SheetLine("a", "A", 0.0, 1.0, waits=False, written=True), "0 of 1 point"),
    ],
)  # fmt: skip
def test_what_waits_is_no_zero(line: SheetLine, said: str) -> None:
    assert line.said == said


def test_totals_say_what_is_still_to_come() -> None:
    given = SheetLine("a", "A", 8.0, 10.0, waits=False)
    answer = SheetLine("b", "B", 0.0, 1.0, waits=True, written=True)
    assert sheets.describe_score([given], 8.0) == "8 of 10 points."
    assert sheets.describe_score([given, answer], 8.0) == (
        "8 of 11 points so far; 1 answer waits for a mark and can add up to 1."
    )
    assert sheets.describe_score(
        [given, answer, SheetLine("c", "C", 2.0, 5.0, waits=True)], 10.0
    ) == ("10 of 16 points so far; 2 parts wait for a person and can add up to 4.")


def test_a_penalty_counts_in_the_total_and_never_below_zero() -> None:
    lines = (SheetLine("a", "A", 3.0, 10.0, waits=False),)
    assert ExerciseSheet("n", "N", lines, penalty=1.5).score_sentence == "1.5 of 10 points."
    assert ExerciseSheet("n", "N", lines, penalty=9.0).score == 0.0


@pytest.mark.parametrize(
    ("seconds", "penalty", "said"),
    [
        (0, 0, ""),
        (20, 0, "Handed in 1 minute late: nothing is taken off."),
        (7500, 1.5, "Handed in 2 hours 5 minutes late: 1.5 points off."),
        (3 * 86400 + 3600, 1, "Handed in 3 days 1 hour late: 1 point off."),
    ],
)
def test_lateness_is_said_with_what_it_costs(seconds: float, penalty: float, said: str) -> None:
    assert sheets.describe_lateness(seconds, penalty) == said


def test_everything_on_the_index_page_is_escaped_and_nothing_is_loaded() -> None:
    line = SheetLine(EVIL, EVIL, 0.0, 1.0, waits=True, written=True, comment=EVIL)
    sheet = Sheet(
        EVIL, EVIL, EVIL, (ExerciseSheet(EVIL, EVIL, (line,), 0.5),), datetime(2026, 1, 2), 60
    )
    html = index_page.render_page(sheet)
    assert "<script" not in html
    assert Text(html).loads == []


# The questions


def test_every_graded_cell_of_the_course_has_its_own_name(course: Course) -> None:
    found = questions.of_notebook(course.source, NOTEBOOK)
    assert [question.title for question in found.values()] == [
        "Checks in the notebook", "Checks at grading", "A lost camera frame", "History and depth",
    ]  # fmt: skip
    loss = found["qos-explanation-loss"]
    assert loss.text.startswith("A colleague wants to record")
    assert "2.5 points, or a\npart of these if" in loss.rules
    assert loss.model.startswith("The driver: its writer keeps each frame")
    assert all(q.model and "2.5 points" in q.rules for q in found.values() if q.written)


def test_a_release_has_no_model_answer_and_headings_of_students_name_nothing(
    course: Course,
) -> None:
    released = course.released
    cell = next(c for c in released.cells if submission.grade_id(c) == "qos-explanation-loss")
    cell.source = "# My own heading\n\n```\n# not one either\n```"
    found = questions.of_notebook(released, NOTEBOOK)
    assert not any(question.model for question in found.values())
    assert found["qos-explanation-depth"].title == "History and depth"


# Really graded


def test_a_waiting_answer_waits_at_the_top_in_the_total_and_at_its_place(
    graded_course: Path,
) -> None:
    text = page(graded_course, "bob", NOTEBOOK).text
    assert text.count("A lost camera frame : waits for its mark (2.5 points)") == 1
    assert text.count("A lost camera frame waits for its mark (2.5 points)") == 1
    assert "2 answers wait for a mark and can add up to 5." in text
    assert "qos-explanation" not in text
    assert not re.search(r"\b0\.0\b", text)
    model = questions.of_notebook(Course(graded_course).source, NOTEBOOK)["qos-explanation-loss"]
    assert model.model.splitlines()[0] not in text


def test_the_index_page_has_totals_lateness_and_links_that_lead_somewhere(
    graded_course: Path,
) -> None:
    index, notebook = (page(graded_course, "ann", name) for name in ("index", NOTEBOOK))
    assert "17.5 of 20 points." in index.text
    assert "Handed in 2 hours 5 minutes late: nothing is taken off." in index.text
    assert "Ann O'Hara" in index.text
    assert "Checks at grading 5 of 5 points" in index.text
    assert "waits" not in index.text
    assert index.loads == []
    (picture,) = notebook.loads
    assert picture.startswith("img {'src': 'data:image/svg+xml;base64,"), "the page holds it"
    linked = [link.split("#") for link in index.links]
    assert {name for name, *_ in linked} == {f"{NOTEBOOK}.html"}
    assert {place for _, *places in linked for place in places} <= notebook.ids
    assert "index.html" in notebook.links


def test_the_sum_of_a_sheet_is_the_grade(graded_course: Path) -> None:
    gradebook = CourseGradebook(graded_course)
    with Gradebook(gradebook.coursedir.db_url) as book:
        for grade in gradebook.read_grades(ASSIGNMENT):
            sheet = sheets.read_sheet(book, gradebook.coursedir, ASSIGNMENT, grade.student)
            assert sheet.score == pytest.approx(grade.score)
            assert sum(line.max_points for line in sheet.lines) == grade.max_score
            assert any(line.waits for line in sheet.lines) == grade.needs_manual_grade


def test_feedback_that_lacks_its_index_is_written_again(graded: Path) -> None:
    index = graded / "feedback" / "bob" / ASSIGNMENT / "index.html"
    index.unlink()
    engine.grade(graded, ASSIGNMENT)
    assert index.is_file()


def test_nbgrader_itself_writes_the_same_pages(graded: Path) -> None:
    folder = graded / "feedback" / "bob" / ASSIGNMENT
    ours = {path.name: path.read_bytes() for path in folder.glob("*.html")}
    assert set(ours) == {"index.html", f"{NOTEBOOK}.html"}
    nbgrader = [sys.executable, "-m", "nbgrader", "generate_feedback", ASSIGNMENT, "--force"]
    subprocess.run([*nbgrader, "--student=bob"], cwd=graded, check=True, capture_output=True)
    theirs = {path.name: path.read_bytes() for path in folder.glob("*.html")}
    assert theirs == ours


def test_a_new_mark_stands_on_the_pages_after_the_next_run(graded: Path) -> None:
    mark_written_answers(Course(graded), "cy")
    engine.grade(graded, ASSIGNMENT)
    for name in ("index", NOTEBOOK):
        text = page(graded, "cy", name).text
        assert "waits" not in text
        assert re.search(r"A lost camera frame ?:? 1\.25 of 2\.5 points", text)


def test_an_exercise_is_called_by_its_title() -> None:
    assert questions.title_of_notebook(NOTEBOOK) == "Exercise 1: QoS profile design"
    assert questions.title_of_notebook("mine") == "mine"
