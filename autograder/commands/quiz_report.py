"""The quizzes of an assignment in ``autograder report``: item analysis of a class's attempts."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.table import Table

from autograder.assignments import quiz_cells
from autograder.assignments.intake import attempts_search
from autograder.assignments.intake.handed_files.file_names import normalise_name
from autograder.commands.quiz_command import QuizCommandError, as_course_errors
from autograder.gradebook.course_gradebook import CourseGradebook, GradebookError
from autograder.gradebook.nbgrader_plugins import autograde_steps
from quizzes.attempts import record, sharing

if TYPE_CHECKING:
    from quizzes.bank.contents import Bank
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

    def as_tables(self) -> tuple[Table, ...]:
        """Return the items, the misconceptions that somebody holds, and who shares attempts."""
        from quizzes.insight import item_report

        items = Table("Item", "Kind", "Learners", "p", "r", "Remark", padding=(0, 0))
        items.caption = "p: difficulty, mean credit; r: discrimination, correlation with the rest"
        for column in items.columns[:5]:
            column.no_wrap = True
        for row in item_report.item_rows(self.analysis):
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
        NotReadyError: the source of one is damaged.
    """
    source = root / "source"
    if (source / name).is_dir() or name not in quiz_cells.quiz_names(root):
        return name
    having = sorted({
        path.parent.name for path in source.glob("*/*.ipynb")
        if name in quiz_cells.in_cells(autograde_steps.read_source(path))
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
    reports = []
    for name in quiz_cells.quiz_names(root):
        taken = _collect_attempts(root, assignment, name)
        if taken.unread or any(content is not None for content in taken.contents.values()):
            bank = quiz_cells.find_bank(root, name)
            reports.append(_write_report(bank, taken, root / "reports" / assignment))
    return reports


@dataclass
class _Taken:
    """What the gradebook takes as a class's attempts at a quiz.

    Attributes:
        contents: {learner: what their file holds, or None if there is none}.
        unread: a sentence for each whose file cannot be read.
        asked: one for each about whom a person is asked.
    """

    contents: dict[str, bytes | None] = field(default_factory=dict)
    unread: list[str] = field(default_factory=list)
    asked: list[str] = field(default_factory=list)


def _known_students(root: Path) -> frozenset[str]:
    """Return the students in the gradebook, if there is one."""
    with suppress(GradebookError):
        return CourseGradebook(root).read_roster().known
    return frozenset()


def _collect_attempts(root: Path, assignment: str, quiz: str) -> _Taken:
    taken = _Taken()
    class_ = _known_students(root)
    for folder in sorted((root / "submitted").glob(f"*/{assignment}")):
        learner = normalise_name(folder.parent.name)
        try:
            found = attempts_search.find_attempts(folder, quiz, learner, root, class_)
        except OSError as error:
            name = record.attempts_filename(quiz)
            taken.unread.append(f"{name} of {learner} cannot be read ({error.strerror or error}).")
            continue
        if found.question:
            taken.asked.append(f"{learner}: {found.question}")
        if found.content is not None or not found.question:
            taken.contents[learner] = found.content
    return taken


def _write_report(bank: Bank, taken: _Taken, target: Path) -> QuizReport:
    from quizzes import insight  # plots take a moment to import

    with as_course_errors():
        collected = insight.collect_class(bank, taken.contents)
        handed_in = {who: what for who, what in taken.contents.items() if what is not None}
        shared = sharing.same_attempts(bank.quiz, handed_in)
        notes = [
            *(f"The same attempts were handed in by {', '.join(group)}." for group in shared),
            *sorted([*collected.notes, *taken.unread, *taken.asked]),
        ]
        analysis = insight.analyse_results(bank, collected.results, notes)
        return QuizReport(analysis, insight.write_report(analysis, target), tuple(shared))
