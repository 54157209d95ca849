"""``autograder demo``: the whole way once, from text sources to grades, on a bundled class."""

from __future__ import annotations

import shutil
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import nbformat

from autograder import corpus
from autograder.assignments import listing, submission
from autograder.assignments.build_notebooks import build
from autograder.class_report.platforms import grades_csv
from autograder.corpus import Case
from autograder.corpus.command import needs_trust
from autograder.corpus.trials import notebooks_of
from autograder.examination import points
from autograder.gradebook.course_gradebook import CourseGradebook, Grade
from autograder.gradebook.release import make_release
from autograder.grading import engine
from autograder.grading.engine import Graded
from autograder.grading.run_progress import Collecting, RunProgress
from autograder.util import exercise_folders
from course.errors import CourseError
from course.workspace.content import content_root

ASSIGNMENT = "ch05"

CUT_OFF = "(cut off)"

Class = dict[str, dict[str, str]]
"""{student: {exam: corpus case}}, and a ``title``."""


Cases = dict[str, dict[str, Case]]
"""{exam: {name: case}}."""


@dataclass(frozen=True)
class DemoRow:
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
    rows: tuple[DemoRow, ...]

    @property
    def as_expected(self) -> bool:
        """Whether every submission got the verdict that it must get."""
        return not any(row.difference for row in self.rows)


def run_demo(
    folder: Path,
    *,
    every: bool = False,
    jobs: int = 2,
    say: Callable[[str], None] = lambda _line: None,
    progress: RunProgress = engine.QUIET,
) -> Demo:
    """Build, release, collect the bundled class, grade it, and write feedback and grades.

    Args:
        folder: where to work; a demo that is there already is replaced, nothing else ever is.
        every: all exercises of the assignment, which takes some minutes; else the first one.
        jobs: how many submissions are run at a time.
        say: is told what happens, a line a step.
        progress: is told about each submission.

    Raises:
        CourseError: ``folder`` holds something that is not a demo.
    """
    exercise_folders.use_course(content_root())
    cases = _load_cases()
    class_ = bundled_class(cases, every=every)
    handed_in = {exam for student in class_.values() for exam in student}
    cases = {exam: own for exam, own in cases.items() if exam in handed_in}
    root = _course_root(folder, list(cases))
    say(f"Building the notebooks in {root}")
    build(root)
    say(f"Releasing {ASSIGNMENT} with nbgrader")
    make_release(root, ASSIGNMENT)
    collect_submissions(root, class_, cases)
    say(f"Collected {len(class_)} submissions; grading them on real DDS")
    trust = needs_trust(say)
    graded: dict[str, Graded] = {}
    engine.grade(
        root, ASSIGNMENT, jobs=jobs, trust=trust, progress=Collecting(graded, then=progress)
    )
    grades = CourseGradebook(root).read_grades(ASSIGNMENT)
    csv = root / "grades.csv"
    grades_csv.write_grades({ASSIGNMENT: grades}, csv)
    by_student = {grade.student: grade for grade in grades}
    rows = [_make_row(class_[s], graded[s], by_student[s], cases) for s in sorted(graded)]
    return Demo(root, csv, tuple(rows))


def bundled_class(cases: Cases, *, every: bool) -> Class:
    """Return the bundled class: of all exercises, or of the first one."""
    bundled = tomllib.loads(exercise_folders.DEMO_CLASS.read_text(encoding="utf-8"))
    if every:
        return dict(bundled["all"])
    first = bundled["first"]
    exam = first["exam"]
    class_: Class = {
        name: {"title": cases[exam][name].title, exam: name} for name in first["cases"]
    }
    return {**class_, first["damaged"]: {"title": "A file that was cut off", exam: CUT_OFF}}


def _load_cases() -> Cases:
    return {
        exam: {case.name: case for case in corpus.load_cases(exam)}
        for exam in listing.read_assignment(content_root(), ASSIGNMENT).exercises
    }


def collect_submissions(root: Path, class_: Class, cases: Cases) -> None:
    """Write what the class hands in into the course's ``submitted`` folder."""
    for student, handed_in in class_.items():
        folder = root / "submitted" / student / ASSIGNMENT
        folder.mkdir(parents=True, exist_ok=True)
        for exam in cases:
            if exam in handed_in:
                _hand_in(root, folder, exam, handed_in[exam], cases[exam])


def _hand_in(root: Path, folder: Path, exam: str, name: str, cases: dict[str, Case]) -> None:
    file = f"{points.table()[exam].notebook}.ipynb"
    released_file = root / "release" / ASSIGNMENT / file
    if name == CUT_OFF:
        whole = released_file.read_text(encoding="utf-8")
        (folder / file).write_text(whole[: len(whole) // 2], encoding="utf-8")
        return
    source = submission.read_notebook(root / "source" / ASSIGNMENT / file)
    handed_in = cases[name].make_submission(source, submission.read_notebook(released_file))
    nbformat.write(handed_in, folder / file)  # type: ignore[no-untyped-call]


def _course_root(folder: Path, exams: list[str]) -> Path:
    """Return a fresh course root in ``folder`` with the package's own sources of these exams."""
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
    return notebooks_of(folder, exams, ASSIGNMENT)


def _make_row(handed_in: dict[str, str], graded: Graded, grade: Grade, cases: Cases) -> DemoRow:
    """Return a student's line: what had to come out, and what came out differently."""
    expected, differences = [], []
    for exam, own in cases.items():
        outcome = graded.outcomes[points.table()[exam].notebook]
        name = handed_in.get(exam)
        if name is None or name == CUT_OFF:
            unseen = "not handed in" if name is None else "unreadable"
            checked = [c for v in outcome.verdicts.values() for c in v.checks if c.points]
            differences += [f"{exam}: it has points"] if checked else []
            expected.append(f"{exam}: {unseen}" if len(cases) > 1 else unseen)
        else:
            differences += [f"{exam}: {d}" for d in [own[name].verdict_of(outcome)] if d]
            fails = own[name].fails_in_words if own[name].fails else ""
            expected += [f"{exam}: {fails}" if len(cases) > 1 else fails] if fails else []
    return DemoRow(
        graded.student, handed_in["title"], grade, "; ".join(expected) or "nothing",
        "; ".join(differences),
    )  # fmt: skip
