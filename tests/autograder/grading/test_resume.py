"""An engine that is killed goes on where it was: nothing lost, nothing graded twice."""

from __future__ import annotations

import os
import random
import shutil
import signal
import subprocess
import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import pytest
from filelock import FileLock
from nbgrader.api import Gradebook

from autograder.examination import points
from autograder.gradebook.course_gradebook import CourseGradebook
from autograder.grading import engine
from autograder.grading.engine import BusyError, Graded
from autograder.grading.run_progress import RunProgress
from autograder.running import runner
from autograder.sandbox import SandboxError
from tests.autograder.conftest import ASSIGNMENT, NOTEBOOK, Course, Undisturbed
from tests.killing import Engine, copy_outcomes, episode, fresh_copy
from tests.machine import needs_sandbox

# Many engines are started, and nbgrader swallows a time-out that strikes inside it, as any error.
pytestmark = [needs_sandbox, pytest.mark.xdist_group("class"), pytest.mark.timeout(900)]

KILL, INT, TERM = signal.SIGKILL, signal.SIGINT, signal.SIGTERM
BUBBLEWRAP = shutil.which("bwrap")


def course_of(class_: Undisturbed, tmp_path: Path, *, graded: bool = True) -> Course:
    return Course(fresh_copy(class_.graded if graded else class_.ungraded, tmp_path / "course"))


@pytest.mark.parametrize(
    ("kept", "signals"),
    [(False, [KILL, TERM, KILL]), (True, [KILL, INT, KILL])],
    ids=["while submissions run", "while grades are entered"],
)
def test_an_engine_that_is_killed_goes_on_where_it_was(
    class_: Undisturbed, tmp_path: Path, kept: bool, signals: list[signal.Signals]
) -> None:
    course = course_of(class_, tmp_path, graded=False)
    if kept:
        copy_outcomes(class_.graded, course.root)
    whole = Engine(course.root, ASSIGNMENT, tmp_path / "scratch")
    seed = random.SystemRandom().randrange(10**6)
    kills = episode(whole, random.Random(seed), class_.seconds, signals)
    before = whole.outcomes()
    whole.finish()
    whole.check(before)
    assert whole.grades() == class_.grades, f"seed {seed}, {kills} kills"
    assert len(whole.outcomes()) == 2, "two students handed in the same"
    assert "4 submissions have not changed" in whole.finish()


@pytest.mark.parametrize("arguments", [(), ("--fresh",)])
def test_grading_anew_goes_on_where_it_was_killed(
    class_: Undisturbed, tmp_path: Path, arguments: tuple[str, ...]
) -> None:
    course = course_of(class_, tmp_path)
    anew = Engine(course.root, ASSIGNMENT, tmp_path / "scratch", ("--fresh",), jobs=1)
    first = anew.outcomes()

    def made_again() -> dict[str, tuple[int, int]]:
        return {name: mark for name, mark in anew.outcomes().items() if mark != first[name]}

    deadline = time.monotonic() + 120
    with anew.start() as process:
        while not made_again():
            with suppress(subprocess.TimeoutExpired):
                process.wait(0.02)
            assert process.poll() is None, process.communicate()
            assert time.monotonic() < deadline, "nothing is run again"
        os.killpg(process.pid, KILL)
    kept = made_again()
    said = replace(anew, arguments=arguments).finish()
    assert "Going on with the run with --fresh" in said
    after = made_again()
    assert len(after) == 2, "what was not run again by then is not taken from before"
    assert kept.items() <= after.items(), "what was run again by then is not run once more"
    assert anew.grades() == class_.grades
    assert "4 submissions have not changed" in replace(anew, arguments=()).finish()


class Seen(RunProgress):
    """What an engine did: notebooks that were run, students that were entered, lines."""

    def __init__(self) -> None:
        self.run = 0
        self.unchanged = 0
        self.entered: list[str] = []

    def begin(self, submissions: int, notebooks: int, unchanged: int) -> None:
        self.unchanged = unchanged

    def notebook_ran(self, waited: bool) -> None:
        self.run += waited

    def submission_done(self, graded: Graded) -> None:
        self.entered.append(graded.student)


def again(course: Course, **options: bool) -> Seen:
    seen = Seen()
    engine.grade(course.root, ASSIGNMENT, progress=seen, **options)
    return seen


