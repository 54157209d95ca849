"""A student's sheet: every graded cell, what it earned, and what waits for a person.

The feedback pages and the index page show it; nothing here decides on points.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from datetime import datetime

from nbgrader.api import (
    Comment,
    Grade,
    Gradebook,
    Notebook,
    SubmittedAssignment,
    SubmittedNotebook,
)
from nbgrader.coursedir import CourseDirectory

from autograder.assignments import questions
from autograder.assignments.questions import GradedQuestion
from autograder.gradebook.database import of_cells
from course.messages.yaml_text import format_count


@dataclass(frozen=True)
class SheetLine:
    """One graded cell.

    Attributes:
        grade_id, title: the cell.
        points: what counts now, 0 before the first mark.
        max_points: what it is worth.
        waits: a person has to look at it.
        marked: a person has given it points before.
        written: it is an answer in words.
        comment: what a person has written below it.
    """

    grade_id: str
    title: str
    points: float
    max_points: float
    waits: bool
    marked: bool = False
    written: bool = False
    comment: str = ""

    @property
    def said(self) -> str:
        """What is to be said of it, in a few words."""
        said = f"{self.points:g} of {_points_text(self.max_points)}"
        if not self.waits:
            return said
        if self.marked:
            return f"{said}, to be looked at again"
        what = "waits for its mark" if self.written else "waits for a person"
        return (
            f"{said} so far, {what}" if self.points else f"{what} ({_points_text(self.max_points)})"
        )


@dataclass(frozen=True)
class ExerciseSheet:
    """One notebook of a submission; ``penalty`` is what lateness takes off, in points."""

    notebook: str
    title: str
    lines: tuple[SheetLine, ...]
    penalty: float = 0.0

    @property
    def score(self) -> float:
        """Points so far, less the penalty."""
        return max(0.0, sum(line.points for line in self.lines) - self.penalty)

    @property
    def max_score(self) -> float:
        """Points there are to earn."""
        return sum(line.max_points for line in self.lines)

    @property
    def score_sentence(self) -> str:
        """The score as a sentence that says what is still to come."""
        return describe_score(self.lines, self.score)


@dataclass(frozen=True)
class Sheet:
    """All exercises of a student's submission.

    Attributes:
        assignment, student: whose sheet it is.
        name: the student's name; the id if none is known.
        exercises: in the order of their notebooks' names.
        handed_in: when, as far as it is known; in UTC without a zone, as nbgrader has it.
        seconds_late: how much later than it was due, extensions included.
    """

    assignment: str
    student: str
    name: str
    exercises: tuple[ExerciseSheet, ...]
    handed_in: datetime | None = None
    seconds_late: float = 0.0

    @property
    def lines(self) -> tuple[SheetLine, ...]:
        """The lines of all exercises."""
        return tuple(line for exercise in self.exercises for line in exercise.lines)

    @property
    def score(self) -> float:
        """Points so far, less all penalties."""
        return sum(exercise.score for exercise in self.exercises)

    @property
    def penalty(self) -> float:
        """What lateness takes off, in points."""
        return sum(exercise.penalty for exercise in self.exercises)

    @property
    def score_sentence(self) -> str:
        """The score as a sentence that says what is still to come."""
        return describe_score(self.lines, self.score)

    @property
    def late_sentence(self) -> str:
        """What is to be said of lateness: a sentence, or nothing."""
        return describe_lateness(self.seconds_late, self.penalty)


def read_sheet(
    gradebook: Gradebook, coursedir: CourseDirectory, assignment: str, student: str
) -> Sheet:
    """Return the sheet of a student, as the gradebook has it now.

    Raises:
        MissingEntry: there is no such submission.
    """
    submission = gradebook.find_submission(assignment, student)
    asked = questions.known_questions(coursedir, assignment)
    worth = gradebook.db.query(Notebook.name, SubmittedNotebook.late_submission_penalty)
    worth = worth.join(SubmittedNotebook, SubmittedNotebook.notebook_id == Notebook.id)
    worth = worth.filter(SubmittedNotebook.assignment_id == submission.id)
    penalties = {notebook: float(penalty or 0.0) for notebook, penalty in worth}
    comments = {
        (notebook, cell): said or ""
        for notebook, cell, said in _query_rows(gradebook, Comment, (Comment.comment,), submission)
    }
    lines: dict[str, dict[str, SheetLine]] = {notebook: {} for notebook in sorted(penalties)}
    columns = (Grade.score, Grade.manual_score, Grade.max_score, Grade.needs_manual_grade)
    for notebook, cell, score, by_hand, most, waits in _query_rows(
        gradebook, Grade, columns, submission
    ):
        question = asked.get(notebook, {}).get(cell)
        lines[notebook][cell] = SheetLine(
            cell,
            question.title if question else cell,
            float(score),
            float(most),
            bool(waits),
            by_hand is not None,
            question is not None and question.written,
            comments.get((notebook, cell), ""),
        )
    exercises = (
        ExerciseSheet(
            notebook,
            questions.title_of_notebook(notebook),
            tuple(_sort_lines(found, asked.get(notebook, {}))),
            penalties[notebook],
        )
        for notebook, found in lines.items()
    )
    person = submission.student
    name = " ".join(part for part in (person.first_name, person.last_name) if part)
    # nbgrader itself cannot tell how late something is if it was extended and is never due.
    due = submission.assignment.duedate
    return Sheet(
        assignment, student, name or student, tuple(exercises), submission.timestamp,
        float(submission.total_seconds_late) if due is not None else 0.0,
    )  # fmt: skip


def describe_score(lines: Iterable[SheetLine], score: float) -> str:
    """Return a sum as a sentence that says what is still to come."""
    every = list(lines)
    said = f"{score:g} of {_points_text(sum(line.max_points for line in every))}"
    waiting = [line for line in every if line.waits]
    if not waiting:
        return f"{said}."
    open_points = sum(line.max_points - line.points for line in waiting)
    written = all(line.written for line in waiting)
    what, whom = ("answer", "a mark") if written else ("part", "a person")
    verb = "waits" if len(waiting) == 1 else "wait"
    return (
        f"{said} so far; {format_count(len(waiting), what)} {verb} for {whom} and can add up to "
        f"{open_points:g}."
    )


def describe_lateness(seconds: float, penalty: float) -> str:
    """Return what is to be said of lateness: a sentence, or nothing."""
    if seconds <= 0:
        return ""
    off = f"{_points_text(penalty)} off" if penalty else "nothing is taken off"
    return f"Handed in {_time_text(seconds)} late: {off}."


def _query_rows(
    gradebook: Gradebook, kind: type, columns: tuple[object, ...], submission: SubmittedAssignment
) -> list[tuple]:  # type: ignore[type-arg]
    query = of_cells(gradebook.db, kind, *columns)
    query = query.filter(SubmittedAssignment.id == submission.id)
    return [tuple(row)[1:] for row in query]


def _sort_lines(found: dict[str, SheetLine], asked: dict[str, GradedQuestion]) -> list[SheetLine]:
    order = {cell: number for number, cell in enumerate(asked)}
    return sorted(found.values(), key=lambda line: (order.get(line.grade_id, 999), line.grade_id))


def _points_text(value: float) -> str:
    return "1 point" if value == 1 else f"{value:g} points"


def _time_text(seconds: float) -> str:
    minutes = max(1, round(seconds / 60))
    days, hours, minutes = minutes // 1440, minutes // 60 % 24, minutes % 60
    parts = [(days, "day"), (hours, "hour"), (minutes, "minute")]
    return " ".join([format_count(number, unit) for number, unit in parts if number][:2])
