"""What ``autograder corpus`` does: run the corpus of one exam or all, and lay out the result."""

from __future__ import annotations

import tempfile
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rich.table import Table

from autograder import corpus, exams, submission
from autograder.build import build
from autograder.corpus import Trial
from autograder.release import release
from course.content import content_root, copy_authoring, corpus_root

NOTEBOOKS = {"qos": ("ch05", "qos-design")}
"""{exam: (assignment, notebook)} that a corpus case is a submission of."""


def run(
    exam: str = "",
    *,
    repeat: int = 1,
    jobs: int = 2,
    say: Callable[[str], None] = lambda _line: None,
) -> list[Trial]:
    """Run the corpus of ``exam`` (all exams if empty); raises ExamError for an unknown one."""
    chosen = [exams.load(exam).name] if exam else exams.names()
    trials = []
    with tempfile.TemporaryDirectory(prefix="ros2-course-corpus-") as folder:
        root = copy_authoring(content_root(), Path(folder))
        build(root)
        for name in chosen:
            assignment, notebook = NOTEBOOKS[name]
            release(root, assignment)
            source, released = (
                submission.read(root / step / assignment / f"{notebook}.ipynb")
                for step in ("source", "release")
            )
            cases = corpus.load(corpus_root(), name)
            trials += corpus.run(
                cases, source, released, jobs=jobs, repeat=repeat,
                done=lambda trial: say(_line(trial)),
            )  # fmt: skip
    return trials


def _line(trial: Trial) -> str:
    return (
        f"  {trial.case.name}: {trial.difference or 'as expected'} ({trial.outcome.seconds:.1f} s)"
    )


def table(trials: list[Trial]) -> Table:
    """Return one row a case: what it must fail, how often it came out so, and its time."""
    rows = Table("Case", "Must fail", "As expected", "Seconds a run (median)")
    for case, runs in _by_case(trials).items():
        fails = _fails(runs[0])
        right = sum(not run.difference for run in runs)
        seconds = sorted(run.outcome.seconds for run in runs)[len(runs) // 2]
        rows.add_row(case, fails, f"{right} of {len(runs)}", f"{seconds:.1f}")
    return rows


def as_data(trials: list[Trial]) -> list[dict[str, Any]]:
    """Return the same for machines."""
    return [
        {
            "exam": trial.case.exam, "case": trial.case.name, "must_fail": _fails(trial),
            "difference": trial.difference, "seconds": trial.outcome.seconds,
        }
        for trial in trials
    ]  # fmt: skip


def _fails(trial: Trial) -> str:
    fails = trial.case.fails
    return "everything" if fails is None else ", ".join(sorted(fails)) or "nothing"


def _by_case(trials: list[Trial]) -> dict[str, list[Trial]]:
    cases: dict[str, list[Trial]] = defaultdict(list)
    for trial in trials:
        cases[trial.case.name].append(trial)
    return dict(cases)
