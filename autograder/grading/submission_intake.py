"""Between a submission and nbgrader: what of it is run, and entering what came of it."""

from __future__ import annotations

import copy
import hashlib
import shutil
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import nbformat
from nbformat import NotebookNode

from autograder.assignments import questions, submission
from autograder.assignments.intake import claim_records, roster
from autograder.assignments.intake.handed_files import folder_digest
from autograder.assignments.intake.handed_files.file_names import quote_name
from autograder.assignments.intake.notebook_search import (
    Found,
    Intake,
    NotHandedInError,
    UnclearError,
)
from autograder.assignments.intake.notebook_search import of_student as intake_of
from autograder.assignments.intake.recognition import cell_matching
from autograder.assignments.submission import SubmissionError
from autograder.examination.verdict import Status, Verdict
from autograder.gradebook import staging
from autograder.gradebook.course_gradebook import CourseGradebook, GradebookError
from autograder.gradebook.feedback.feedback_page import INDEX
from autograder.gradebook.nbgrader_plugins import autograde_steps
from autograder.gradebook.nbgrader_plugins.nbgrader_speedups import FeedbackExporter
from autograder.gradebook.quizzes import quiz_marks
from autograder.gradebook.safe_html import allowed_html
from autograder.gradebook.safe_html.page_texts import Page
from autograder.gradebook.written_answers.settled_marks import Marks
from autograder.running import runner
from autograder.running.grading_jobs import GradingJob
from autograder.running.outcomes.ledger import Standing
from autograder.running.runner import Outcome
from course.errors import CourseError


@dataclass
class Work:
    """A submission on its way into the gradebook.

    Attributes:
        student: whose it is.
        made_of: digest of it and of all that its grades depend on.
        problems: what a person should know about it.
        failure: why it cannot be graded at all, once that is known.
        outcomes: {notebook: outcome}, as far as they are there.
    """

    student: str
    made_of: str
    problems: list[str] = field(default_factory=list)
    failure: str = ""
    outcomes: dict[str, Outcome] = field(default_factory=dict)


@dataclass(frozen=True)
class NotebookRun:
    """One notebook of a submission: a ``job`` to run, or an ``outcome`` if it cannot be run.

    ``marks`` are the verdicts on its quizzes, by grade id.
    """

    work: Work
    notebook: str
    job: GradingJob | None = None
    outcome: Outcome | None = None
    marks: Mapping[str, Verdict] = field(default_factory=dict)


@dataclass(frozen=True)
class Entered:
    """What became of a submission that was entered.

    Attributes:
        standing: how its student now stands in the gradebook.
        asked: what a person has to mark again, and why, as a sentence; empty if nothing.
    """

    standing: Standing
    asked: str


