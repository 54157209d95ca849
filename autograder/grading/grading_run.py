"""One run over the submissions of one assignment: what is run, what is entered, what is left.

The work of the engine itself, in one thread: it hands notebooks to workers, and enters a student
once the last of their outcomes is there.
"""

from __future__ import annotations

import os
import tempfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace

from autograder.assignments.submission import SubmissionError
from autograder.gradebook.course_gradebook import GradebookError
from autograder.grading.graded import Graded
from autograder.grading.run_progress import RunProgress
from autograder.grading.submission_intake import NotebookRun, SubmissionIntake, Work
from autograder.running.interruption import Interruption
from autograder.running.outcomes import ledger
from autograder.running.outcomes.ledger import Ledger, LedgerEntry, Standing
from autograder.running.outcomes.outcome_store import OutcomeStore, StoreError
from autograder.running.resource_errors import is_full, is_temporary
from autograder.running.runner import Outcome
from autograder.running.workers.local_workers import Done, Workers
from autograder.sandbox import SandboxError
from course.errors import CourseError

MOST_STARTS = 3
"""Times that a notebook is started in vain before the run ends with the reason."""

MOST_TRIES = 2
"""Times that a notebook is run if the grader fails before it has begun; then a person is told."""


class GradingRun:
    """One run of the engine over the submissions of one assignment."""

    def __init__(
        self,
        intake: SubmissionIntake,
        store: OutcomeStore,
        workers: Workers,
        interruption: Interruption,
        progress: RunProgress,
        *,
        feedback: bool,
        since: int,
    ) -> None:
        """Prepare a run.

        Args:
            intake: reads and enters the submissions.
            store: has the outcomes of earlier runs.
            workers: run what has none.
            interruption: says when to stop.
            progress: is told how it goes.
            feedback: write HTML feedback, too.
            since: take nothing from earlier runs that is older (see `FreshRun.start_revision`).
        """
        self._intake = intake
        self._store = store
        self._workers = workers
        self._interruption = interruption
        self._progress = progress
        self._feedback, self._since = feedback, since
        self._ledger = Ledger(intake.work_folder, intake.assignment)
        self._course = ledger.of_course(
            intake.root, intake.assignment_folders, workers.modes[0], intake.exam_names,
            intake.gradebook.late_rule,
        )  # fmt: skip
        self._running: dict[str, list[NotebookRun]] = {}
        self._refusals: Counter[str] = Counter()
        self._failures: Counter[str] = Counter()
        self._graded: list[Graded] = []

    def grade(self, students: list[str], refused: list[Graded]) -> list[Graded]:
        """Grade what needs it; return all that was looked at.

        ``refused`` are submissions that cannot be graded: progress is told about them, too.
        """
        standings = self._intake.gradebook.read_standings(self._intake.assignment)
        changed: list[Work] = []
        for student in students:
            self._interruption.raise_if_stopped()
            work = self._read_work(student)
            if (left := self._unchanged_result(work, standings.get(student))) is not None:
                self._graded.append(left)
            else:
                changed.append(work)
        notebooks = len(changed) * len(self._intake.notebooks)
        self._progress.begin(len(changed) + len(refused), notebooks, len(self._graded))
        for graded in refused:
            self._progress.submission_done(graded)
        self._run_notebooks(self._notebook_runs(changed))
        return self._graded

    def _read_work(self, student: str) -> Work:
        try:
            return self._intake.read_work(student, self._course)
        except Exception as error:  # noqa: BLE001 - one student's data must not end the class
            return Work(student, "", failure=_failure_reason(error))

    def _unchanged_result(self, work: Work, standing: Standing | None) -> Graded | None:
        """Return what is known of a submission that needs nothing, bar new feedback, or None."""
        entry = self._ledger.get(work.student, self._since)
        if entry is None or standing is None or entry.made_of != work.made_of:
            return None
        if entry.standing.automatic != standing.automatic or not self._intake.is_graded(
            work.student
        ):
            return None
        if self._feedback and not (
            entry.feedback
            and entry.standing == standing
            and self._intake.has_feedback(work.student)
        ):
            # A person has graded or commented since: that belongs into the feedback.
            try:
                self._intake.gradebook.generate_feedback(self._intake.assignment, work.student)
            except GradebookError:
                return None
            self._ledger.put(work.student, replace(entry, standing=standing, feedback=True))
        return Graded(
            work.student, {}, entry.points, entry.max_points, entry.seconds, entry.problem
        )

    def _notebook_runs(self, changed: list[Work]) -> Iterator[NotebookRun]:
        for work in changed:
            # All of them before the first is run: then nothing of it is on its way if one fails.
            pieces: list[NotebookRun] = []
            try:
                pieces = [] if work.failure else list(self._intake.stage_notebooks(work))
            except Exception as error:  # noqa: BLE001 - one student's data must not end the class
                work.failure = _failure_reason(error)
            if work.failure:
                for _ in self._intake.notebooks:
                    self._progress.notebook_ran(waited=False)
                self._report_graded(work, self._set_aside(work))
            yield from pieces

    def _run_notebooks(self, pieces: Iterator[NotebookRun]) -> None:
        more = True
        while more or self._running:
            while more and len(self._running) < self._workers.job_capacity():
                self._interruption.raise_if_stopped()
                piece = next(pieces, None)
                if piece is None:
                    more = False
                else:
                    self._begin_notebook(piece)
            if self._running:
                if self._feedback and not more and len(self._running) <= (os.cpu_count() or 1):
                    self._intake.warm_up()  # a processor has little to do from here on
                self._interruption.raise_if_stopped()
                for done in self._workers.wait():
                    self._finish_job(done)
                    self._interruption.raise_if_stopped()

    def _begin_notebook(self, piece: NotebookRun) -> None:
        """Have a notebook run, unless its outcome is known or on its way."""
        if piece.job is None:
            assert piece.outcome is not None
            self._take_outcome(piece, piece.outcome, waited=False)
            return
        keys = [piece.job.outcome_key(mode) for mode in self._workers.modes]
        if keys[0] in self._running:
            self._running[keys[0]].append(piece)
            return
        found = (self._store.get_by_key(key, self._since) for key in keys)
        kept = next((outcome for outcome in found if outcome is not None), None)
        if kept is not None:
            self._take_outcome(piece, kept, waited=False)
        else:
            self._running[keys[0]] = [piece]
            self._submit_job(keys[0], piece)

    def _submit_job(self, key: str, piece: NotebookRun) -> None:
        assert piece.job is not None
        self._workers.submit(key, piece.job)

    def _finish_job(self, done: Done) -> None:
        again = False
        if is_temporary(done.error):
            self._refusals[done.key] += 1
            again = self._refusals[done.key] < MOST_STARTS
        elif done.result is not None and done.result.outcome.may_be_tried_again:
            self._failures[done.key] += 1
            again = self._failures[done.key] < MOST_TRIES
        if again:
            self._submit_job(done.key, self._running[done.key][0])
            return
        pieces = self._running.pop(done.key)
        if is_temporary(done.error):
            raise SandboxError(
                f"{pieces[0].work.student}'s submission could not be started in {MOST_STARTS} "
                f"tries ({done.error}): see what is wrong with `course doctor`, or run fewer at a "
                "time with --jobs; the same command then goes on where this one ended."
            ) from done.error
        if is_full(done.error):
            raise StoreError(
                f"There is no room for the files of a running submission ({done.error}): make room "
                f"in {tempfile.gettempdir()} and run the same command again; what was graded so "
                "far is kept."
            ) from done.error
        if isinstance(done.error, CourseError):
            raise done.error  # no room, no sandbox: the next one would fare no better
        for piece in pieces:
            if done.result is not None:
                outcome = done.result.outcome
            else:
                reason = f"{type(done.error).__name__}: {done.error}"
                outcome = self._intake.refused_outcome(piece, reason[:500], "grader_error")
            self._take_outcome(piece, outcome, waited=True)

    def _take_outcome(self, piece: NotebookRun, outcome: Outcome, *, waited: bool) -> None:
        """Note a notebook's outcome; enter the student with the last of them."""
        self._progress.notebook_ran(waited)
        work = piece.work
        work.outcomes[piece.notebook] = replace(
            outcome, verdicts={**outcome.verdicts, **piece.marks}
        )
        if len(work.outcomes) == len(self._intake.notebooks):
            self._report_graded(work, self._enter_work(work))

    def _report_graded(self, work: Work, graded: Graded) -> None:
        work.outcomes.clear()
        self._progress.submission_done(graded)
        self._graded.append(replace(graded, outcomes={}))

    def _enter_work(self, work: Work) -> Graded:
        before = self._ledger.get(work.student)
        same = before is not None and before.is_of(work.made_of)
        self._ledger.remove(work.student)
        try:
            graded = _summarise_work(work, self._intake.notebooks)
            entered = self._intake.enter_outcomes(work, same=same)
            missing = self._missing_feedback(work)
        except Exception as error:  # noqa: BLE001 - one student's data must not end the class
            work.failure = _failure_reason(error)
            return self._set_aside(work)
        if not any(outcome.has_grader_error for outcome in work.outcomes.values()):
            self._ledger.put(
                work.student,
                LedgerEntry(
                    work.made_of, entered.standing, graded.points, graded.max_points,
                    graded.seconds, graded.problem, self._feedback and not missing,
                ),
            )  # fmt: skip
        # Not in the record: it is said once, and then the gradebook shows what waits.
        return _with_remarks(graded, entered.asked, missing)

    def _missing_feedback(self, work: Work) -> str:
        """Write feedback on grades that are entered, or say why there is none: they stand."""
        if self._feedback:
            try:
                self._intake.gradebook.generate_feedback(self._intake.assignment, work.student)
            except GradebookError as error:
                return f"It is graded, but there is no feedback: {error}"
        return ""

    def _set_aside(self, work: Work) -> Graded:
        """Enter nothing but why a submission could not be graded, for a person to look at."""
        self._ledger.remove(work.student)
        try:
            self._intake.set_aside(work, work.failure)
            graded = _summarise_work(work, self._intake.notebooks)
            entered = self._intake.enter_outcomes(work)
            missing = self._missing_feedback(work)
        except Exception as error:  # noqa: BLE001 - one student's data must not end the class
            problem = " ".join(
                dict.fromkeys([*work.problems, work.failure, _failure_reason(error)])
            )
            return Graded(work.student, {}, problem=problem, entered=False)
        return _with_remarks(graded, entered.asked, missing)


