"""Grade a whole assignment: run submissions side by side, enter scores one by one.

Running is parallel, because a subject mostly waits; the gradebook has one writer, this process.
"""

from __future__ import annotations

import copy
import shutil
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, replace
from pathlib import Path

import nbformat
from nbformat import NotebookNode
from nbgrader.utils import parse_utc

from autograder import nbgrader_bridge as bridge
from autograder import quiz_marks, runner, sandbox, submission
from autograder.gradebook import CourseGradebook, GradebookError
from autograder.runner import Outcome
from autograder.store import OutcomeStore, StoreError
from autograder.submission import SubmissionError
from autograder.verdict import Status
from course.errors import CourseError

GLOB = "*?[]"
STAGED = f"{bridge.WORK_FOLDER}/staged"


class AssignmentError(CourseError):
    """An assignment that does not exist or is not ready; the message names what there is."""


@dataclass(frozen=True)
class Graded:
    """One student's submission: outcomes by notebook, and what a person should know about it.

    ``entered`` is False if the gradebook did not take the scores.
    """

    student: str
    outcomes: dict[str, Outcome]
    problem: str = ""
    entered: bool = True


Progress = Callable[[str, Graded | None], None]
"""Told (student, None) when a submission is taken up and (student, Graded) when it is done."""


def grade(
    root: Path,
    assignment: str,
    *,
    jobs: int = 2,
    fresh: bool = False,
    trust: bool = False,
    feedback: bool = True,
    progress: Progress = lambda _student, _graded: None,
) -> list[Graded]:
    """Grade every submission of an assignment into the gradebook of the course at ``root``.

    Args:
        root: the nbgrader course root.
        assignment: its name.
        jobs: how many notebooks are run at a time.
        fresh: run also what was run before and has not changed.
        trust: run submissions outside of a sandbox, with the rights of this process.
        feedback: write HTML feedback, too.
        progress: is told about each submission.

    Raises:
        AssignmentError: no such assignment, not released, or nothing submitted.
        GradebookError: the gradebook itself cannot be used.
        SandboxError: they are not trusted, and there is no working sandbox here.
    """
    if not trust:
        sandbox.require()
    gradebook = CourseGradebook(root, staged=STAGED)
    names = _notebooks(gradebook, assignment)
    students = _students(root, assignment)
    store = OutcomeStore(root / bridge.WORK_FOLDER / "outcomes", trust=trust, hidden=[root])
    class_ = _Class(gradebook, assignment, names, store, fresh)
    graded = [_unusable(student) for student in students if set(student) & set(GLOB)]
    students = [student for student in students if not set(student) & set(GLOB)]
    with ThreadPoolExecutor(max_workers=jobs) as pool:
        # Notebook by notebook, so that one student's run side by side, too.
        futures = {
            pool.submit(class_.run, student, name, progress): (student, name)
            for student in students
            for name in names
        }
        try:
            for future in as_completed(futures):
                if whole := class_.collect(*futures[future], future.result()):
                    graded.append(class_.enter(whole, feedback))
                    progress(graded[-1].student, graded[-1])
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return sorted(graded, key=lambda item: item.student)