def test_what_has_not_changed_is_left_as_it_is(class_: Undisturbed, tmp_path: Path) -> None:
    course = course_of(class_, tmp_path)
    opened = course.root / "source" / ASSIGNMENT / ".ipynb_checkpoints"
    opened.mkdir()
    (opened / f"{NOTEBOOK}-checkpoint.ipynb").write_text("{}")  # as JupyterLab makes one
    seen = again(course)
    assert (seen.run, seen.unchanged, seen.entered) == (0, 4, [])
    problems = {g.student: g.problem for g in engine.grade(course.root, ASSIGNMENT)}
    assert "not valid JSON" in problems["cut-off"], "it is said again of what is left as it is"

    course.submit("same", course.released)
    (course.folder("wrong") / "timestamp.txt").write_text("2030-01-31 12:00:00 UTC")
    seen = again(course)
    assert (seen.run, seen.unchanged, seen.entered) == (1, 2, ["same", "wrong"][::-1])


def test_what_is_missing_is_made_again(class_: Undisturbed, tmp_path: Path) -> None:
    course = course_of(class_, tmp_path)
    shutil.rmtree(course.root / "autograded" / "right")
    (course.root / "feedback" / "wrong" / ASSIGNMENT / f"{NOTEBOOK}.html").unlink()
    with Gradebook(f"sqlite:///{course.root / 'gradebook.db'}") as book:
        book.remove_submission(ASSIGNMENT, "same")
    seen = again(course)
    assert (seen.run, sorted(seen.entered)) == (0, ["right", "same"])
    assert (course.root / "feedback" / "wrong" / ASSIGNMENT / f"{NOTEBOOK}.html").is_file()
    assert {
        g.student: g for g in CourseGradebook(course.root).read_grades(ASSIGNMENT)
    } == class_.grades


def test_marks_that_a_person_gives_get_into_the_feedback(
    class_: Undisturbed, tmp_path: Path
) -> None:
    course = course_of(class_, tmp_path)
    with Gradebook(f"sqlite:///{course.root / 'gradebook.db'}") as book:
        for cell in points.table()["qos"].manual:
            grade = book.find_grade(cell, NOTEBOOK, ASSIGNMENT, "right")
            grade.manual_score, grade.needs_manual_grade = 0.5, False
        comment = book.find_comment("qos-explanation-depth", NOTEBOOK, ASSIGNMENT, "right")
        comment.manual_comment = "Well argued, Countess."
        book.db.commit()
    seen = again(course)
    assert (seen.run, seen.entered) == (0, [])
    page = course.root / "feedback" / "right" / ASSIGNMENT / f"{NOTEBOOK}.html"
    assert "Well argued, Countess." in page.read_text()
    seen = again(course, fresh=True)
    assert seen.run == 3
    found = {g.student: g for g in CourseGradebook(course.root).read_grades(ASSIGNMENT)}
    assert found["right"].score == class_.grades["right"].score + 1.0
    assert not found["right"].needs_manual_grade, "the work is the same"
    course.submit("right", course.released)
    again(course)
    found = {g.student: g for g in CourseGradebook(course.root).read_grades(ASSIGNMENT)}
    assert found["right"].needs_manual_grade, "the work is another"


def test_a_penalty_for_lateness_is_taken_off(class_: Undisturbed, tmp_path: Path) -> None:
    course = course_of(class_, tmp_path)
    with Gradebook(f"sqlite:///{course.root / 'gradebook.db'}") as book:
        for student, penalty in (("right", 1.5), ("wrong", 1000.0)):
            late = book.find_submission_notebook(NOTEBOOK, ASSIGNMENT, student)
            late.late_submission_penalty = penalty
        book.db.commit()
    found = {g.student: g.score for g in CourseGradebook(course.root).read_grades(ASSIGNMENT)}
    assert found["right"] == class_.grades["right"].score - 1.5
    assert (found["wrong"], found["same"]) == (0.0, class_.grades["same"].score)


def test_scores_that_somebody_else_entered_are_put_right(
    class_: Undisturbed, tmp_path: Path
) -> None:
    course = course_of(class_, tmp_path)
    with Gradebook(f"sqlite:///{course.root / 'gradebook.db'}") as book:
        book.find_grade("qos-visible", NOTEBOOK, ASSIGNMENT, "wrong").auto_score = 0
        book.db.commit()
    seen = again(course)
    assert (seen.run, seen.entered) == (0, ["wrong"])
    assert {
        g.student: g for g in CourseGradebook(course.root).read_grades(ASSIGNMENT)
    } == class_.grades


