"""A student's progress: what is counted, how it reads, and that damage never hides the rest."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import nbformat
import pytest
from markdown_it import MarkdownIt
from typer.testing import CliRunner

import course
from autograder.assignments import listing
from course.command_line.cli import app
from course.errors import CourseError
from course.workspace import working_copy
from course.workspace.content import CONFIG, content_root
from course.workspace.journal.journal_file import FILE, MANIFEST, Journal
from course.workspace.journal.progress import WELCOME
from course.workspace.journal.student_notebooks import read_notebook
from course.workspace.journal.time_needed import find_minutes, format_minutes
from quizzes.bank import selection
from quizzes.bank.loader import load_bank
from quizzes.notebook.quiz import Quiz

CHAPTER, EXERCISE = Path("ch05-building-blocks.ipynb"), Path("ch05/qos-design.ipynb")
QUIZ = Path("ch05-quiz")


EXERCISES = list(listing.of_course(content_root())["ch05"].exercises)
NAMES = ("architecture", "error-handling", "patterns", "qos-design", "resources")
HANDED_OUT = [CHAPTER, QUIZ / "quiz.ipynb", *(Path(f"ch05/{name}.ipynb") for name in NAMES)]


@pytest.fixture(scope="session")
def chapter_5(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a course that ends with chapter 5, as it is built."""
    root = tmp_path_factory.mktemp("chapter-5")
    (root / "chapters").mkdir()
    for name in ("chapters/start-here.ipynb", f"chapters/{CHAPTER}", CONFIG):
        shutil.copy(content_root() / name, root / name)
    for name in ("source/ch05", "source/ch05-quiz"):
        shutil.copytree(content_root() / name, root / name)
    return root


