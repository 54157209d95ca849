"""``autograder watch``: collects, grades what is new, hands feedback back, until it is stopped.

Nothing is remembered but what is on disk: a watch that was killed, wherever it was, goes on where
it was when it is started again. A look that finds nothing new holds nothing, so that a run by hand
beside it is not kept waiting.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import NoReturn

from filelock import FileLock, Timeout

from autograder.class_report.platforms import grades_csv
from autograder.gradebook.collecting import exchange
from autograder.gradebook.collecting.exchange_rights import require_exchange
from autograder.gradebook.course_gradebook import CourseGradebook
from autograder.gradebook.nbgrader_plugins.autograde_steps import WORK_FOLDER
from autograder.grading import engine
from autograder.grading.engine import BusyError, Graded, NobodySubmittedError
from autograder.grading.run_progress import RunProgress
from autograder.running.interruption import Interruption
from autograder.util.work_files import walk_files
from course.errors import CourseError
from course.messages.yaml_text import format_count

EVERY_S = 60.0
MOST_REMARKS = 5
"""New sentences that one look says; a stranger may put any number of folders into the exchange."""

MOST_NAMED = 5
"""Students whom a line names."""


@dataclass(frozen=True)
class GradingOptions:
    """What `engine.grade` is called with."""

    jobs: int
    trust: bool = False
    scheduler: str = ""


class _Noted(RunProgress):
    """Keeps what a run has graded, and says nothing."""

    def __init__(self) -> None:
        self.graded: list[Graded] = []
        self.remarks: list[str] = []

    def submission_done(self, graded: Graded) -> None:
        """Note a submission; one that is not graded at all has no outcomes."""
        if graded.outcomes and graded.entered:
            self.graded.append(graded)
        elif graded.problem:
            self.remarks.append(f"{graded.student} is not graded: {graded.problem}")


def watch_assignment(
    root: Path,
    assignment: str,
    options: GradingOptions,
    *,
    every_s: float = EVERY_S,
    say: Callable[[str], None],
) -> NoReturn:
    """Look after an assignment until a signal comes.

    Args:
        root: the nbgrader course root.
        assignment: its name.
        options: how it is graded.
        every_s: seconds between two looks.
        say: is told one line when something has happened, and each trouble once.

    Raises:
        Stopped: by a signal; whatever was done is whole.
        AssignmentError: it has not been released.
        BusyError: somebody else watches this assignment.
        CourseError: the first look failed; what fails later is said, and tried again.
    """
    engine.released_notebooks(CourseGradebook(root), assignment)  # a name that is one, and no path
    woken = threading.Event()
    with _only_watch(root, assignment), Interruption(woken.set) as interruption:
        watch = _Watch(root, assignment, options, interruption, say)
        say(f"Watching {assignment}: looking every {every_s:g} s. Ctrl-C ends it.")
        while True:
            watch.look()
            woken.wait(every_s)
            interruption.raise_if_stopped()


@contextmanager
def _only_watch(root: Path, assignment: str) -> Iterator[None]:
    lock = root / WORK_FOLDER / f"watch-{assignment}.lock"
    lock.parent.mkdir(parents=True, exist_ok=True)
    try:
        with FileLock(lock, timeout=0):
            yield
    except Timeout:
        raise BusyError(
            f"Another `autograder watch {assignment}` is at work in {root}: leave it at that, or "
            "end it first."
        ) from None


class _Watch:
    """One assignment that is watched."""

    def __init__(
        self,
        root: Path,
        assignment: str,
        options: GradingOptions,
        interruption: Interruption,
        say: Callable[[str], None],
    ) -> None:
        self._root, self._assignment = root, assignment
        self._options = options
        self._interruption = interruption
        self._say = say
        self._hold = partial(engine.lock_course, root)
        self._settled = ""
        """The course's files and gradebook when there was last nothing to grade."""
        self._not_graded: list[str] = []
        self._looked = False
        self._said: frozenset[str] = frozenset()

    def look(self) -> None:
        """Do what there is to do; say in one line what it was.

        Raises:
            Stopped: a signal came.
            CourseError, OSError: it is the first look, and it failed.
        """
        try:
            remarks = self._look()
        except BusyError:
            remarks = ["Somebody grades in this course: going on when that is done."]
        except (CourseError, OSError) as error:
            if not self._looked:
                raise
            remarks = [f"{error} It is tried again."]
        self._looked = True
        self._interruption.raise_if_stopped()
        self._tell_remarks(remarks)

    def _look(self) -> list[str]:
        gradebook, stopped = CourseGradebook(self._root), self._interruption.is_stopped
        rights = require_exchange(gradebook, self._assignment)
        collected = exchange.collect_submissions(gradebook, self._assignment, self._hold, stopped)
        self._interruption.raise_if_stopped()
        graded = self._grade()
        released = exchange.release_feedback(gradebook, self._assignment, self._hold)
        self._tell_work(collected.students, graded, released.students)
        return [*rights, *collected.remarks, *self._not_graded, *released.remarks]

    def _grade(self) -> list[Graded]:
        state = course_state(self._root, self._assignment)
        if state == self._settled:
            return []
        noted = _Noted()
        try:
            engine.grade(
                self._root, self._assignment, jobs=self._options.jobs, trust=self._options.trust,
                scheduler=self._options.scheduler, progress=noted,
            )  # fmt: skip
        except NobodySubmittedError:
            return []
        self._not_graded = noted.remarks
        if noted.graded:
            write_grades(self._root)
        # What came in during the run changes the state, too: then the next look grades once more.
        self._settled = state if course_state(self._root, self._assignment) == state else ""
        return noted.graded

    def _tell_work(
        self, collected: Collection[str], graded: Collection[Graded], released: Collection[str]
    ) -> None:
        if not (collected or graded or released):
            return
        said = []
        if collected:
            said.append(f"collected {_names(collected)}")
        if graded:
            asked = [one.student for one in graded if one.problem]
            more = f" (a person has to look at {_names(asked)})" if asked else ""
            said.append(f"graded {_names(one.student for one in graded)}{more}")
        if released:
            said.append(f"released feedback for {format_count(len(released), 'student')}")
        self._say(f"{datetime.now():%Y-%m-%d %H:%M:%S}  {'; '.join(said)}")

    def _tell_remarks(self, remarks: Iterable[str]) -> None:
        """Say what was not said the last time."""
        now = dict.fromkeys(remarks)
        new = [remark for remark in now if remark not in self._said]
        for remark in new[:MOST_REMARKS]:
            self._say(f"{datetime.now():%Y-%m-%d %H:%M:%S}  {remark}")
        if len(new) > MOST_REMARKS:
            self._say(f"... and {len(new) - MOST_REMARKS} more of this kind.")
        self._said = frozenset(now)