def test_a_mistake_of_the_grader_is_tried_again(
    class_: Undisturbed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    course = course_of(class_, tmp_path)
    course.submit("right", course.released)
    with monkeypatch.context() as broken:
        broken.setattr(runner, "START_TIMEOUT_S", 0.0)
        again(course)
    found = {g.student: g for g in CourseGradebook(course.root).read_grades(ASSIGNMENT)}
    assert found["right"].needs_manual_grade
    feedback = course.root / "feedback" / "right" / ASSIGNMENT / f"{NOTEBOOK}.html"
    assert "did not start" in feedback.read_text()
    seen = again(course)
    assert (seen.run, seen.entered) == (1, ["right"])


def test_a_mistake_of_the_grader_that_passes_costs_nobody_a_grade(
    class_: Undisturbed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    course = course_of(class_, tmp_path, graded=False)
    timeouts = iter([0.0])
    monkeypatch.setattr(
        runner.Channel, "receive", lambda channel, timeout, real=runner.Channel.receive:
        real(channel, next(timeouts, timeout)),
    )  # fmt: skip
    engine.grade(course.root, ASSIGNMENT, jobs=1)
    assert next(timeouts, None) is None
    assert {
        g.student: g for g in CourseGradebook(course.root).read_grades(ASSIGNMENT)
    } == class_.grades


def refuse(folder: Path, monkeypatch: pytest.MonkeyPatch, times: int) -> None:
    """Have the next ``times`` sandboxes refused, as on a machine that is out of processes."""
    (folder / "left").write_text(str(times))
    bubblewrap = folder / "bwrap"
    bubblewrap.write_text(
        "#!/bin/sh\n"
        f"left=$(cat {folder}/left)\n"
        'if [ "$1" = --args ] && [ "$left" -gt 0 ]; then\n'
        f"    echo $((left - 1)) > {folder}/left\n"
        "    echo 'Creating new namespace failed: out of processes' >&2; exit 1\n"
        f'fi\nexec {BUBBLEWRAP} "$@"\n'
    )
    bubblewrap.chmod(0o755)
    monkeypatch.setenv("PATH", f"{folder}:{os.environ['PATH']}")


def test_a_machine_that_refuses_for_a_moment_costs_nobody_a_grade(
    class_: Undisturbed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    course = course_of(class_, tmp_path, graded=False)
    refuse(tmp_path, monkeypatch, 2)
    engine.grade(course.root, ASSIGNMENT, jobs=1)
    assert (tmp_path / "left").read_text() == "0\n"
    assert {
        g.student: g for g in CourseGradebook(course.root).read_grades(ASSIGNMENT)
    } == class_.grades


def test_a_machine_that_goes_on_refusing_ends_the_run_with_the_reason(
    class_: Undisturbed, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    course = course_of(class_, tmp_path, graded=False)
    refuse(tmp_path, monkeypatch, 1000)
    with pytest.raises(SandboxError, match=r"not be started in 3 tries \(.*out of processes"):
        engine.grade(course.root, ASSIGNMENT, jobs=1)
    (tmp_path / "left").write_text("0")
    engine.grade(course.root, ASSIGNMENT, jobs=1)
    assert {
        g.student: g for g in CourseGradebook(course.root).read_grades(ASSIGNMENT)
    } == class_.grades


def test_one_engine_at_a_time(class_: Undisturbed, tmp_path: Path) -> None:
    course = course_of(class_, tmp_path)
    with (
        FileLock(course.root / engine.LOCK),
        pytest.raises(BusyError, match="Another `autograder grade` is at work"),
    ):
        engine.grade(course.root, ASSIGNMENT)


def test_the_number_of_jobs_does_not_matter(class_: Undisturbed, tmp_path: Path) -> None:
    course = course_of(class_, tmp_path, graded=False)
    engine.grade(course.root, ASSIGNMENT, jobs=1)
    assert {
        g.student: g for g in CourseGradebook(course.root).read_grades(ASSIGNMENT)
    } == class_.grades
