"""The course's own nbgrader: its configuration, its gradebook, and the calls that we make."""

from __future__ import annotations

import hashlib
import json
import logging
import re
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from nbgrader.api import Gradebook, MissingEntry
from nbgrader.apps import NbGraderAPI
from nbgrader.coursedir import CourseDirectory
from nbgrader.exchange.default import ExchangeCollect
from sqlalchemy.exc import SQLAlchemyError
from traitlets.config import Config
from traitlets.config.loader import PyFileConfigLoader

from autograder.assignments.intake import open_questions, roster
from autograder.assignments.intake.open_questions import OpenQuestion
from autograder.assignments.intake.roster import Roster
from autograder.gradebook import database, penalties
from autograder.gradebook.database import GradebookUnusable
from autograder.gradebook.feedback import index_page
from autograder.gradebook.nbgrader_plugins.autograde_steps import (
    WORK_FOLDER,
    RestoreCells,
    SubmissionExporter,
)
from autograder.gradebook.nbgrader_plugins.nbgrader_speedups import Engines, FeedbackExporter
from autograder.gradebook.staging import StagingLimits
from autograder.running.outcomes.ledger import Standing
from course.errors import CourseError

CONFIG = "nbgrader_config.py"

LOCK_PATIENCE_S = 30.0
"""Seconds that another program may hold the gradebook: SQLite itself waits 5 s at a time."""


_OWN_ERROR = re.compile(r"^(?:[\w.]*NbGraderException|RuntimeError): ")
"""How a line begins in which nbgrader itself says what is wrong."""


class GradebookError(CourseError):
    """nbgrader could not do what was asked; the message carries its own last words.

    ``reason`` is those words alone, if it said any.
    """

    def __init__(self, message: str, reason: str = "") -> None:
        """Say ``message``."""
        super().__init__(message)
        self.reason = reason


@dataclass(frozen=True)
class Grade:
    """One student's result: points earned and possible, and whether a person must still look.

    ``score`` is less what the course's rules take off for lateness, as in nbgrader's own export:
    ``penalty`` points, for ``seconds_late``.
    ``cells`` is {notebook: {grade id: points, or None while a manual grade is missing}}, and
    ``asked`` {notebook: why} of what may have been handed in after all: as long as a person has
    not settled that, ``score`` is no number to pass on.
    """

    student: str
    score: float
    max_score: float
    needs_manual_grade: bool
    cells: dict[str, dict[str, float | None]]
    asked: dict[str, str] = field(default_factory=dict)
    seconds_late: float = 0.0
    penalty: float = 0.0