class _Class:
    """The submissions of one assignment on their way into the gradebook."""

    def __init__(
        self,
        gradebook: CourseGradebook,
        assignment: str,
        notebooks: list[str],
        store: OutcomeStore,
        fresh: bool,
    ) -> None:
        self._gradebook = gradebook
        self._assignment = assignment
        self._root = gradebook.root
        self._store = store
        self._fresh = fresh
        self._originals = {
            name: bridge.originals(gradebook.coursedir, assignment, name) for name in notebooks
        }
        self._begun: dict[str, list[str]] = {}
        self._outcomes: dict[str, dict[str, Outcome]] = {}
        self._lock = threading.Lock()

    def run(self, student: str, name: str, progress: Progress) -> Outcome:
        """Stage and run one of a student's notebooks. Runs in a worker thread."""
        submitted = self._submitted(student)
        with self._lock:
            if student not in self._begun:
                progress(student, None)
                self._begun[student] = self._begin(student)
        notebook, outcome = self._one(submitted / f"{name}.ipynb")
        outcome = quiz_marks.with_quizzes(outcome, notebook, submitted, student)
        nbformat.write(notebook, self._staged(student) / f"{name}.ipynb")  # type: ignore[no-untyped-call]
        return outcome

    def collect(self, student: str, name: str, outcome: Outcome) -> Graded | None:
        """Keep an outcome; return all of a student's once the last one is there."""
        outcomes = self._outcomes.setdefault(student, {})
        outcomes[name] = outcome
        if len(outcomes) < len(self._originals):
            return None
        problems = list(self._begun[student])
        for key in self._originals:
            problems += outcomes[key].notes if outcomes[key].unreadable else []
        ordered = {key: outcomes[key] for key in self._originals}
        return Graded(student, ordered, " ".join(problems))

    def _begin(self, student: str) -> list[str]:
        """Make room for a student's notebooks; return what is wrong with the submission."""
        staged = self._staged(student)
        shutil.rmtree(staged, ignore_errors=True)
        staged.mkdir(parents=True)
        return _stage_timestamp(self._submitted(student), staged)

    def _submitted(self, student: str) -> Path:
        return self._root / "submitted" / student / self._assignment

    def _staged(self, student: str) -> Path:
        return self._root / STAGED / student / self._assignment

    def _one(self, path: Path) -> tuple[NotebookNode, Outcome]:
        source, released = self._originals[path.stem]
        try:
            notebook, notes = submission.restore(submission.read(path), source, released)
            program = submission.program(notebook)
            files = submission.extras(path.parent)
        except SubmissionError as error:
            notebook, outcome = self._refused(path.stem, str(error), "not_checked")
            # Whoever hands in some of the notebooks has left the others out: nothing to look into.
            left_out = not path.exists() and any(path.parent.glob("*.ipynb"))
            return notebook, replace(outcome, unreadable=not left_out)
        except Exception as error:  # noqa: BLE001 - one student's data must not end the class
            return self._refused(path.stem, f"{type(error).__name__}: {error}", "grader_error")
        notebook.metadata[bridge.NOTES_KEY] = notes
        try:
            return notebook, self._store.outcome(program, files, fresh=self._fresh)
        except StoreError:
            raise
        except Exception as error:  # noqa: BLE001 - the same: a person looks at this one
            return self._refused(path.stem, f"{type(error).__name__}: {error}", "grader_error")

    def _refused(self, name: str, reason: str, status: Status) -> tuple[NotebookNode, Outcome]:
        """Return the released notebook in place of one that cannot be run, and why."""
        source, released = self._originals[name]
        blank: NotebookNode = copy.deepcopy(released)
        notebook, _ = submission.restore(blank, source, released)
        return notebook, runner.refuse(submission.program(notebook), reason, status)

    def enter(self, graded: Graded, feedback: bool) -> Graded:
        """Enter one student's outcomes into the gradebook. Runs in the one writer."""
        for name, outcome in graded.outcomes.items():
            bridge.prepared[self._assignment, graded.student, name] = outcome
        try:
            self._gradebook.autograde(self._assignment, graded.student)
            if feedback:
                self._gradebook.generate_feedback(self._assignment, graded.student)
        except GradebookError as error:
            return Graded(graded.student, graded.outcomes, str(error), entered=False)
        finally:
            for name in graded.outcomes:
                bridge.prepared.pop((self._assignment, graded.student, name), None)
        return graded


def _unusable(student: str) -> Graded:
    problem = (
        f"nbgrader takes one of the characters {' '.join(GLOB)} in the folder name '{student}' for "
        "a pattern: rename the folder."
    )
    return Graded(student, {}, problem, entered=False)


def _stage_timestamp(submitted: Path, staged: Path) -> list[str]:
    """Copy the time of submission if nbgrader can read it; return what is wrong with it."""
    file = submitted / "timestamp.txt"
    if not file.is_file():
        return []
    try:
        text = file.read_text(encoding="utf-8").strip()
        parse_utc(text)
    except (ValueError, OverflowError, UnicodeError, OSError):
        return ["timestamp.txt holds no date, so the time of submission is unknown."]
    (staged / "timestamp.txt").write_text(text, encoding="utf-8")
    return []


def _notebooks(gradebook: CourseGradebook, assignment: str) -> list[str]:
    """Return the notebooks of a released assignment, or say what is missing."""
    known = gradebook.assignments()
    if assignment not in known:
        sources = sorted(
            path.name for path in (gradebook.root / "source").glob("*") if path.is_dir()
        )
        if assignment in sources:
            raise AssignmentError(
                f"The assignment '{assignment}' has not been released: run "
                f"`autograder release {assignment}` first."
            )
        raise AssignmentError(
            f"There is no assignment '{assignment}' in {gradebook.root}: there are "
            f"{', '.join(sources) or 'none yet'}."
        )
    folder = gradebook.root / "source" / assignment
    return sorted(path.stem for path in folder.glob("*.ipynb"))


def _students(root: Path, assignment: str) -> list[str]:
    """Return the students who have a folder for the assignment."""
    submitted = root / "submitted"
    students = sorted(
        path.parent.name for path in submitted.glob(f"*/{assignment}") if path.is_dir()
    )
    if not students:
        raise AssignmentError(
            f"Nobody has submitted '{assignment}' yet: nbgrader expects the files in "
            f"{submitted}/<student>/{assignment}/."
        )
    return students
