"""What ``autograder corpus`` shows: each case's result, and which mutant kills which check."""

from __future__ import annotations

from collections import defaultdict
from typing import Any

from rich.table import Table

from autograder import exercises
from autograder.corpus.case import Case
from autograder.corpus.trials import CorpusTrial
from autograder.examination import points


def trials_table(trials: list[CorpusTrial]) -> Table:
    """Return one row a case: what it must fail, how often it came out so, and its time."""
    rows = Table("Case", "Must fail", "As expected", "Flips", "Seconds a run (median)")
    for (exam, name), runs in _by_case(trials).items():
        right = sum(not run.difference for run in runs)
        seconds = sorted(run.outcome.seconds for run in runs)[len(runs) // 2]
        flips = str(len(flipped_checks(runs)) or "-")
        fails = runs[0].case.fails_in_words
        rows.add_row(f"{exam}/{name}", fails, f"{right} of {len(runs)}", flips, f"{seconds:.1f}")
    return rows


def as_data(trials: list[CorpusTrial]) -> list[dict[str, Any]]:
    """Return the same for machines, one entry a run."""
    return [
        {
            "exam": trial.case.exam, "case": trial.case.name,
            "must_fail": trial.case.fails_in_words, "statuses": trial.check_statuses,
            "difference": trial.difference, "seconds": trial.outcome.seconds,
        }
        for trial in trials
    ]  # fmt: skip


def flipped_checks(runs: list[CorpusTrial]) -> list[str]:
    """Return the checks whose status was not the same in all runs of a case."""
    names = {name for run in runs for name in run.check_statuses}
    return sorted(name for name in names if len({run.check_statuses.get(name) for run in runs}) > 1)


def all_flips(trials: list[CorpusTrial]) -> list[str]:
    """Return "exam/case: check" for every verdict that changed between repeats."""
    return [
        f"{exam}/{name}: {check}"
        for (exam, name), runs in _by_case(trials).items()
        for check in flipped_checks(runs)
    ]


def without_mutant(exam: str, cases: list[Case]) -> list[str]:
    """Return the checks of an exam that no case must fail: checks that nobody needs."""
    killed = {name for case in cases for name in case.must_fail}
    return [name for name in exercises.load_exam(exam).checks if name not in killed]


def checks_matrix(cases: dict[str, list[Case]]) -> str:
    """Return the Markdown table of checks and the cases that each must catch, exam by exam."""
    lines = [
        "# Checks and the mutants that prove them",
        "",
        "Written by `autograder corpus --table`; a test keeps it in step with the corpus.",
        "A check that no mutant needs would not be a check. One with 0 points is passed by the",
        "untouched notebook, and needed for others. The cases in `every/` each exercise gets: an",
        "empty cell, a syntax error, an endless loop, …",
        "",
    ]
    for exam, own in cases.items():
        right = [case for case in own if not case.fails]
        entry = points.table()[exam]
        lines += [
            f"## {entry.title} (`{exam}`)",
            "",
            f"Correct designs that must get full marks: {len(right)}",
            "",
        ]
        lines += [f"- `{case.name}`: {case.title}" for case in right]
        lines += ["", "| Check | Points | Must be caught |", "|---|---|---|"]
        worth = {name: p for part in entry.parts.values() for name, p in part.items()}
        for name in exercises.load_exam(exam).checks:
            killers = [f"`{case.name}`" for case in own if name in case.must_fail]
            lines.append(f"| `{name}` | {worth.get(name, 0):g} | {', '.join(killers)} |")
        unexamined = [f"`{case.name}`" for case in own if case.fails and not case.must_fail]
        lines += [
            "",
            f"Not examined at all, with the reason in the report: {', '.join(unexamined)}.",
            "",
        ]
    return "\n".join(lines)


def _by_case(trials: list[CorpusTrial]) -> dict[tuple[str, str], list[CorpusTrial]]:
    cases: dict[tuple[str, str], list[CorpusTrial]] = defaultdict(list)
    for trial in trials:
        cases[trial.case.exam, trial.case.name].append(trial)
    return dict(cases)