def _with_remarks(graded: Graded, *remarks: str) -> Graded:
    return replace(graded, problem=" ".join(filter(None, (graded.problem, *remarks))))


def _summarise_work(work: Work, notebooks: list[str]) -> Graded:
    outcomes = {name: work.outcomes[name] for name in notebooks}
    verdicts = [v for outcome in outcomes.values() for v in outcome.verdicts.values()]
    problems = list(work.problems)
    for outcome in outcomes.values():
        notes = outcome.notes if outcome.unreadable else []
        # A problem may begin with what the student is told, and go on with what to do.
        problems += [n for n in notes if not any(p.startswith(n) for p in problems)]
    problems = list(dict.fromkeys(problems))  # a reason may be that of every notebook
    return Graded(
        work.student, outcomes, sum(v.score for v in verdicts), sum(v.max_score for v in verdicts),
        sum(outcome.seconds for outcome in outcomes.values()), " ".join(problems),
    )  # fmt: skip


def _failure_reason(error: Exception) -> str:
    """Return why one student's submission could not be graded.

    What concerns everybody is raised again: a full disk, say.
    """
    if isinstance(error, (GradebookError, SubmissionError)):
        return str(error)
    if isinstance(error, CourseError) or is_full(error):
        raise error
    what = f"{type(error).__name__}: {error}".splitlines()[0][:300]
    return f"This submission could not be graded ({what}): a person has to look at it."
