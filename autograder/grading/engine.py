"""Grade a whole assignment: run submissions side by side, enter scores one by one.

Running is parallel, because a subject mostly waits; the gradebook has one writer, this process. It
may be killed at any moment: outcomes and grades are kept one by one, each as a whole or not at all,
and the next run takes up what is missing.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from autograder import sandbox
from autograder.assignments.intake import roster
from autograder.assignments.intake.roster import Roster
from autograder.gradebook.course_gradebook import CourseGradebook
from autograder.gradebook.nbgrader_plugins import autograde_steps
from autograder.gradebook.safe_html import page_texts
from autograder.grading.graded import Graded
from autograder.grading.grading_run import GradingRun
from autograder.grading.run_progress import RunProgress
from autograder.grading.submission_intake import SubmissionIntake
from autograder.running.grading_jobs import GradingJob, JobResult
from autograder.running.interruption import Interruption
from autograder.running.outcomes.fresh_run import FreshRun
from autograder.running.outcomes.outcome_store import OutcomeStore
from autograder.running.workers.local_workers import LocalWorkers, Workers
from autograder.util import exercise_folders, work_files
from course.errors import CourseError
from course.util.close_matches import is_it

__all__ = [
    "AssignmentError", "BusyError", "Graded", "NobodySubmittedError", "grade", "lock_course",
]  # fmt: skip

STAGED = f"{autograde_steps.WORK_FOLDER}/staged"
LOCK = f"{autograde_steps.WORK_FOLDER}/engine.lock"


EXCLUDED = (
    "Left out, as nbgrader_config.py says (CourseDirectory.student_id_exclude): nothing was run."
)


class AssignmentError(CourseError):
    """An assignment that does not exist or is not ready; the message names what there is."""


class NobodySubmittedError(AssignmentError):
    """Nobody has submitted the assignment yet."""


class BusyError(CourseError):
    """Another engine is grading in the same course."""


QUIET = RunProgress()


def grade(
    root: Path,
    assignment: str,
    *,
    students: Collection[str] = (),
    jobs: int = 2,
    fresh: bool = False,
    trust: bool = False,
    feedback: bool = True,
    scheduler: str = "",
    progress: RunProgress = QUIET,
) -> list[Graded]:
    """Grade every submission of an assignment into the gradebook of the course at ``root``.

    What has not changed since it was graded is left as it is.

    Args:
        root: the nbgrader course root.
        assignment: its name.
        students: grade only these; all if there are none.
        jobs: how many notebooks are run at a time.
        fresh: run also what was run before and has not changed. Until such a run is through, the
            next run goes on with it.
        trust: run submissions outside of a sandbox, with the rights of this process.
        feedback: write HTML feedback, too.
        scheduler: address of a Dask scheduler whose workers run the notebooks, in place of this
            machine.
        progress: is told how it goes.

    Raises:
        AssignmentError: no such assignment, not released, or nothing submitted.
        NotReadyError: its source or its release is missing or damaged.
        BusyError: another engine is at work in this course.
        ClusterError: the scheduler cannot be used.
        ExerciseError: an exercise of the course is not sound.
        GradebookError: the gradebook itself cannot be used.
        GradebookUnusable: it cannot be used any more: a full disk, or a lock, say.
        SandboxError: they are not trusted, and there is no working sandbox here.
        StoreError: there is no room for what came out.
        Stopped: a signal ended the run; what was graded is kept.
    """
    exercise_folders.use_course(root)
    gradebook = CourseGradebook(root, staged=STAGED)
    names = released_notebooks(gradebook, assignment)
    known = gradebook.read_roster()
    students = sorted({known.student_id(name) for name in students})
    found, wrong = _submitted_students(gradebook, assignment, known, students)
    if not trust and not scheduler:
        sandbox.warm_up()
        sandbox.require_sandbox()
    page_texts.warm_up()
    refused = [Graded(s, {}, problem=problem, entered=False) for s, problem in wrong.items()]
    refused += [Graded(s, {}, problem=EXCLUDED) for s in found if s in gradebook.excluded_students]
    found = [s for s in found if s not in gradebook.excluded_students]
    store = OutcomeStore(root / autograde_steps.WORK_FOLDER, trust=trust, hidden=[root])
    with ExitStack() as stack:
        stack.enter_context(lock_course(root))
        stack.callback(progress.end)
        work_files.sweep_scratch()
        workers = stack.enter_context(_make_workers(jobs, store, trust, scheduler, root, progress))
        interruption = stack.enter_context(Interruption(workers.wake))
        intake = SubmissionIntake(gradebook, assignment, names, trust=trust)
        whole = FreshRun(intake.work_folder, assignment)
        fresh_run = FreshRun(intake.work_folder, assignment, students) if students else whole
        if fresh_run.start_revision:
            progress.say("Going on with the run with --fresh that was ended before it was through.")
        if fresh:
            fresh_run.begin()
        run = GradingRun(
            intake, store, workers, interruption, progress, feedback=feedback,
            since=max(fresh_run.start_revision, whole.start_revision),
        )  # fmt: skip
        graded = [*refused, *run.grade(found, refused)]
        fresh_run.end()
    return sorted(graded, key=lambda item: item.student)


def _make_workers(
    count: int, store: OutcomeStore, trust: bool, scheduler: str, root: Path, progress: RunProgress
) -> Workers:
    def keep(job: GradingJob, result: JobResult) -> None:
        store.put(job.program, job.files, result.outcome, result.mode)

    if not scheduler:
        return LocalWorkers(count, keep, trust=trust, hidden=[root])
    from autograder.running.workers.cluster import Cluster

    return Cluster(scheduler, keep, trust=trust, hidden=[root], say=progress.say)


@contextmanager
def lock_course(root: Path) -> Iterator[None]:
    """Hold the course for the block; the kernel lets it go when the process ends, however.

    Raises:
        BusyError: another process holds it.
    """
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


def released_notebooks(gradebook: CourseGradebook, assignment: str) -> list[str]:
    """Return the notebooks of a released assignment.

    Raises:
        AssignmentError: there is none of this name, or it has not been released.
    """
    known = gradebook.assignment_names()
    released = gradebook.notebook_names(assignment) if assignment in known else []
    if not released:
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
    return released


def _submitted_students(
    gradebook: CourseGradebook, assignment: str, known: Roster, only: Collection[str]
) -> tuple[list[str], dict[str, str]]:
    """Return who has submitted, and what is wrong with the folders that cannot be graded.

    ``only`` are the ids of the students that are meant; all if there are none.
    """
    students, wrong = roster.find_submissions(
        gradebook.root, assignment, known, gradebook.assignment_names()
    )
    there = {*students, *map(known.student_id, wrong)}
    for student in only:
        if student not in there:
            raise AssignmentError(
                f"'{student}' has not submitted '{assignment}'{is_it(student, there)}: there "
                f"is no folder {gradebook.root / 'submitted' / student / assignment}."
            )
    if not students and not wrong:
        raise NobodySubmittedError(
            f"Nobody has submitted '{assignment}' yet: nbgrader expects the files in "
            f"{gradebook.root / 'submitted'}/<student>/{assignment}/."
        )
    if not only:
        return students, wrong
    wrong = {name: problem for name, problem in wrong.items() if known.student_id(name) in only}
    return [student for student in students if student in only], wrong
