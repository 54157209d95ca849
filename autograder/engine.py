"""Grade a whole assignment: run submissions side by side, enter scores one by one.

Running is parallel, because a subject mostly waits; the gradebook has one writer, this process. It
may be killed at any moment: outcomes and grades are kept one by one, each as a whole or not at all,
and the next run takes up what is missing.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from filelock import FileLock, Timeout

from autograder import files, ledger, points, roster, sandbox
from autograder import nbgrader_bridge as bridge
from autograder.desk import Desk, Piece, Work
from autograder.gradebook import CourseGradebook, GradebookError
from autograder.interruption import Interruption
from autograder.jobs import Job, Result
from autograder.ledger import Entry, Ledger, Standing
from autograder.progress import Progress
from autograder.runner import Outcome
from autograder.store import OutcomeStore
from autograder.workers import Done, LocalWorkers, Workers
from course.errors import CourseError

STAGED = f"{bridge.WORK_FOLDER}/staged"
LOCK = f"{bridge.WORK_FOLDER}/engine.lock"


class AssignmentError(CourseError):
    """An assignment that does not exist or is not ready; the message names what there is."""


class BusyError(CourseError):
    """Another engine is grading in the same course."""


@dataclass(frozen=True)
class Graded:
    """One student's submission, and what a person should know about it.

    Attributes:
        student: whose it is.
        outcomes: by notebook; only what `Progress.done` is told has them, because a class's would
            fill the memory.
        points: automatic points, of ``max_points``.
        seconds: wall time that its notebooks ran.
        problem: what is wrong with it, in sentences.
        entered: False if the gradebook did not take the scores.
    """

    student: str
    outcomes: dict[str, Outcome]
    points: float = 0.0
    max_points: float = 0.0
    seconds: float = 0.0
    problem: str = ""
    entered: bool = True


QUIET = Progress()


def grade(
    root: Path,
    assignment: str,
    *,
    jobs: int = 2,
    fresh: bool = False,
    trust: bool = False,
    feedback: bool = True,
    scheduler: str = "",
    progress: Progress = QUIET,
) -> list[Graded]:
    """Grade every submission of an assignment into the gradebook of the course at ``root``.

    What has not changed since it was graded is left as it is.

    Args:
        root: the nbgrader course root.
        assignment: its name.
        jobs: how many notebooks are run at a time.
        fresh: run also what was run before and has not changed.
        trust: run submissions outside of a sandbox, with the rights of this process.
        feedback: write HTML feedback, too.
        scheduler: address of a Dask scheduler whose workers run the notebooks, in place of this
            machine.
        progress: is told how it goes.

    Raises:
        AssignmentError: no such assignment, not released, or nothing submitted.
        BusyError: another engine is at work in this course.
        ClusterError: the scheduler cannot be used.
        GradebookError: the gradebook itself cannot be used.
        GradebookUnusable: it cannot be used any more: a full disk, or a lock, say.
        SandboxError: they are not trusted, and there is no working sandbox here.
        StoreError: there is no room for what came out.
        Stopped: a signal ended the run; what was graded is kept.
    """
    if not trust and not scheduler:
        sandbox.require()
    gradebook = CourseGradebook(root, staged=STAGED)
    names = _notebooks(gradebook, assignment)
    students, wrong = _students(gradebook, assignment)
    refused = [Graded(s, {}, problem=problem, entered=False) for s, problem in wrong.items()]
    store = OutcomeStore(root / bridge.WORK_FOLDER / "outcomes", trust=trust, hidden=[root])
    with ExitStack() as stack:
        stack.enter_context(_alone(root))
        stack.callback(progress.end)
        files.sweep()
        files.remove_partial(root / bridge.WORK_FOLDER)
        workers = stack.enter_context(_workers(jobs, store, trust, scheduler, root, progress))
        interruption = stack.enter_context(Interruption(workers.wake))
        desk = Desk(gradebook, assignment, names, trust=trust)
        run = _Run(desk, store, workers, interruption, progress, feedback=feedback, fresh=fresh)
        graded = [*refused, *run.grade(students, refused)]
    return sorted(graded, key=lambda item: item.student)


class _Run:
    """One run of the engine over the submissions of one assignment."""

    def __init__(
        self,
        desk: Desk,
        store: OutcomeStore,
        workers: Workers,
        interruption: Interruption,
        progress: Progress,
        *,
        feedback: bool,
        fresh: bool,
    ) -> None:
        self._desk = desk
        self._store = store
        self._workers = workers
        self._interruption = interruption
        self._progress = progress
        self._feedback, self._fresh = feedback, fresh
        self._ledger = Ledger(desk.work_folder, desk.assignment)
        self._course = ledger.of_course(
            desk.root, desk.folders, workers.modes[0], _exams(desk.assignment)
        )
        self._running: dict[str, list[Piece]] = {}
        self._graded: list[Graded] = []

    def grade(self, students: list[str], refused: list[Graded]) -> list[Graded]:
        """Grade what needs it; return all that was looked at."""
        standings = self._desk.gradebook.standings(self._desk.assignment)
        changed: list[Work] = []
        for student in students:
            self._interruption.check()
            work = self._desk.work(student, self._course)
            if (left := self._unchanged(work, standings.get(student))) is not None:
                self._graded.append(left)
            else:
                changed.append(work)
        notebooks = len(changed) * len(self._desk.notebooks)
        self._progress.begin(len(changed) + len(refused), notebooks, len(self._graded))
        for graded in refused:
            self._progress.done(graded)
        self._run(self._pieces(changed))
        return self._graded

    def _unchanged(self, work: Work, standing: Standing | None) -> Graded | None:
        """Return what is known of a submission that needs nothing, bar new feedback, or None."""
        entry = None if self._fresh else self._ledger.get(work.student)
        if entry is None or standing is None or entry.made_of != work.made_of:
            return None
        if entry.standing.automatic != standing.automatic or not self._desk.is_graded(work.student):
            return None
        if self._feedback and not (
            entry.feedback and entry.standing == standing and self._desk.has_feedback(work.student)
        ):
            # A person has graded or commented since: that belongs into the feedback.
            try:
                self._desk.gradebook.generate_feedback(self._desk.assignment, work.student)
            except GradebookError:
                return None
            self._ledger.put(work.student, replace(entry, standing=standing, feedback=True))
        return Graded(
            work.student, {}, entry.points, entry.max_points, entry.seconds, entry.problem
        )

    def _pieces(self, changed: list[Work]) -> Iterator[Piece]:
        for work in changed:
            yield from self._desk.pieces(work)

    def _run(self, pieces: Iterator[Piece]) -> None:
        more = True
        while more or self._running:
            while more and len(self._running) < self._workers.room():
                self._interruption.check()
                piece = next(pieces, None)
                if piece is None:
                    more = False
                else:
                    self._begin(piece)
            if self._running:
                self._interruption.check()
                for done in self._workers.wait():
                    self._finish(done)
                    self._interruption.check()

    def _begin(self, piece: Piece) -> None:
        """Have a notebook run, unless its outcome is known or on its way."""
        if piece.job is None:
            assert piece.outcome is not None
            self._take(piece, piece.outcome, waited=False)
            return
        keys = [piece.job.key(mode) for mode in self._workers.modes]
        if keys[0] in self._running:
            self._running[keys[0]].append(piece)
            return
        found = (None if self._fresh else self._store.named(key) for key in keys)
        kept = next((outcome for outcome in found if outcome is not None), None)
        if kept is not None:
            self._take(piece, kept, waited=False)
        else:
            self._running[keys[0]] = [piece]
            self._workers.submit(keys[0], piece.job)

    def _finish(self, done: Done) -> None:
        pieces = self._running.pop(done.key)
        if isinstance(done.error, CourseError):
            raise done.error  # no room, no sandbox: the next one would fare no better
        for piece in pieces:
            if done.result is not None:
                outcome = done.result.outcome
            else:
                reason = f"{type(done.error).__name__}: {done.error}"
                outcome = self._desk.refused(piece, reason[:500], "grader_error")
            self._take(piece, outcome, waited=True)

    def _take(self, piece: Piece, outcome: Outcome, *, waited: bool) -> None:
        """Note a notebook's outcome; enter the student with the last of them."""
        self._progress.ran(waited)
        work = piece.work
        work.outcomes[piece.notebook] = replace(
            outcome, verdicts={**outcome.verdicts, **piece.marks}
        )
        if len(work.outcomes) == len(self._desk.notebooks):
            graded = self._enter(work)
            work.outcomes.clear()
            self._progress.done(graded)
            self._graded.append(replace(graded, outcomes={}))

    def _enter(self, work: Work) -> Graded:
        graded = _summary(work, self._desk.notebooks)
        self._ledger.remove(work.student)
        try:
            self._desk.enter(work, feedback=self._feedback)
        except GradebookError as error:
            return replace(graded, problem=f"{graded.problem} {error}".strip(), entered=False)
        if not any(outcome.spoilt for outcome in work.outcomes.values()):
            standing = self._desk.gradebook.standings(self._desk.assignment, work.student)
            self._ledger.put(
                work.student,
                Entry(
                    work.made_of, standing[work.student], graded.points, graded.max_points,
                    graded.seconds, graded.problem, self._feedback,
                ),
            )  # fmt: skip
        return graded


