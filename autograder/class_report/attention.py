"""What of a class needs a person, and why."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from autograder.assignments import questions, quiz_cells
from autograder.class_report import feedback
from autograder.class_report.class_data import ClassData
from autograder.gradebook.course_gradebook import Grade
from autograder.gradebook.quizzes import shared_attempts
from autograder.gradebook.verdict_records import Record


@dataclass(frozen=True)
class Need:
    """One reason to look, and the students it holds for; ``urgent`` if no grade can be relied on.

    A written answer that waits for its marks is ordinary work; a submission that could not be read
    or a mistake of the grader is not.
    """

    why: str
    students: tuple[str, ...]
    urgent: bool


def people_needed(data: ClassData) -> list[Need]:
    """Return the reasons to look, the urgent ones first."""
    found: dict[tuple[bool, str], set[str]] = {}
    for grade in data.grades:
        for urgent, why in _find_reasons(data, grade):
            found.setdefault((urgent, why), set()).add(grade.student)
    for student in data.not_entered:
        why = (
            "There is a submission but no grade: run "
            f"`autograder grade {data.assignment}`, which says why if it cannot be graded."
        )
        found.setdefault((True, why), set()).add(student)
    needs = [Need(why, tuple(sorted(who)), urgent) for (urgent, why), who in found.items()]
    needs = [*needs, *_shared_attempts(data)]
    return sorted(needs, key=lambda need: (not need.urgent, -len(need.students), need.why))


def _shared_attempts(data: ClassData) -> Iterator[Need]:
    """Yield who has handed in the same attempts at a quiz: no points are taken for it."""
    graded = {cell for grade in data.grades for cells in grade.cells.values() for cell in cells}
    for name in sorted(cell for cell in graded if cell.startswith(quiz_cells.PREFIX)):
        quiz = name.removeprefix(quiz_cells.PREFIX)
        students = [grade.student for grade in data.grades]
        for group in shared_attempts.same_attempts(data.root, data.assignment, quiz, students):
            why = (
                f"The same attempts at the quiz {quiz} were handed in by several, who all have "
                "their points: find out whose they are."
            )
            yield Need(why, group, True)


def _find_reasons(data: ClassData, grade: Grade) -> Iterator[tuple[bool, str]]:
    explained = False
    for notebook, cells in grade.cells.items():
        if notebook in grade.asked:
            explained = True
            yield True, feedback.strip_details(grade.asked[notebook], [grade.student])
            continue
        record = data.records.get(grade.student, {}).get(notebook)
        waiting = [cell for cell, points in cells.items() if points is None]
        examined = set(record.verdicts) if record else set()
        reasons = list(_of_record(record, notebook, grade.student)) if record else []
        if examined & set(waiting):
            yield from reasons
            explained = explained or bool(reasons)
        if record is not None and record.unreadable:
            continue  # nobody knows of its other cells whether they are empty
        for cell in waiting:
            if cell not in examined:
                explained = True
                exercise = questions.title_of_notebook(notebook)
                yield False, f"Written answers of {exercise} wait for their marks."
            elif not reasons:
                explained = True
                called = questions.describe_cell(data.questions, notebook, cell)
                yield True, f"{called} was flagged for a manual grade."
    if grade.needs_manual_grade and not explained:
        yield True, "nbgrader says that it needs a manual grade."


def _of_record(record: Record, notebook: str, student: str) -> Iterator[tuple[bool, str]]:
    if record.unreadable:
        said = " ".join(record.notes) or "it could not be run"
        yield True, f"{notebook} was not run: {said[: feedback.MAX_CHARS]}"
        return
    for verdict in record.verdicts.values():
        for result in verdict.checks:
            if result.status in ("grader_error", "not_examined"):
                what = feedback.strip_details(result.actual, [student])
                yield True, f"{notebook}, “{result.title}”: {what}"
