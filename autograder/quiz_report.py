"""The quizzes of an assignment in ``autograder report``: item analysis of a class's attempts."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.table import Table

from autograder import quiz_marks, quiz_sharing, submission
from autograder.quiz_cli import QuizCommandError, as_course_errors
from quizzes import record, sharing

if TYPE_CHECKING:
    from quizzes.bank import Bank
    from quizzes.insight.analysis import Analysis


@dataclass(frozen=True)
class QuizReport:
    """What the attempts at one quiz say, and the files in which it stands.

    ``shared`` are groups of learners who have handed in the same attempts.
    """

    analysis: Analysis
    files: list[Path]
    shared: tuple[tuple[str, ...], ...] = ()

    def as_data(self) -> dict[str, Any]:
        """Return the report for machines."""
        analysis = self.analysis
        return {
            "quiz": analysis.bank.quiz,
            "learners": analysis.learners,
            "passed": analysis.passed,
            "items": [vars(figures) for figures in (*analysis.concepts, *analysis.variants)],
            "misconceptions": [
                {**vars(figures), "share": figures.share} for figures in analysis.beliefs
            ],
            "notes": list(analysis.notes),
            "same_attempts": [list(group) for group in self.shared],
            "cannot_know": sharing.CANNOT_KNOW,
            "files": [str(path) for path in self.files],
        }

    def tables(self) -> tuple[Table, ...]:
        """Return the items, the misconceptions that somebody holds, and who shares attempts."""
        from quizzes.insight import report

        items = Table("Item", "Kind", "Learners", "p", "r", "Remark", padding=(0, 0))
        items.caption = "p: difficulty, mean credit; r: discrimination, correlation with the rest"
        for column in items.columns[:5]:
            column.no_wrap = True
        for row in report.item_rows(self.analysis):
            if row[1] == "concept" or row[2] != "0":  # the page has the other variants, too
                items.add_row(*row, style="bold" if row[1] == "concept" else None)
        beliefs = Table("Misconception", "Held by", "Share")
        for figures in self.analysis.beliefs:
            if figures.holders:
                held = f"{figures.holders} of {figures.met}"
                beliefs.add_row(figures.belief, held, f"{100 * figures.share:.0f} %")
        shared = Table("The same attempts were handed in by")
        shared.caption = sharing.CANNOT_KNOW
        for group in self.shared or [("nobody",)]:
            shared.add_row(", ".join(group))
        return items, beliefs, shared


def assignment_of(root: Path, name: str) -> str:
    """Return the assignment that ``name`` means: an assignment, or the one that has such a quiz.

    Raises:
        QuizCommandError: several assignments have the quiz.
    """
    source = root / "source"
    if (source / name).is_dir() or name not in quiz_marks.names(root):
        return name
    having = sorted({
        path.parent.name for path in source.glob("*/*.ipynb")
        if name in quiz_marks.in_cells(submission.read(path))
    })  # fmt: skip
    if len(having) > 1:
        raise QuizCommandError(
            f"The quiz '{name}' is in the assignments {', '.join(having)}: name one of them."
        )
    return having[0] if having else name


def of_assignment(root: Path, assignment: str) -> list[QuizReport]:
    """Analyse each quiz that somebody has handed in with an assignment, and write the reports.

    They are written into ``reports/ASSIGNMENT`` of the course root.

    Raises:
        QuizMarksError: a bank is not sound.
        QuizCommandError: the reports cannot be written.
    """
    submitted = sorted((root / "submitted").glob(f"*/{assignment}"))
    folders = {folder.parent.name: folder for folder in submitted}
    reports = []
    for name in quiz_marks.names(root):
        if any((folder / record.filename(name)).exists() for folder in folders.values()):
            bank = quiz_marks.find_bank(root, name)
            reports.append(_report(bank, folders, root, assignment))
    return reports


def _report(bank: Bank, folders: dict[str, Path], root: Path, assignment: str) -> QuizReport:
    from quizzes import insight  # plots take a moment to import

    target = root / "reports" / assignment
    with as_course_errors():
        collected = insight.collect(bank, folders)
        shared = quiz_sharing.same_attempts(root, assignment, bank.quiz, folders)
        notes = [
            *(f"The same attempts were handed in by {', '.join(group)}." for group in shared),
            *collected.notes,
        ]
        analysis = insight.analyse(bank, collected.results, notes)
        return QuizReport(analysis, insight.write(analysis, target), tuple(shared))