def _summary(work: Work, notebooks: list[str]) -> Graded:
    outcomes = {name: work.outcomes[name] for name in notebooks}
    verdicts = [v for outcome in outcomes.values() for v in outcome.verdicts.values()]
    problems = list(work.problems)
    for outcome in outcomes.values():
        problems += outcome.notes if outcome.unreadable else []
    return Graded(
        work.student, outcomes, sum(v.score for v in verdicts), sum(v.max_score for v in verdicts),
        sum(outcome.seconds for outcome in outcomes.values()), " ".join(problems),
    )  # fmt: skip


def _workers(
    count: int, store: OutcomeStore, trust: bool, scheduler: str, root: Path, progress: Progress
) -> Workers:
    def keep(job: Job, result: Result) -> None:
        store.put(job.program, job.files, result.outcome, result.mode)

    if not scheduler:
        return LocalWorkers(count, keep, trust=trust, hidden=[root])
    from autograder.cluster import Cluster

    return Cluster(scheduler, keep, trust=trust, hidden=[root], say=progress.say)


@contextmanager
def _alone(root: Path) -> Iterator[None]:
    """Hold the course for this engine; the kernel lets it go when the process ends, however."""
    path = root / LOCK
    path.parent.mkdir(parents=True, exist_ok=True)
    try:
        with FileLock(path, timeout=0):
            yield
    except Timeout:
        raise BusyError(
            f"Another `autograder grade` is at work in {root}: wait until it is done, or end it, "
            "and run the same command again."
        ) from None


def _exams(assignment: str) -> tuple[str, ...]:
    table = points.table()
    return tuple(sorted(exam for exam, entry in table.items() if entry.assignment == assignment))


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


def _students(gradebook: CourseGradebook, assignment: str) -> tuple[list[str], dict[str, str]]:
    """Return who has submitted, and what is wrong with the folders that cannot be graded."""
    students, wrong = roster.submissions(gradebook.root, assignment, gradebook.roster())
    if not students and not wrong:
        raise AssignmentError(
            f"Nobody has submitted '{assignment}' yet: nbgrader expects the files in "
            f"{gradebook.root / 'submitted'}/<student>/{assignment}/."
        )
    return students, wrong
