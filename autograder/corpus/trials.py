"""Running cases of the corpus, as often as asked and beside as much other work as asked."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from nbformat import NotebookNode

from autograder import exercises
from autograder.assignments import listing, submission
from autograder.assignments.build_notebooks import build
from autograder.corpus.case import Case
from autograder.examination import points
from autograder.examination.draws import USUAL_SEED
from autograder.examination.program import Program
from autograder.gradebook.release import make_release
from autograder.running import runner
from autograder.running.runner import Outcome
from autograder.util import exercise_folders
from course.workspace.content import content_root, copy_authoring

ASSIGNMENT = "corpus"
"""The assignment that the notebook of an exam by itself is released as."""

Notebooks = tuple[NotebookNode, NotebookNode]
"""The source and the released version of one notebook."""


@dataclass(frozen=True)
class CorpusTrial:
    """One run of a case: its outcome, and how that differs from what must come out."""

    case: Case
    outcome: Outcome
    difference: str

    @property
    def check_statuses(self) -> dict[str, str]:
        """{check: status} over all parts."""
        verdicts = self.outcome.verdicts.values()
        return {check.name: check.status for verdict in verdicts for check in verdict.checks}


def make_notebooks(exam: str) -> Notebooks:
    """Build and release the notebook of one exam by itself; return both versions."""
    exercise_folders.exercise_file(exercises.load_exam(exam).name, exercise_folders.POINTS)
    entry = points.table()[exam]
    with tempfile.TemporaryDirectory(prefix="ros2-course-corpus-") as folder:
        root = one_notebook(Path(folder), exam)
        build(root)
        make_release(root, ASSIGNMENT)
        source, released = (
            submission.read_notebook(root / step / ASSIGNMENT / f"{entry.notebook}.ipynb")
            for step in ("source", "release")
        )
    return source, released


def one_notebook(folder: Path, exam: str, assignment: str = ASSIGNMENT) -> Path:
    """Make ``folder`` a course root with an assignment of one exam's notebook; return it."""
    return notebooks_of(folder, [exam], assignment)


def notebooks_of(folder: Path, exams: Iterable[str], assignment: str = ASSIGNMENT) -> Path:
    """Make ``folder`` a course root with one assignment, of these exams' notebooks; return it."""
    chosen, known = list(exams), exercise_folders.current_exercises()
    root = copy_authoring(content_root(), folder)
    shutil.rmtree(root / listing.ASSIGNMENTS)
    listing.write_list(root, assignment, chosen)
    for exam in known.own.intersection(chosen):
        shutil.copytree(known.folders[exam], root / exercise_folders.FOLDER / exam,
                        dirs_exist_ok=True)  # fmt: skip
    return root


def run(
    cases: list[Case],
    source: NotebookNode,
    released: NotebookNode,
    *,
    jobs: int = 2,
    repeat: int = 1,
    trust: bool = False,
    seed: int = USUAL_SEED,
    done: Callable[[CorpusTrial], None] = lambda _trial: None,
) -> list[CorpusTrial]:
    """Run every case ``repeat`` times, ``jobs`` at a time, and compare.

    ``trust`` and ``seed`` are those of `runner.run`; what cases say is worded for the usual seed.

    Raises:
        CorpusError: a case does not fit its exercise; then none is run.
    """
    programs = {case.name: _make_program(case, source, released) for case in cases}

    def one(case: Case) -> CorpusTrial:
        program = programs[case.name]
        outcome = runner.run(program, cell_timeout=case.cell_timeout, trust=trust, seed=seed)
        trial = CorpusTrial(case, outcome, case.verdict_of(outcome))
        done(trial)
        return trial

    def rounds() -> Iterator[Case]:
        for _ in range(repeat):
            yield from cases

    with ThreadPoolExecutor(max_workers=jobs) as pool:
        return list(pool.map(one, rounds()))


def _make_program(case: Case, source: NotebookNode, released: NotebookNode) -> Program:
    case.require_checks()
    handed_in = case.make_submission(source, released)
    notebook, _ = submission.restore_cells(handed_in, source, released)
    return submission.extract_program(notebook)


# A loop looks who its parent is, again and again: a parent that was killed cannot end it.
_LOOP = "import os, sys\nwhile os.getppid() == int(sys.argv[1]): pass"


@contextmanager
def busy_loops(number: int) -> Iterator[None]:
    """Keep ``number`` processes computing for as long as the block lasts, or this process lives.

    Each is in a session of its own, as if it were started in a terminal of its own: Linux may share
    processors out among sessions first (sched(7): autogroups), and each sandbox has sessions, too.
    """
    command = [sys.executable, "-c", _LOOP, str(os.getpid())]
    loops = [subprocess.Popen(command, start_new_session=True) for _ in range(number)]
    try:
        yield
    finally:
        for loop in loops:
            loop.kill()
            loop.wait()
