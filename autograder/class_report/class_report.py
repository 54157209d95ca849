"""What is in a class report."""

from __future__ import annotations

import statistics
from dataclasses import dataclass
from typing import Any

from autograder.class_report import attention, feedback, figures, means
from autograder.class_report.class_data import ClassData
from autograder.class_report.similarity import alike_pairs, compared_work
from autograder.class_report.similarity.own_text import GivenText


@dataclass(frozen=True)
class ClassReport:
    """Everything that the page shows.

    ``texts`` is what the students wrote, by what was compared, ``given`` the assignment's own code,
    ``threshold`` the similarity from which pairs are shown, ``notes`` says what is left out.
    """

    data: ClassData
    checks: tuple[figures.CheckFigures, ...]
    times: figures.Times
    feedback: list[feedback.FeedbackGroup]
    needs: list[attention.Need]
    alike: alike_pairs.Similarity
    texts: compared_work.Texts
    given: GivenText
    threshold: float
    notes: tuple[str, ...]
    means: means.Means

    @property
    def examined_count(self) -> int:
        """How many submissions some check was run on."""
        return len(self.times.seconds)

    @property
    def median_score(self) -> float:
        """The median score in points."""
        return statistics.median(grade.score for grade in self.data.grades)

    @property
    def mean_score(self) -> float:
        """The mean score in points."""
        return statistics.fmean(grade.score for grade in self.data.grades)

    def as_data(self) -> dict[str, Any]:
        """Return the report for machines."""
        return {
            "checks": [vars(check) for check in self.checks],
            "seconds": self.times.seconds,
            "feedback": [vars(group) for group in self.feedback],
            "needs_person": [vars(need) for need in self.needs],
            "absent": list(self.data.absent),
            "means": {
                kind: [vars(mean) for mean in found] for kind, found in vars(self.means).items()
            },
            "alike": [vars(pair) for pair in self.alike.pairs],
            "notes": list(self.notes),
        }