class SubmissionIntake:
    """Reads the submissions of one assignment, and enters their outcomes."""

    def __init__(
        self, gradebook: CourseGradebook, assignment: str, notebooks: list[str], *, trust: bool
    ) -> None:
        """Work for an ``assignment`` that has these ``notebooks``; ``trust`` is for its jobs."""
        self.gradebook = gradebook
        self.assignment = assignment
        self.notebooks = notebooks
        self.root = gradebook.root
        self.work_folder = self.root / autograde_steps.WORK_FOLDER
        self._trust = trust
        self._class = gradebook.read_roster().known
        asked = questions.known_questions(gradebook.coursedir, assignment)
        self._marks = Marks(self.work_folder, assignment, asked)
        self._originals = {
            name: autograde_steps.read_originals(gradebook.coursedir, assignment, name)
            for name in notebooks
        }

    def warm_up(self) -> None:
        """Prepare for writing feedback, while there is nothing else to do, unless some was."""
        if not FeedbackExporter.is_warm():
            _, released = self._originals[self.notebooks[0]]
            FeedbackExporter.warm_up(released)

    @property
    def exam_names(self) -> tuple[str, ...]:
        """The exams of the assignment's notebooks, sorted."""
        programs = [submission.extract_program(source) for source, _ in self._originals.values()]
        return tuple(sorted({cell.exam for cells in programs for cell in cells if cell.exam}))

    @property
    def assignment_folders(self) -> tuple[Path, Path]:
        """The assignment's source and release."""
        return self.root / "source" / self.assignment, self.root / "release" / self.assignment

    def read_work(self, student: str, course: str) -> Work:
        """Return a student's submission; ``course`` is a digest of what all depend on."""
        made_of = folder_digest.of_folder(self._submitted_folder(student))
        if claims := claim_records.of_student(self.root, self.assignment, student):
            made_of = hashlib.sha256(f"{made_of} {sorted(claims.items())}".encode()).hexdigest()
        return Work(student, f"{course} {made_of}")

    def is_graded(self, student: str) -> bool:
        """Whether nbgrader has a graded copy of every notebook."""
        return self._has_all("autograded", student, ".ipynb")

    def has_feedback(self, student: str) -> bool:
        """Whether there is feedback on every notebook, and the page about all."""
        index = self.root / "feedback" / student / self.assignment / INDEX
        return index.is_file() and self._has_all("feedback", student, ".html")

    def stage_notebooks(self, work: Work) -> Iterator[NotebookRun]:
        """Stage a submission's notebooks one by one."""
        submitted, staged = self._submitted_folder(work.student), self._empty_stage(work.student)
        work.problems += roster.remarks(submitted, self.gradebook.time_zone)
        limits = self.gradebook.file_limits
        work.problems += staging.copy_files(submitted, staged, limits, self.notebooks)
        released = {name: released for name, (_, released) in self._originals.items()}
        intake = intake_of(self.root, self.assignment, work.student, released)
        for name in self.notebooks:
            notebook, piece = self._stage_notebook(work, name, intake)
            whose = notebook, submitted, work.student, self.root, self._class
            quizzes = quiz_marks.with_quizzes(Outcome(), *whose)
            asked = quiz_marks.quiz_questions(*whose)
            for cell, (why, command) in asked.items():
                said = f"{why} Say it with `{command}`, or with --nothing in place of the file."
                work.problems.append(said)
                autograde_steps.ask_about_cells(notebook, said, [cell])
            allowed_html.screen_texts(notebook, self._originals[name][1], Page())
            nbformat.write(notebook, staged / f"{name}.ipynb")  # type: ignore[no-untyped-call]
            yield replace(piece, marks=quizzes.verdicts)

    def set_aside(self, work: Work, reason: str) -> None:
        """Stage the released notebooks in place of a submission's, with ``reason`` as outcomes."""
        staged = self._empty_stage(work.student)
        for name in self.notebooks:
            notebook, outcome = self._blank_notebook(name, reason, "grader_error")
            nbformat.write(notebook, staged / f"{name}.ipynb")  # type: ignore[no-untyped-call]
            work.outcomes[name] = quiz_marks.with_unmarked_quizzes(
                outcome, notebook, self.root, reason
            )

    def refused_outcome(self, piece: NotebookRun, reason: str, status: Status) -> Outcome:
        """Return the outcome of a notebook that could not be run after all, for ``reason``."""
        assert piece.job is not None
        return runner.refused_outcome(piece.job.program, reason, status)

    def enter_outcomes(self, work: Work, *, same: bool = False) -> Entered:
        """Enter one student's outcomes into the gradebook; return how the student then stands.

        Only ever in the one writer. ``same`` says that it is the submission that was entered the
        last time.

        Raises:
            GradebookError: nbgrader cannot enter this student.
            GradebookUnusable: it could not enter anybody.
        """
        copy = self._autograded_folder(work.student)
        with self.gradebook.open_gradebook() as book:
            self._marks.remember(book, work.student, copy)
        for name, outcome in work.outcomes.items():
            autograde_steps.prepared[self.assignment, work.student, name] = outcome
        try:
            self.gradebook.autograde(self.assignment, work.student)
        finally:
            for name in work.outcomes:
                autograde_steps.prepared.pop((self.assignment, work.student, name), None)
        shutil.rmtree(self._staged_folder(work.student).parent, ignore_errors=True)
        staging.let_feedback_replace(copy, self.notebooks)
        with self.gradebook.open_gradebook() as book:
            asked = self._marks.settle(book, work.student, copy, same=same)
        standings = self.gradebook.read_standings(self.assignment, work.student)
        if work.student not in standings:
            raise GradebookError(
                f"nbgrader entered nothing for {work.student}, and did not say why: look whether "
                "nbgrader_config.py leaves this student out."
            )
        return Entered(standings[work.student], asked)

    def _empty_stage(self, student: str) -> Path:
        """Return a folder for a submission's notebooks, empty but for the exchange's marks."""
        staged = self._staged_folder(student)
        shutil.rmtree(staged, ignore_errors=True)
        staged.mkdir(parents=True)
        staging.copy_marks(self._submitted_folder(student), staged, self.gradebook.time_zone)
        return staged

    def _stage_notebook(
        self, work: Work, name: str, intake: Intake
    ) -> tuple[NotebookNode, NotebookRun]:
        try:
            found = intake.find_notebook(name)
            work.problems += found.remarks
            notebook, notes = self._restore_notebook(work, name, found)
            program = submission.extract_program(notebook)
            beside = intake.find_attachments(found)
            if found.item is not None:
                staging.copy_around(
                    beside.files, self._staged_folder(work.student), self.gradebook.file_limits,
                    self.notebooks,
                )  # fmt: skip
        except UnclearError as error:
            work.problems.append(f"{error} {error.suggestion}")
            notebook, outcome = self._blank_notebook(name, str(error), "not_checked")
            autograde_steps.ask_about_cells(
                notebook, f"{error} {error.suggestion}", autograde_steps.graded_cells(notebook)
            )
        except SubmissionError as error:
            notebook, outcome = self._blank_notebook(name, str(error), "not_checked")
            # A student who hands in some of the notebooks has left the others out: no question.
            left_out = not intake.proper_path(name).exists() and intake.has_others
            settled = isinstance(error, NotHandedInError)
            outcome = replace(outcome, unreadable=not (left_out or settled))
        except CourseError:
            raise
        except Exception as error:  # noqa: BLE001 - one student's data must not end the class
            reason = f"{type(error).__name__}: {error}"
            notebook, outcome = self._blank_notebook(name, reason, "grader_error")
        else:
            notebook.metadata[autograde_steps.NOTES_KEY] = [*notes, *beside.notes]
            return notebook, NotebookRun(work, name, GradingJob(program, beside.files, self._trust))
        return notebook, NotebookRun(work, name, outcome=outcome)

    def _restore_notebook(
        self, work: Work, name: str, found: Found
    ) -> tuple[NotebookNode, list[str]]:
        """Return a notebook whose cells are what they should be, and notes for the student."""
        source, released = self._originals[name]
        known = cell_matching.recognise_cells(found.notebook, released)
        notebook, notes = submission.restore_cells(found.notebook, source, released)
        doubts = {} if found.claimed else known.doubts
        for why in dict.fromkeys(doubts.values()):
            cells = [cell for cell, reason in doubts.items() if reason == why]
            suggestion = (
                f"Give them their points in the formgrader; or put a notebook in order and claim "
                "it, or this one as it stands, with `autograder claim "
                f"{quote_name(self.assignment)} "
                f"{quote_name(work.student)} {quote_name(name)} FILE`."
            )
            said = f"{name}, {', '.join(cells)}: {why} {suggestion}"
            work.problems.append(said)
            autograde_steps.ask_about_cells(notebook, said, cells)
        return notebook, [*found.notes, *known.notes, *dict.fromkeys(doubts.values()), *notes]

    def _blank_notebook(
        self, name: str, reason: str, status: Status
    ) -> tuple[NotebookNode, Outcome]:
        """Return the released notebook in place of one that cannot be read, and why."""
        source, released = self._originals[name]
        blank: NotebookNode = copy.deepcopy(released)
        notebook, _ = submission.restore_cells(blank, source, released)
        return notebook, runner.refused_outcome(
            submission.extract_program(notebook), reason, status
        )

    def _submitted_folder(self, student: str) -> Path:
        return roster.student_folder(self.root, student) / self.assignment

    def _staged_folder(self, student: str) -> Path:
        return self.root / autograde_steps.WORK_FOLDER / "staged" / student / self.assignment

    def _autograded_folder(self, student: str) -> Path:
        return self.root / "autograded" / student / self.assignment

    def _has_all(self, step: str, student: str, suffix: str) -> bool:
        folder = self.root / step / student / self.assignment
        return all((folder / f"{name}{suffix}").is_file() for name in self.notebooks)