def write_grades(root: Path) -> None:
    """Write ``grades.csv``, with all grades of the course."""
    gradebook = CourseGradebook(root)
    every = {name: gradebook.read_grades(name) for name in gradebook.assignment_names()}
    grades_csv.write_grades(every, root / "grades.csv")


def course_state(root: Path, assignment: str) -> str:
    """Return what changes with whatever is a reason to grade: work, marks, claims, the exam."""
    places: list[Path] = [root / name for name in ("nbgrader_config.py", "claims.json")]
    places += [root / f"gradebook.db{ending}" for ending in ("", "-wal")]
    for folder in (root / "source" / assignment, root / "release" / assignment, root / "exercises"):
        places += walk_files(folder)
    submitted = root / "submitted"
    for student in sorted(submitted.iterdir()) if submitted.is_dir() else ():
        places += [student, *walk_files(student / assignment)]
    return "\n".join(_file_state(path) for path in places)


def _file_state(path: Path) -> str:
    try:
        status = path.lstat()
    except OSError:
        return f"{os.fsencode(path)!r} gone"
    return f"{os.fsencode(path)!r} {status.st_size} {status.st_mtime_ns}"


def _names(students: Iterable[str]) -> str:
    names = sorted(students)
    shown = ", ".join(names[:MOST_NAMED])
    return shown if len(names) <= MOST_NAMED else f"{shown} and {len(names) - MOST_NAMED} more"
