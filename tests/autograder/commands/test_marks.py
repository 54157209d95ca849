"""Marks for one question over a class: out to a file, filled in, and back into a real gradebook."""

from __future__ import annotations

import base64
import csv
import hashlib
import io
import re
import unicodedata
from collections.abc import Callable
from pathlib import Path
from typing import Any

import nbformat
import pytest
from nbconvert.exporters import HTMLExporter
from nbgrader.api import Gradebook

from autograder.assignments import questions, submission
from autograder.assignments.questions import GradedQuestion
from autograder.gradebook.course_gradebook import CourseGradebook
from autograder.gradebook.nbgrader_plugins.model_answers import FORMGRADER_KEYS, ShowModelAnswers
from autograder.gradebook.written_answers import answers, answers_page
from autograder.gradebook.written_answers.answers import Answer, Answers, MarksError
from autograder.grading import engine
from tests.autograder.commands.test_cli import autograder
from tests.autograder.conftest import ASSIGNMENT, NOTEBOOK, Course
from tests.autograder.gradebook.test_sheets import Text, page

pytestmark = pytest.mark.xdist_group("graded class")

CELL, TITLE = "qos-explanation-loss", "A lost camera frame"
EVIL = "</script><script>alert(1)</script>"
Row = dict[str, str]


def exported(root: Path) -> Path:
    autograder("marks", "export", ASSIGNMENT, TITLE, "--root", str(root), cwd=root)
    return root / "reports" / ASSIGNMENT / f"marks-{CELL}.csv"


def fill_in(path: Path, change: Callable[[Row], Row], **format_: Any) -> None:
    with path.open(encoding="utf-8", newline="") as file:
        rows = [change(row) for row in csv.DictReader(file)]
    buffer = io.StringIO()
    writer = csv.DictWriter(buffer, answers.COLUMNS, **format_)
    writer.writeheader()
    writer.writerows(rows)
    path.write_text(buffer.getvalue(), encoding="utf-8")


def entry(root: Path, student: str) -> tuple[float | None, bool, str | None]:
    with Gradebook(f"sqlite:///{root / 'gradebook.db'}") as book:
        grade = book.find_grade(CELL, NOTEBOOK, ASSIGNMENT, student)
        comment = book.find_comment(CELL, NOTEBOOK, ASSIGNMENT, student)
        return grade.manual_score, grade.needs_manual_grade, comment.manual_comment


def marked(points: dict[str, str], comments: dict[str, str] | None = None) -> Callable[[Row], Row]:
    def change(row: Row) -> Row:
        who = row["student"]
        return {**row, "points": points.get(who, row["points"]),
                "comment": (comments or {}).get(who, row["comment"])}  # fmt: skip

    return change


# The file


def test_marks_go_out_are_filled_in_and_come_back_into_grades_and_feedback(graded: Path) -> None:
    file = exported(graded)
    with file.open(encoding="utf-8", newline="") as opened:
        rows = list(csv.DictReader(opened))
    assert [row["student"] for row in rows] == ["bob", "cy", "'-dan", "ann"], (
        "who waits comes first"
    )
    assert [row["points"] for row in rows] == ["", "", "1.25", "1.25"]
    assert rows[0]["name"] == "Bob <b>Bee"
    assert "eve" not in file.read_text("utf-8"), "an unreadable hand-in has no answer"

    fill_in(file, marked({"bob": "1", "ann": "0"}, {"bob": "=Right, *but*", "cy": "See me."}))
    said = autograder("marks", "import", str(file), "--root", str(graded), cwd=graded).stdout
    assert f"{TITLE}: 3 marks entered, 1 as they were, 0 left blank." in said
    assert entry(graded, "bob") == (1.0, False, "=Right, *but*")
    assert entry(graded, "ann") == (0.0, False, None)
    assert entry(graded, "cy") == (None, True, "See me."), "a comment is no mark"

    engine.grade(graded, ASSIGNMENT)
    text = page(graded, "bob", NOTEBOOK).text
    assert f"{TITLE} : 1 of 2.5 points (with a comment)" in text
    assert "=Right, but" in text
    again = autograder("marks", "import", str(file), "--root", str(graded), cwd=graded).stdout
    assert "0 marks entered, 3 as they were, 1 left blank." in again


