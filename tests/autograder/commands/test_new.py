"""From nothing to a graded exercise of one's own: a course, an exercise, a quiz, a first try."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from autograder import cli
from autograder.assignments import listing
from autograder.assignments.build_notebooks import build
from autograder.assignments.cells import AssignmentBuildError
from autograder.commands import new_command, try_command
from autograder.commands.new_command import NewError
from autograder.corpus import command
from autograder.examination.exam import ExamError
from autograder.util import exercise_folders
from course.workspace.content import ContentError
from tests.machine import needs_sandbox


@pytest.fixture(autouse=True)
def only_the_packages_afterwards() -> object:
    yield
    exercise_folders.use_course(None)


@pytest.fixture
def root(tmp_path: Path) -> Path:
    return new_command.make_course(tmp_path / "course")


def run(*arguments: object) -> Result:
    return CliRunner().invoke(cli.app, [str(argument) for argument in arguments])


def test_a_course_an_exercise_and_a_quiz_are_made_by_three_commands(tmp_path: Path) -> None:
    course = tmp_path / "mine"
    assert run("new", "course", course).exit_code == 0
    assert run("new", "exercise", "lamp", "--assignment", "lab1", "--root", course).exit_code == 0
    assert run("new", "quiz", "week1", "--root", course).exit_code == 0
    assert {path.name for path in course.iterdir()} == {
        "authoring", "exercises", "nbgrader_config.py",
    }  # fmt: skip
    exercise_folders.use_course(course)
    assert [path.name for path in build(course)][:1] == ["lamp.ipynb"]
    assert run("quiz", "lint", "week1", "--root", course).exit_code == 0


@needs_sandbox
def test_a_new_exercise_gets_the_verdicts_of_its_corpus(root: Path) -> None:
    new_command.make_exercise(root, "lamp", "lab1")
    exercise_folders.use_course(root)
    trials = command.run_corpus("lamp", only=["right-exemplar", "right-two-timers",
                                              "wrong-always-on", "wrong-stub"])  # fmt: skip
    assert {trial.case.name: trial.difference for trial in trials} == {
        "right-exemplar": "", "right-two-timers": "", "wrong-always-on": "", "wrong-stub": "",
    }  # fmt: skip


@needs_sandbox
def test_a_try_shows_step_by_step_what_was_done_and_seen(root: Path, tmp_path: Path) -> None:
    new_command.make_exercise(root, "lamp", "lab1")
    exercise_folders.use_course(root)
    shown = "\n".join(try_command.try_exam("lamp").as_lines())
    assert "✔ blinks (1 of 1): The lamp changes twice a second." in shown
    assert "5 s pass: /lamp: True, False" in shown
    wrong = "\n".join(try_command.try_exam("lamp", "wrong-always-on").as_lines())
    assert "seen:   True came twice in a row." in wrong
    build(root)
    solved = try_command.try_exam("lamp", str(root / "source" / "lab1" / "lamp.ipynb"))
    assert solved.outcome.verdicts["lamp-visible"].score == 2


def test_a_change_of_a_file_is_a_reason_to_try_again(root: Path) -> None:
    folder = new_command.make_exercise(root, "lamp", "lab1")
    exercise_folders.use_course(root)
    files = try_command.watched_files("lamp")
    assert folder / "exam.py" in files
    before = try_command.changed_ns(files)
    (folder / "exam.py").write_text("# changed\n")
    assert try_command.changed_ns(files) > before


def test_what_there_is_already_is_not_replaced(root: Path) -> None:
    new_command.make_exercise(root, "lamp", "lab1")
    with pytest.raises(NewError, match="There is an exercise 'lamp' already"):
        new_command.make_exercise(root, "lamp", "lab1")
    with pytest.raises(NewError, match="There is an exercise 'qos' already"):
        new_command.make_exercise(root, "qos", "lab1")
    with pytest.raises(NewError, match="is not empty"):
        new_command.make_course(root)
    new_command.make_quiz(root, "week1")
    with pytest.raises(NewError, match="There is a quiz"):
        new_command.make_quiz(root, "week1")


@pytest.mark.parametrize("name", ["Lamp", "my-lamp", "1lamp", "../lamp", ""])
def test_a_name_that_no_module_could_have_is_refused(root: Path, name: str) -> None:
    with pytest.raises(NewError, match="cannot be called"):
        new_command.make_exercise(root, name, "lab1")


def test_a_folder_that_is_no_course_is_said_so(tmp_path: Path) -> None:
    for arguments in (
        ("new", "exercise", "lamp", "--assignment", "lab1"), ("build",), ("corpus",),
        ("try", "qos"), ("mutate", "qos"), ("grade", "ch05"), ("marks", "export", "ch05"),
        ("quiz", "lint", "ch05"),
    ):  # fmt: skip
        result = run(*arguments, "--root", tmp_path)
        assert isinstance(result.exception, ContentError)
        assert "is no course root" in str(result.exception)


@pytest.mark.parametrize(
    ("before", "after"),
    [
        (None, ["lamp"]),
        ('# why\nexercises = ["qos"]\n', ["qos", "lamp"]),
        ('exercises = [\n    "qos",\n]\nquizzes = ["quiz"]\n', ["qos", "lamp"]),
        ("exercises = []\n", ["lamp"]),
        ('quizzes = ["quiz"]\n', ["lamp"]),
    ],
)
def test_an_exercise_is_added_to_its_assignment(
    root: Path, before: str | None, after: list[str]
) -> None:
    file = root / listing.ASSIGNMENTS / "lab1.toml"
    if before is not None:
        file.write_text(before)
    listing.add_exercise(root, "lab1", "lamp")
    text = file.read_text()
    assert tomllib.loads(text)["exercises"] == after
    assert before is None or before.splitlines()[0].split("=")[0] in text


def test_a_list_that_is_no_toml_is_not_touched(root: Path) -> None:
    file = root / listing.ASSIGNMENTS / "lab1.toml"
    file.write_text("exercises = [\n")
    with pytest.raises(AssignmentBuildError, match="is no TOML"):
        listing.add_exercise(root, "lab1", "lamp")
    assert file.read_text() == "exercises = [\n"


@pytest.mark.parametrize(
    ("file", "old", "new", "said"),
    [
        (
            "exam.py",
            "EXAM:",
            "raise ValueError('boo')\nEXAM:",
            "ValueError: boo, in .*exam.py",
        ),
        ("exam.py", "EXAM:", "def broken(:\nEXAM:", "SyntaxError: invalid syntax, in .*line"),
        ("points.toml", "blinks = 1", "", "check 'blinks' of exam 'lamp' has no points: name it"),
        ("points.toml", "blinks =", "blinkss =", "'blinkss' .* lacks. Did you mean 'blinks'"),
        ("points.toml", "on_and_off = 1", "on_and_off = 1\nblinks = 1", "has points 2 times"),
    ],
)
def test_build_says_what_of_an_exam_does_not_fit(
    root: Path, file: str, old: str, new: str, said: str
) -> None:
    folder = new_command.make_exercise(root, "lamp", "lab1")
    text = (folder / file).read_text()
    (folder / file).write_text(text.replace(old, new, 1))
    result = run("build", "--root", root)
    assert isinstance(result.exception, ExamError)
    assert re.search(said, str(result.exception))
    assert not (root / "source").exists()


def test_build_says_which_exercise_is_in_no_assignment(root: Path) -> None:
    new_command.make_exercise(root, "lamp", "lab1")
    listing.write_list(root, "lab1", ["qos"])
    result = run("build", "--root", root)
    assert "The exercise 'lamp' is in no assignment" in result.output