@pytest.fixture(scope="session")
def handed_out(chapter_5: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("copy") / "mine"
    working_copy.make_copy(folder, chapter_5)
    return folder


@pytest.fixture
def folder(handed_out: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "mine"
    shutil.copytree(handed_out, folder)
    monkeypatch.chdir(folder)
    return folder


def ids(path: Path) -> list[str]:
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    return [cell["id"] for cell in cells if cell["cell_type"] == "code"]


def edit(path: Path, change: Callable[[dict[str, Any]], None]) -> None:
    notebook = json.loads(path.read_text(encoding="utf-8"))
    for cell in notebook["cells"]:
        change(cell)
    path.write_text(json.dumps(notebook), encoding="utf-8")


def write_explanations(path: Path, which: str = "-explanation-") -> None:
    def change(cell: dict[str, Any]) -> None:
        if which in cell["id"]:
            cell["source"] = "Because a late frame is worse than a lost one."

    edit(path, change)


def take_quiz(folder: Path) -> None:
    quiz = Quiz(load_bank("ch05"), student="ada", folder=folder)
    for item in quiz.items:
        quiz.answer(item.number, selection.right_answer(item))
    quiz.submit()


def test_a_new_copy_has_everything_left(folder: Path) -> None:
    progress = course.progress()
    (chapter,) = progress.chapters
    assert (chapter.done, chapter.total) == (0, len(ids(folder / CHAPTER)))
    assert [exercise.notebook.exam for exercise in progress.exercises] == EXERCISES
    assert not any(exercise.is_done for exercise in progress.exercises)
    assert [quiz.notebook.quiz for quiz in progress.quizzes] == ["ch05"]
    assert progress.notices == ()
    text = repr(progress)
    assert "Next: ch05-building-blocks.ipynb: go on at “The beginning”." in text
    assert f"0 of {len(EXERCISES)} exercises ready to hand in, the quiz not passed yet." in text
    assert "Visible checks: not checked yet" in text


def test_what_was_run_checked_written_and_passed_counts(folder: Path) -> None:
    journal = Journal(folder)
    for cell in ids(folder / CHAPTER)[:3]:
        journal.record_run(cell)
    journal.record_run("a cell of the student's own")
    journal.record_checks("qos", 8.0, 10.0, ["It starts."], ["The newest comes first."])
    progress = course.progress(folder / "ch05")
    assert progress.chapters[0].done == 3
    exercise = progress.exercises[0].notebook
    assert (exercise.written, exercise.to_write) == (0, 2)
    text = repr(progress)
    assert "8 of 10 points (today, " in text
    assert "Still open: The newest comes first\n" in text
    assert "Explanations: 0 of 2 written" in text
    journal.record_checks("qos", 10.0, 10.0, ["It starts.", "The newest comes first."], [])
    write_explanations(folder / EXERCISE, "-explanation-depth")
    assert course.progress().exercises[0].is_done is False
    assert "Explanations: 1 of 2 written" in repr(course.progress())
    write_explanations(folder / EXERCISE)
    take_quiz(folder / QUIZ)
    progress = course.progress()
    assert [exercise.is_done for exercise in progress.exercises] == [True, *[False] * 4]
    assert (progress.quizzes[0].is_passed, len(progress.quizzes[0].attempts)) == (True, 1)
    assert f"1 of {len(EXERCISES)} exercises ready to hand in, the quiz passed." in repr(progress)
    assert "Best attempt: 5 of 5" in repr(progress)


def test_own_and_empty_cells_do_not_keep_a_chapter_from_being_done(folder: Path) -> None:
    for cell in ids(folder / CHAPTER):
        Journal(folder).record_run(cell)
    notebook = json.loads((folder / CHAPTER).read_text(encoding="utf-8"))
    empty, own = ({"cell_type": "code", "source": text, "metadata": {}, "outputs": [],
                   "execution_count": None} for text in ("", "1 / 0"))  # fmt: skip
    notebook["cells"].append({**empty, "id": "0123456789ab"})
    notebook["cells"].insert(5, {**own, "id": "6d2f9a3c-5d0e-4a52-9d1f-0c9a3b7e1f11"})
    (folder / CHAPTER).write_text(json.dumps(notebook), encoding="utf-8")
    (chapter,) = course.progress().chapters
    assert chapter.done == chapter.total == len(ids(folder / CHAPTER)) - 2
    assert chapter.unfinished_sections == ()
    assert "Next: ch05-building-blocks" not in repr(course.progress())


def test_the_cells_that_are_built_are_all_known_as_the_courses(folder: Path) -> None:
    for path in (content_root() / "chapters").glob("*.ipynb"):
        shutil.copy(path, folder / path.name)
        found = read_notebook(folder, Path(path.name))
        assert [cell for s in found.sections for cell in s.cells] == ids(folder / path.name)


def test_a_check_before_the_work_has_run_takes_nothing_away(folder: Path) -> None:
    journal = Journal(folder)
    journal.record_checks("qos", 10.0, 10.0, ["It starts.", "It moves."], [])
    write_explanations(folder / EXERCISE)
    journal.record_checks("qos", 0.0, 10.0, [], ["It starts.", "It moves."])
    assert course.progress().exercises[0].is_done
    assert "10 of 10 points (at best; 0 last, today, " in repr(course.progress())
    journal.record_checks("qos", 10.0, 10.0, ["It starts.", "It moves."], [])
    assert "10 of 10 points (today, " in repr(course.progress())


def test_it_says_how_long_a_part_takes_and_how_to_hand_in(folder: Path) -> None:
    progress = course.progress()
    (chapter,) = progress.chapters
    assert chapter.notebook.minutes == 180
    assert [e.notebook.minutes for e in progress.exercises] == [45, 60, 90, 90, 150]
    assert progress.quizzes[0].notebook.minutes == 10
    text = repr(progress)
    assert text.count("  Takes about: ") == 2 + len(EXERCISES)
    assert "give your instructor all files of ch05 and ch05-quiz, each folder as it is" in text
    assert "**To hand in:** save your notebooks" in progress._repr_markdown_()
    assert [format_minutes(minutes) for minutes in (10, 60, 70)] == ["10 min", "1 h", "1 h 10 min"]


@pytest.mark.parametrize("path", HANDED_OUT, ids=str)
def test_each_notebook_says_once_how_long_it_takes(folder: Path, path: Path) -> None:
    """So the progress page has no other number than the text."""
    cells = json.loads((folder / path).read_text(encoding="utf-8"))["cells"]
    texts = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown"]
    said = [minutes for text in texts if (minutes := find_minutes(text)) is not None]
    assert said == [find_minutes(texts[0])] == [read_notebook(folder, path).minutes]


def test_a_notebook_that_does_not_say_how_long_it_takes_is_guessed(folder: Path) -> None:
    def forget(cell: dict[str, Any]) -> None:
        cell["source"] = "".join(cell["source"]).replace("takes about", "takes")

    edit(folder / EXERCISE, forget)
    assert 20 <= read_notebook(folder, EXERCISE).minutes <= 240


def test_next_leads_through_everything_and_ends(folder: Path) -> None:
    journal = Journal(folder)
    seen = []

    def next_() -> str:
        line = next((x for x in repr(course.progress()).splitlines() if "Next" in x), "")
        seen.append(line)
        return line

    assert str(CHAPTER) in next_()
    for cell in ids(folder / CHAPTER):
        journal.record_run(cell)
    for exercise in course.progress().exercises:
        where = str(exercise.notebook.path)
        assert next_().startswith(f"Next: {where}: do the task")
        journal.record_checks(exercise.notebook.exam, 1.0, 10.0, ["a"], ["It moves."])
        assert next_() == f"Next: {where}: “It moves.” is still open."
        journal.record_checks(exercise.notebook.exam, 10.0, 10.0, ["a", "It moves."], [])
        assert next_() == f"Next: {where}: write the explanations, and save."
        write_explanations(folder / exercise.notebook.path)
    assert next_() == "Next: ch05-quiz/quiz.ipynb: take the quiz."
    take_quiz(folder / QUIZ)
    assert next_() == ""


def test_the_page_has_tables_with_links_and_shows_titles_as_they_are(folder: Path) -> None:
    title = "A | B <img src=x onerror=alert(1)> *c* [d](e) `f` $g$ \\ _h_"
    Journal(folder).record_checks("qos", 1.0, 10.0, [], [title])
    html = MarkdownIt("commonmark").enable("table").render(course.progress()._repr_markdown_())
    assert html.count("<table>") == 3
    assert f'<a href="{EXERCISE}">Exercise 1: QoS profile design</a>' in html
    assert "<td>A | B &lt;img src=x onerror=alert(1)&gt; *c* [d](e) `f` $g$ \\ _h_</td>" in html
    assert "<img" not in html


def test_links_are_relative_to_where_the_notebook_is(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder / "ch05")
    page = course.progress()._repr_markdown_()
    assert "](qos-design.ipynb)" in page
    assert f"](../{CHAPTER})" in page


@pytest.mark.parametrize("content", [b"", b"{", b"[]", b'{"cells": 3}', b'{"cells": [3]}', b"\xff"])
def test_a_damaged_notebook_is_named_and_the_rest_counts(folder: Path, content: bytes) -> None:
    (folder / EXERCISE).write_bytes(content)
    progress = course.progress()
    assert progress.notices == (f"{EXERCISE} cannot be read: it is damaged.",)
    assert len(progress.exercises) == 4
    assert f"Note: {EXERCISE}" in repr(progress)
    assert "**Note:**" in progress._repr_markdown_()


def test_a_missing_notebook_is_named(folder: Path) -> None:
    (folder / EXERCISE).unlink()
    assert course.progress().notices == (f"{EXERCISE} cannot be read: it is not there.",)


@pytest.mark.parametrize(
    "record",
    ["", "[]", "3", '{"../../etc/x.ipynb": []}', '{"../../etc/x.ipynb": ["0"]}'],
)
def test_a_damaged_record_of_the_copy_costs_nothing(folder: Path, record: str) -> None:
    (folder / MANIFEST).write_text(record)
    (folder / "ch05/qos-design.new.ipynb").write_bytes((folder / EXERCISE).read_bytes())
    progress = course.progress()
    if '"0"' in record:  # it was handed out, it says
        assert progress.exercises == ()
    else:
        assert len(progress.exercises) == len(EXERCISES)
        assert len(progress.chapters) == 1
    assert "ipynb" not in " ".join(progress.notices)


def test_a_damaged_journal_and_damaged_attempts_are_said(folder: Path) -> None:
    (folder / FILE).write_text("{")
    take_quiz(folder / QUIZ)
    with (folder / QUIZ / "quiz-ch05.attempts.jsonl").open("a") as file:
        file.write("nonsense\n")
    progress = course.progress()
    assert progress.quizzes[0].is_passed
    assert "progress.json was damaged: it is kept as progress.json.corrupt-1" in repr(progress)
    assert "quiz-ch05.attempts.jsonl has 1 damaged lines" in repr(progress)


def test_the_command_says_the_same_in_a_terminal(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder.parent)
    told = CliRunner().invoke(app, ["progress", str(folder)])
    assert told.exit_code == 0
    assert (
        f"0 of {len(EXERCISES)} exercises ready to hand in, the quiz not passed yet." in told.output
    )
    folder.rename(folder.parent / working_copy.DEFAULT)
    assert CliRunner().invoke(app, ["progress"]).output == told.output


def test_elsewhere_it_says_where_to_go(tmp_path: Path) -> None:
    with pytest.raises(CourseError, match=r"is no working copy of the course: make one with `cou"):
        course.progress(tmp_path)


def outputs(folder: Path) -> list[dict[str, Any]]:
    cells = json.loads((folder / WELCOME).read_text(encoding="utf-8"))["cells"]
    return [output for cell in cells for output in cell.get("outputs", [])]


def test_course_lab_brings_its_first_notebook_up_to_date_and_keeps_the_rest(
    folder: Path, chapter_5: Path
) -> None:
    nbformat.validate(nbformat.read(folder / WELCOME, as_version=4))
    (shown,) = outputs(folder)
    assert f"0 of {len(EXERCISES)} exercises" in "".join(shown["data"]["text/markdown"])
    assert f"0 of {len(EXERCISES)} exercises" in "".join(shown["data"]["text/plain"])
    edit(folder / WELCOME, lambda cell: cell.update(source=["My notes. ", *cell["source"]]))
    take_quiz(folder / QUIZ)
    working_copy.make_copy(folder, chapter_5)
    (shown,) = outputs(folder)
    assert "the quiz passed" in shown["data"]["text/plain"]
    assert (folder / WELCOME).read_text(encoding="utf-8").count("My notes. ") == 3


@pytest.mark.parametrize("content", [b"", b"{", b'{"cells": [{}]}', b"\xff\xfe"])
def test_a_first_notebook_that_cannot_be_read_is_left_alone(
    folder: Path, chapter_5: Path, content: bytes
) -> None:
    (folder / WELCOME).write_bytes(content)
    working_copy.make_copy(folder, chapter_5)
    assert (folder / WELCOME).read_bytes() == content