def test_a_spreadsheet_in_another_language_is_understood(graded: Path) -> None:
    file = exported(graded)
    fill_in(file, marked({"bob": "0,5"}), delimiter=";")
    file.write_bytes(b"\xef\xbb\xbf" + file.read_bytes())
    autograder("marks", "import", str(file), "--root", str(graded), cwd=graded)
    assert entry(graded, "bob")[0] == 0.5


def test_a_row_whose_answer_or_mark_has_changed_since_is_left_out_and_named(graded: Path) -> None:
    file = exported(graded)
    copy = graded / "autograded" / "bob" / ASSIGNMENT / f"{NOTEBOOK}.ipynb"
    notebook = submission.read_notebook(copy)
    cell = next(c for c in notebook.cells if submission.grade_id(c) == CELL)
    cell.source += " And something else."
    nbformat.write(notebook, copy)
    with Gradebook(f"sqlite:///{graded / 'gradebook.db'}") as book:
        book.find_grade(CELL, NOTEBOOK, ASSIGNMENT, "ann").manual_score = 1.0
        book.db.commit()
    fill_in(file, marked({"bob": "1", "cy": "1", "ann": "0"}))
    result = autograder("marks", "import", str(file), "--root", str(graded), cwd=graded, code=1)
    assert "1 mark entered" in result.stdout
    assert "has changed since the export: bob, ann." in " ".join(result.stdout.split())
    assert entry(graded, "bob")[:2] == (None, True)
    assert entry(graded, "cy")[:2] == (1.0, False)
    assert entry(graded, "ann")[0] == 1.0


def test_a_spreadsheet_may_write_a_name_in_the_other_form_of_unicode(graded: Path) -> None:
    name = unicodedata.normalize("NFC", "Müller")
    file = exported(graded)
    with Gradebook(f"sqlite:///{graded / 'gradebook.db'}") as book:
        book.add_student(name)
        with book.db.no_autoflush:
            book.add_submission(ASSIGNMENT, name)
    other = unicodedata.normalize("NFD", name)
    fill_in(file, lambda row: {**row, "student": other, "points": "1"}
            if row["student"] == "cy" else row)  # fmt: skip
    assert answers.enter_marks(CourseGradebook(graded), file).changed == (name,), (
        "no answer was exported"
    )


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (marked({"bob": "3"}), "3 points for bob, but there are 0 to 2.5"),
        (marked({"bob": "-1"}), "-1 points for bob"),
        (marked({"bob": "nan"}), "'nan' is no number"),
        (marked({"bob": "one"}), "'one' is no number"),
        (lambda row: {**row, "student": f"{row['student']}x"}, "'bobx' has no answer"),
        (lambda row: {**row, "student": "cy"}, "cy comes twice"),
        (lambda row: {**row, "question": row["question"] + row["student"]}, "of another question"),
        (lambda row: {**row, "assignment": "ch99"}, "no assignment 'ch99'"),
        (lambda row: {**row, "question": "qos-visible"}, "no question 'qos-visible'"),
        (lambda row: {**row, "notebook": "other"}, "not in the notebook 'other'"),
    ],
    ids=["above", "below", "nan", "word", "unknown", "twice", "mixed", "assignment", "question",
         "notebook"],
)  # fmt: skip
def test_a_file_with_a_fault_is_not_entered_at_all(
    graded: Path, change: Callable[[Row], Row], said: str
) -> None:
    gradebook = CourseGradebook(graded)
    file = exported(graded)
    fill_in(file, lambda row: change(marked({"cy": "1"})(row)))
    with pytest.raises(MarksError, match=said):
        answers.enter_marks(gradebook, file)
    assert entry(graded, "cy")[:2] == (None, True)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "no file of marks"),
        (b"student,points\nbob,1\n", "lacks the columns assignment, notebook"),
        (",".join(answers.COLUMNS).encode() + b"\n", "has no rows"),
        ("\u00e9".encode("latin-1"), "is not UTF-8"),
    ],
    ids=["empty", "columns", "rows", "encoding"],
)
def test_another_file_is_one_sentence(
    course: Course, tmp_path: Path, content: bytes, said: str
) -> None:
    file = tmp_path / "marks.csv"
    file.write_bytes(content)
    with pytest.raises(MarksError, match=said):
        answers.enter_marks(CourseGradebook(course.root), file)


