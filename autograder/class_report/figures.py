"""The figures of a class: how each check fared, how well it discriminates, and how long it took.

The discrimination of a check is the point-biserial correlation of passing it with the *rest* score,
the points on all other checks of the assignment: with its own points inside the total every check
would seem to discriminate (Crocker and Algina, "Introduction to Classical and Modern Test Theory",
chapter 14).
"""

from __future__ import annotations

import statistics
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from autograder.assignments.quiz_cells import PREFIX
from autograder.class_report.class_data import ClassData
from autograder.examination.verdict import CheckResult, Status
from quizzes.insight.analysis import FEWEST_WRONG, compute_discrimination

FEW = 10
"""Submissions below which figures say little; they are shown all the same, and marked."""
EASY, HARD, FLAT = 0.05, 0.75, 0.1
"""Bounds for advice: failure rates that hardly anybody or nearly everybody has; hardly tells."""

Key = tuple[str, str, str]
"""A check: (notebook, grade id, name)."""


@dataclass(frozen=True)
class CheckFigures:
    """How one check fared.

    Attributes:
        notebook, grade_id, name, title: the check.
        max_points: what it is worth.
        passed, failed, not_checked, grader_errors: submissions by what came of it.
        failure_rate: failed of those on which it was examined, 0 to 1; None if on none.
        discrimination: correlation of passing with the rest score, -1 to 1, among those on which
            it was examined; None if it is not defined.
        advice: what to look at, or "".
        not_handed_in: students of the class who have not handed in the notebook: nobody's failure.
    """

    notebook: str
    grade_id: str
    name: str
    title: str
    max_points: float
    passed: int
    failed: int
    not_checked: int
    grader_errors: int
    failure_rate: float | None
    discrimination: float | None
    advice: str
    not_handed_in: int = 0

    @property
    def examined_count(self) -> int:
        """The n of failure rate and discrimination: submissions on which it was examined."""
        return self.passed + self.failed


@dataclass(frozen=True)
class Times:
    """Wall time in seconds that a submission took: the sum over its notebooks, by student."""

    seconds: dict[str, float]

    @property
    def median_seconds(self) -> float:
        """The median in seconds; 0 if nothing was run."""
        return statistics.median(self.seconds.values()) if self.seconds else 0.0

    @property
    def slowest_submissions(self) -> list[tuple[str, float]]:
        """The five submissions that took longest, the longest first."""
        return sorted(self.seconds.items(), key=lambda item: (-item[1], item[0]))[:5]


def check_results(data: ClassData) -> Iterator[tuple[str, Key, CheckResult]]:
    """Yield (student, check, result) for the checks of every submission that could be run.

    The questions of quizzes are no checks; they have a report of their own.
    """
    for student, notebooks in data.records.items():
        for notebook, record in notebooks.items():
            if record.unreadable or data.has_left_out(student, notebook):
                continue
            for grade_id, verdict in record.verdicts.items():
                if not verdict.exam.startswith(PREFIX):
                    for result in verdict.checks:
                        yield student, (notebook, grade_id, result.name), result


def check_figures(data: ClassData) -> tuple[CheckFigures, ...]:
    """Return the figures of each check, in the order in which they stand in the verdicts."""
    by_check: dict[Key, dict[str, CheckResult]] = {}
    totals: defaultdict[str, float] = defaultdict(float)
    for student, key, result in check_results(data):
        by_check.setdefault(key, {})[student] = result
    for found in by_check.values():
        for student, result in found.items():
            totals[student] += result.points
    notebooks = {key[0]: None for key in sorted(by_check, key=lambda key: key[0])}
    ordered = (key for notebook in notebooks for key in by_check if key[0] == notebook)
    return tuple(
        _make_figures(key, by_check[key], totals, data.not_handed_in(key[0])) for key in ordered
    )


def run_times(data: ClassData) -> Times:
    """Return how long the submissions took that could be run."""
    seconds = {
        student: sum(record.seconds for record in notebooks.values())
        for student, notebooks in data.records.items()
        if any(
            not record.unreadable and not data.has_left_out(student, notebook)
            for notebook, record in notebooks.items()
        )
    }
    return Times(seconds)


def _make_figures(
    key: Key, found: dict[str, CheckResult], totals: Mapping[str, float], not_handed_in: int
) -> CheckFigures:
    counts = Counter(result.status for result in found.values())
    examined = counts["passed"] + counts["failed"]
    rate = counts["failed"] / examined if examined else None
    # Rounded, because sums of tenths in another order differ in their last bit.
    correlation = compute_discrimination(
        (float(result.passed), round(totals[student] - result.points, 6))
        for student, result in found.items()
        if result.status in ("passed", "failed")
    )
    any_result = next(iter(found.values()))
    return CheckFigures(
        *key, any_result.title, any_result.max_points,
        counts["passed"], counts["failed"], counts["not_checked"], counts["grader_error"],
        rate, correlation, _give_advice(counts, examined, rate, correlation), not_handed_in,
    )  # fmt: skip


def _give_advice(
    counts: Counter[Status], examined: int, rate: float | None, correlation: float | None
) -> str:
    if counts["grader_error"]:
        return "the grader itself failed here: see what needs a person"
    if rate is None:
        return "it was examined on no submission"
    if examined < FEW:
        return "too few submissions"
    if counts["failed"] < FEWEST_WRONG:
        return ""
    if correlation is not None and correlation < -FLAT:
        return "those who do well on the rest fail it: look at the check and at the task's wording"
    if rate > HARD:
        return "most fail it: teach it again, or look at the task's wording"
    if rate < EASY:
        return "hardly anybody fails it"
    if correlation is not None and correlation < FLAT:
        return "does not tell who does well from who does not"
    return ""