class CourseGradebook:
    """nbgrader on one course root (the folder with ``nbgrader_config.py``)."""

    def __init__(
        self,
        root: Path,
        *,
        staged: str = "",
        released: Path | None = None,
        trial: Path | None = None,
    ) -> None:
        """Use the course at ``root``.

        Args:
            root: the folder with its ``nbgrader_config.py``.
            staged: a folder of submissions whose cells have been restored already; nbgrader then
                reads these in place of ``submitted``.
            released: where it puts releases, in place of ``release``.
            trial: the same, and it works on a copy of the gradebook that is made there.
        """
        self.root = root.resolve()
        config = _load_config(self.root)
        config.CourseDirectory.root = str(self.root)
        if place := trial or released:
            config.CourseDirectory.release_directory = str(place)
        if trial:
            url = CourseDirectory(config=config).db_url
            config.CourseDirectory.db_url = database.copy_database(
                url, self.root, trial / "gradebook.db"
            )
        if staged:
            config.CourseDirectory.submitted_directory = staged
            steps = config.Autograde.sanitize_preprocessors
            config.Autograde.sanitize_preprocessors = [s for s in steps if s is not RestoreCells]
            if config.Autograde.get("exporter_class") is SubmissionExporter:
                del config.Autograde.exporter_class  # what is staged can be read
        if "exporter_class" not in config.GenerateFeedback:
            config.GenerateFeedback.exporter_class = FeedbackExporter
        if "optimistic_validation" not in config.Exporter:
            # A notebook is compared with the format once all of a converter's steps are done.
            config.Exporter.optimistic_validation = True
        index_page.configure_feedback(config)
        self._engines = Engines()
        self.config: Config = config
        self.coursedir = CourseDirectory(config=config)
        self._api = NbGraderAPI(coursedir=self.coursedir, config=config)
        self._api.log_level = logging.ERROR

    def generate_assignment(self, assignment: str) -> None:
        """Make the student version of an assignment and enter it into the gradebook."""
        options = {"force": True, "create": True}
        self._call_nbgrader(self._api.generate_assignment, assignment, options=options)

    def autograde(self, assignment: str, student: str) -> None:
        """Enter one student's scores.

        Raises:
            GradebookError: nbgrader cannot enter this student.
            GradebookUnusable: it could not enter anybody: a full disk, or a lock, say.
        """
        options = {"force": True, "create": True}
        self._call_nbgrader(
            self._api.autograde, assignment, student, options=options, of_one_pass=True
        )

    def generate_feedback(self, assignment: str, student: str) -> None:
        """Write one student's feedback as HTML; raises as `autograde` does."""
        options = {"force": True}
        method = self._api.generate_feedback
        self._call_nbgrader(method, assignment, student, options=options, of_one_pass=True)

    def collect(
        self, assignment: str, folder: str, make_collector: Callable[[type], type[Any]]
    ) -> None:
        """Collect what is newer in the exchange, into ``folder`` in place of ``submitted``.

        ``make_collector`` gets nbgrader's own collector, and returns the one to use; a plugin that
        the course's configuration names is used as it is. Raises as `autograde` does.
        """
        exchange, before = self._api.exchange, self.coursedir.submitted_directory
        configured = exchange.collect
        if configured is ExchangeCollect:
            exchange.collect = make_collector(configured)
        self.coursedir.submitted_directory = folder
        try:
            self._call_nbgrader(self._api.collect, assignment, options={"update": True})
        finally:
            self.coursedir.submitted_directory = before
            exchange.collect = configured

    def release_feedback(self, assignment: str, student: str) -> None:
        """Put one student's feedback into the exchange; raises as `autograde` does."""
        self._call_nbgrader(self._api.release_feedback, assignment, student, options={})

    def assignment_names(self) -> list[str]:
        """Return the assignments that have been released into the gradebook."""
        with self.open_gradebook() as gradebook:
            return sorted(assignment.name for assignment in gradebook.assignments)

    def notebook_names(self, assignment: str) -> list[str]:
        """Return the notebooks of an assignment that have been released into the gradebook."""
        with self.open_gradebook() as gradebook:
            return sorted(book.name for book in gradebook.find_assignment(assignment).notebooks)

    def read_grades(self, assignment: str) -> list[Grade]:
        """Return the grades of an assignment, one a student, sorted by student."""
        asked = open_questions.of_assignment(self.root / WORK_FOLDER, assignment)
        with self.open_gradebook() as gradebook:
            submissions = gradebook.assignment_submissions(assignment)
            return sorted(
                (_make_grade(s, asked.get(s.student.id, {})) for s in submissions),
                key=lambda grade: grade.student,
            )

    def read_standings(self, assignment: str, student: str = "") -> dict[str, Standing]:
        """Return how the students (or one) stand in the gradebook, as digests to compare."""
        with self.open_gradebook() as gradebook:
            rows = database.standing_rows(gradebook.db, assignment, student)
        return {name: Standing(*map(_digest_rows, both)) for name, both in rows.items()}

    @property
    def time_zone(self) -> str:
        """The course's own time zone, as its configuration of the exchange has it; or empty."""
        zone = self.config.Exchange.get("timezone", "")
        return zone if isinstance(zone, str) else ""

    @property
    def excluded_students(self) -> frozenset[str]:
        """The students whom nbgrader passes over, as the course's configuration says."""
        return frozenset(self.coursedir.student_id_exclude.split(",")) - {""}

    @property
    def work_folder(self) -> Path:
        """Where the engine keeps what is no part of nbgrader's."""
        return self.root / WORK_FOLDER

    @property
    def late_rule(self) -> str:
        """A digest of how points are taken off for lateness.

        Raises:
            GradebookUnusable: the plugin for it cannot be loaded.
        """
        try:
            return penalties.rule_digest(self.config)
        except Exception as error:
            raise GradebookUnusable(
                f"The plugin for late penalties that {self.root / CONFIG} names cannot be loaded "
                f"({_first_line(error)}): mend it, then run the same command again."
            ) from error

    @property
    def file_limits(self) -> StagingLimits:
        """How much of what lies beside a notebook nbgrader takes, as its configuration says."""
        course = self.coursedir
        most = 1000 * course.max_dir_size
        return StagingLimits(tuple(course.ignore), 1000 * course.max_file_size or most, most)

    def read_roster(self) -> Roster:
        """Return which students the gradebook knows, and whether there may be others."""
        with self.open_gradebook() as gradebook:
            people = {
                s.id: bool(s.first_name or s.last_name or s.email) for s in gradebook.students
            }
        create = self.config.Autograde.get("create_student", True)
        return roster.of_people(people, create if isinstance(create, bool) else True)

    def _call_nbgrader(
        self, method: Any, *arguments: Any, options: dict[str, bool], of_one_pass: bool = False
    ) -> None:
        deadline = time.monotonic() + LOCK_PATIENCE_S
        while True:
            with _quiet_logs(), self._engines.use_engines(of_one_pass=of_one_pass):
                result = method(*arguments, **options)
            if result["success"]:
                return
            said = f"{result.get('log', '')}\n{result.get('error') or ''}"
            raised = self._engines.raised_errors
            # Each try waits for the lock by itself, so this loop does not spin.
            if not database.is_locked(raised) or time.monotonic() > deadline:
                break
        if unusable := (
            database.disk_full_error(said, self.root, self._written_folders())
            or database.unusable_error(raised, self.root)
        ):
            raise unusable
        why = _find_cause(said)
        raise GradebookError(
            f"nbgrader's {method.__name__} failed for {' and '.join(arguments)}: {why}", why
        )

    def _written_folders(self) -> list[Path]:
        """Return the folders that nbgrader writes to, as far as they are there."""
        names = (self.coursedir.autograded_directory, self.coursedir.feedback_directory)
        folders = [self.root, *(self.root / name for name in names)]
        return [folder for folder in folders if folder.is_dir()]

    @contextmanager
    def open_gradebook(self) -> Iterator[Gradebook]:
        """Give nbgrader's own gradebook for the block; raises as `autograde` does."""
        try:
            database.require_this_schema(self._engines.get_engine(self.coursedir.db_url), self.root)
            with (
                _quiet_logs(),
                self._engines.use_engines(),
                Gradebook(self.coursedir.db_url, self.coursedir.course_id) as gradebook,
            ):
                yield gradebook
        except MissingEntry as error:
            raise GradebookError(
                f"The gradebook in {self.root} has no such entry: {error}"
            ) from None
        except SQLAlchemyError as error:
            said = str(getattr(error, "orig", None) or error)
            raise database.unusable_error(said, self.root) or GradebookUnusable(
                f"The gradebook of {self.root} cannot be used ({said.splitlines()[0][:200]}): put "
                "a copy back that was sound; submissions and outcomes are not touched."
            ) from None