def test_a_question_is_found_by_its_title_or_its_id_and_the_others_are_named(
    course: Course,
) -> None:
    gradebook = CourseGradebook(course.root)
    for wanted in (CELL, TITLE.upper(), "camera"):
        assert answers.find_question(gradebook, ASSIGNMENT, wanted).grade_id == CELL
    with pytest.raises(MarksError, match=r"can be several questions: .*-loss .*-depth"):
        answers.find_question(gradebook, ASSIGNMENT, "explanation")
    with pytest.raises(MarksError, match=r"there are .*-loss \(A lost camera frame\)"):
        answers.find_question(gradebook, ASSIGNMENT, "naught")


def test_an_answer_to_be_looked_at_again_is_not_settled_by_a_file_that_nobody_filled_in(
    graded: Path,
) -> None:
    with Gradebook(f"sqlite:///{graded / 'gradebook.db'}") as book:
        book.find_grade(CELL, NOTEBOOK, ASSIGNMENT, "ann").needs_manual_grade = True
        book.db.commit()
    file = exported(graded)
    answers.enter_marks(CourseGradebook(graded), file)
    assert entry(graded, "ann")[:2] == (1.25, True)
    fill_in(file, marked({"ann": "1.25"}))
    answers.enter_marks(CourseGradebook(graded), file)
    assert entry(graded, "ann")[:2] == (1.25, False)


# The page


def test_the_page_has_the_model_answer_and_shows_answers_as_text() -> None:
    question = GradedQuestion(
        NOTEBOOK, CELL, EVIL, True, 1.0, text="Who re-sends it?", rules="Half a point if.",
        model="Nobody: `best effort`.",
    )  # fmt: skip
    found = Answers(
        ASSIGNMENT, question,
        (Answer(EVIL, EVIL, EVIL, 0.5, EVIL, True, "1"),
         Answer("b", "B", "*x*", 1.0, "", False, "2")),
        ("c",), (EVIL,),
    )  # fmt: skip
    html = answers_page.render_page(found, "marks.csv")
    shown = Text(html)
    assert html.count("<script") == 2, "the page's data and its own script"
    assert len(shown.loads) == 2
    [script] = re.findall("<script>(.*?)</script>", html, re.DOTALL)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}'" in html, "a browser runs what has this digest"
    for part in ("Who re-sends it?", "Nobody: best effort .", "Half a point if.", "*x*",
                 "Marked with 0.5 before"):  # fmt: skip
        assert part in shown.text


# The formgrader's page; in a real browser: tests/browser/test_formgrader.py


def test_model_answers_stand_above_each_answer_for_the_formgrader_alone(
    graded_course: Path,
) -> None:
    config = CourseGradebook(graded_course).config
    copy = graded_course / "autograded" / "bob" / ASSIGNMENT / f"{NOTEBOOK}.ipynb"
    asked = questions.of_notebook(Course(graded_course).source, NOTEBOOK)
    first = asked[CELL].model.splitlines()[0]
    assert ShowModelAnswers in config.HTMLExporter.preprocessors
    exporter = HTMLExporter(config=config)
    theirs = dict.fromkeys(FORMGRADER_KEYS, "x") | {"assignment_id": ASSIGNMENT,
                                                    "notebook_id": NOTEBOOK}  # fmt: skip
    shown, _ = exporter.from_filename(str(copy), resources=theirs)
    assert shown.count("Model answer") == sum(question.written for question in asked.values())
    assert shown.index(asked[CELL].text[:20]) < shown.index(first)
    other, _ = exporter.from_filename(str(copy))
    assert first not in other
    for path in graded_course.rglob("*"):
        kept = {"source", "authoring"} & set(path.relative_to(graded_course).parts)
        if path.is_file() and not kept and path.suffix in (".ipynb", ".html", ".json", ".csv"):
            assert first not in path.read_text("utf-8"), path
