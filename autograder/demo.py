"""``autograder demo``: the whole way once, from text sources to grades, on a bundled class."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import nbformat

from autograder import corpus, engine, submission
from autograder.build import build
from autograder.corpus.command import untrusting
from autograder.engine import Graded, Progress
from autograder.gradebook import CourseGradebook, Grade, write_csv
from autograder.release import release
from course.content import content_root, copy_authoring, corpus_root
from course.errors import CourseError

ASSIGNMENT, NOTEBOOK, EXAM = "ch05", "qos-design", "qos"

CLASS = (
    "right-chapter", "right-sensor-data", "right-two-sides", "right-plain-nodes",
    "wrong-stub", "wrong-camera-reliable", "wrong-imu-endless", "wrong-stop-best-effort",
    "wrong-lidar-durable", "wrong-incompatible", "broken-syntax",
)  # fmt: skip
"""The students of the bundled class, by the corpus case that each hands in."""

DAMAGED = "broken-file"
"""One more student: the file was cut off on the way."""


@dataclass(frozen=True)
class Row:
    """One student's line of the demo's table."""

    student: str
    title: str
    grade: Grade
    expected: str
    difference: str


@dataclass(frozen=True)
class Demo:
    """Where the demo left everything, and what came out."""

    root: Path
    csv: Path
    rows: tuple[Row, ...]

    @property
    def as_expected(self) -> bool:
        """Whether every submission got the verdict that it must get."""
        return not any(row.difference for row in self.rows)


def run(
    folder: Path,
    *,
    jobs: int = 2,
    say: Callable[[str], None] = lambda _line: None,
    progress: Progress = lambda _student, _graded: None,
) -> Demo:
    """Build, release, collect the bundled class, grade it, and write feedback and grades.

    Args:
        folder: where to work; a demo that is there already is replaced, nothing else ever is.
        jobs: how many submissions are run at a time.
        say: is told what happens, a line a step.
        progress: is told about each submission.

    Raises:
        CourseError: ``folder`` holds something that is not a demo.
    """
    root = _course_root(folder)
    say(f"Building the notebooks in {root}")
    build(root)
    say(f"Releasing {ASSIGNMENT} with nbgrader")
    release(root, ASSIGNMENT)
    cases = {case.name: case for case in corpus.load(corpus_root(), EXAM)}
    students = collect(root, [cases[name] for name in CLASS])
    say(f"Collected {len(students)} submissions; grading them on real DDS")
    trust = untrusting(say)
    graded = engine.grade(root, ASSIGNMENT, jobs=jobs, trust=trust, progress=progress)
    grades = CourseGradebook(root).grades(ASSIGNMENT)
    csv = root / "grades.csv"
    write_csv(grades, ASSIGNMENT, csv)
    rows = _rows(cases, {g.student: g for g in graded}, grades)
    return Demo(root, csv, tuple(rows))


def collect(root: Path, cases: list[corpus.Case]) -> list[str]:
    """Write one submission a case into the course's ``submitted`` folder; return the students."""
    source, released = (
        submission.read(root / step / ASSIGNMENT / f"{NOTEBOOK}.ipynb")
        for step in ("source", "release")
    )
    for case in cases:
        folder = _submitted(root, case.name)
        nbformat.write(case.submission(source, released), folder / f"{NOTEBOOK}.ipynb")  # type: ignore[no-untyped-call]
    whole = (root / "release" / ASSIGNMENT / f"{NOTEBOOK}.ipynb").read_text(encoding="utf-8")
    damaged = _submitted(root, DAMAGED) / f"{NOTEBOOK}.ipynb"
    damaged.write_text(whole[: len(whole) // 2], encoding="utf-8")
    return [*(case.name for case in cases), DAMAGED]


def _submitted(root: Path, student: str) -> Path:
    folder = root / "submitted" / student / ASSIGNMENT
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _course_root(folder: Path) -> Path:
    """Return a fresh course root in ``folder``, made of the package's own sources."""
    marker = folder / ".ros2-course-demo"
    if folder.exists() and any(folder.iterdir()) and not marker.exists():
        raise CourseError(
            f"{folder} is not empty and not an earlier demo, so it is left alone: name another "
            "folder with --dir."
        )
    try:
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        marker.touch()
    except OSError as error:
        raise CourseError(
            f"The demo cannot write to {folder} ({error.strerror}): name a folder with --dir."
        ) from error
    return copy_authoring(content_root(), folder)


def _rows(
    cases: dict[str, corpus.Case], graded: dict[str, Graded], grades: list[Grade]
) -> list[Row]:
    rows = []
    for grade in grades:
        outcome = graded[grade.student].outcomes[NOTEBOOK]
        case = cases.get(grade.student)
        if case is None:
            difference = "" if outcome.unreadable else "it was read, though it is damaged"
            rows.append(
                Row(grade.student, "A file that was cut off", grade, "unreadable", difference)
            )
            continue
        difference = case.verdict_of(outcome)
        rows.append(Row(grade.student, case.title, grade, case.fails_in_words, difference))
    return rows