def _find_cause(said: str) -> str:
    """Return the line of nbgrader's log that names the cause: of a traceback, the last line."""
    lines = [line.strip() for line in said.splitlines() if line.strip()]
    causes = [line for line in lines if re.match(r"[\w.]+(Error|Exception|Entry)\b", line)]
    # What it raises in the end says no more than that there is a log.
    told = [line for line in causes if "Please see the" not in line]
    found = [line for line in told if "NbGraderException" not in line] or told or causes or lines
    return _OWN_ERROR.sub("", (found or ["no reason given"])[-1])[:300]


def _digest_rows(rows: list[list[Any]]) -> str:
    ordered = sorted(json.dumps(row, default=str) for row in rows)
    return hashlib.sha256("\n".join(ordered).encode()).hexdigest()


def _make_grade(submission: Any, asked: dict[str, OpenQuestion]) -> Grade:
    cells: dict[str, dict[str, float | None]] = {}
    for notebook in submission.notebooks:
        cells[notebook.name] = {
            grade.name: None
            if grade.needs_manual_grade and grade.manual_score is None
            else float(grade.score)
            for grade in notebook.grades
        }
    waiting = {name: [cell for cell, points in found.items() if points is None]
               for name, found in cells.items()}  # fmt: skip
    penalty = float(submission.late_submission_penalty)
    # nbgrader itself cannot tell how late something is if it was extended and is never due.
    due = submission.assignment.duedate
    return Grade(
        submission.student.id,
        max(0.0, float(submission.score) - penalty),
        float(submission.max_score),
        bool(submission.needs_manual_grade),
        cells,
        open_questions.open_ones(asked, waiting),
        float(submission.total_seconds_late) if due is not None else 0.0,
        penalty,
    )


def _load_config(root: Path) -> Config:
    if not (root / CONFIG).is_file():
        raise GradebookError(
            f"There is no {CONFIG} in {root}: name the course root with --root, or start "
            "in the folder that `autograder release` was run for."
        )
    if str(root) not in sys.path:
        sys.path.append(str(root))  # a plugin of the course's own may lie there, as for nbgrader
    try:
        return Config(PyFileConfigLoader(CONFIG, path=str(root)).load_config())
    except Exception as error:
        raise GradebookError(
            f"{root / CONFIG} cannot be used ({_first_line(error)}): mend it, then run the same "
            "command again."
        ) from error


def _first_line(error: Exception) -> str:
    return f"{type(error).__name__}: {error}".splitlines()[0][:300]


@contextmanager
def _quiet_logs() -> Iterator[None]:
    """Keep nbgrader's and SQLAlchemy's chatter off the screen.

    What nbgrader logs of the database, traceback and all, it raises, too.
    """
    log = logging.getLogger("tornado.application")  # which nbgrader uses
    was, log.disabled = log.disabled, True
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        log.disabled = was
