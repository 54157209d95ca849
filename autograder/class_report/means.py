"""Means of a class: by exercise, by question, and by learning objective, each with its n.

Students who have not handed in an exercise, or wait for a mark, are in no mean of it.
"""

from __future__ import annotations

import statistics
import tomllib
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from autograder.assignments import questions
from autograder.assignments.quiz_cells import PREFIX
from autograder.class_report.class_data import ClassData
from autograder.examination import points
from autograder.util import exercise_folders
from autograder.util.exercise_folders import ExerciseError, Exercises


@dataclass(frozen=True)
class Mean:
    """The mean of something that earns points.

    Attributes:
        about: the exercise; empty for a learning objective.
        title: the question or the objective; empty for a whole exercise.
        n: students whose points are in it.
        mean: in points; None if n is 0.
        max_points: what there is to earn.
        waiting: students who handed it in, and wait for a mark.
    """

    about: str
    title: str
    n: int
    mean: float | None
    max_points: float
    waiting: int

    @property
    def share(self) -> float | None:
        """The mean as a share of what there is to earn, 0 to 1."""
        return None if self.mean is None or not self.max_points else self.mean / self.max_points


@dataclass(frozen=True)
class Means:
    """All means: ``exercises`` and ``questions`` in points, ``objectives`` as shares of 1."""

    exercises: tuple[Mean, ...]
    questions: tuple[Mean, ...]
    objectives: tuple[Mean, ...]


def of_class(data: ClassData) -> Means:
    """Return the means of a class."""
    return Means(
        tuple(_exercise_means(data)), tuple(_question_means(data)), tuple(_objective_means(data))
    )


def load_objectives() -> Mapping[tuple[str, str], str]:
    """Return {(exam, check or grade id): objective}, exercise by exercise.

    What a learner shows by a check or a written answer stands in the ``objectives.toml`` of the
    exercise's folder. It may leave some out: they are of no objective.

    Raises:
        ExerciseError: such a file is not sound.
    """
    return _objectives_of(exercise_folders.current_exercises())


@lru_cache(maxsize=2)
def _objectives_of(exercises: Exercises) -> Mapping[tuple[str, str], str]:
    return {
        (exam, name): objective
        for exam in points.table()
        for objective, names in _read_objectives(
            exercises.folders[exam] / exercise_folders.OBJECTIVES
        )
        for name in names
    }


def _read_objectives(file: Path) -> list[tuple[str, list[str]]]:
    if not file.is_file():
        return []
    try:
        listed = tomllib.loads(file.read_text(encoding="utf-8"))
        return [(objective, list(names)) for objective, names in listed.items()]
    except (OSError, ValueError, TypeError) as error:
        raise ExerciseError(f"{file} lists no names of checks: {error}.") from None


def _exercise_means(data: ClassData) -> Iterator[Mean]:
    for notebook in _notebook_names(data):
        earned, waiting = [], 0
        for grade in data.grades:
            cells = grade.cells.get(notebook)
            if not cells or data.has_left_out(grade.student, notebook):
                continue
            marked = [value for value in cells.values() if value is not None]
            if data.is_unreadable(grade.student, notebook) or len(marked) < len(cells):
                waiting += 1
            else:
                earned.append(sum(marked))
        title = questions.title_of_notebook(notebook)
        worth = sum(q.max_points for q in data.questions.get(notebook, {}).values())
        yield _make_mean(title, "", earned, worth, waiting)


def _question_means(data: ClassData) -> Iterator[Mean]:
    for notebook in _notebook_names(data):
        about = questions.title_of_notebook(notebook)
        for question in data.questions.get(notebook, {}).values():
            earned, waiting = [], 0
            for grade in data.grades:
                cells = grade.cells.get(notebook, {})
                if question.grade_id not in cells or data.has_left_out(grade.student, notebook):
                    continue
                value = cells[question.grade_id]
                if value is None or data.is_unreadable(grade.student, notebook):
                    waiting += 1
                else:
                    earned.append(value)
            yield _make_mean(about, question.title, earned, question.max_points, waiting)


def _objective_means(data: ClassData) -> Iterator[Mean]:
    """Yield for each objective the mean share that students have of what is marked for them."""
    earned: defaultdict[str, defaultdict[str, list[tuple[float, float]]]]
    earned = defaultdict(lambda: defaultdict(list))
    waiting: defaultdict[str, set[str]] = defaultdict(set)
    for student, objective, got, most in _objective_points(data):
        if got is None:
            waiting[objective].add(student)
        else:
            earned[objective][student].append((got, most))
    known = [*dict.fromkeys(load_objectives().values()), *earned, *waiting]
    for objective in dict.fromkeys(known):
        if objective in earned or objective in waiting:
            shares = [
                sum(got for got, _ in found) / sum(most for _, most in found)
                for found in earned[objective].values()
            ]
            yield _make_mean("", objective, shares, 1.0, len(waiting[objective]))


def _objective_points(data: ClassData) -> Iterator[tuple[str, str, float | None, float]]:
    """Yield (student, objective, points or None while they wait, points to earn)."""
    for student, notebooks in data.records.items():
        for notebook, record in notebooks.items():
            if record.unreadable or data.has_left_out(student, notebook):
                continue
            for verdict in record.verdicts.values():
                quiz = verdict.exam.startswith(PREFIX)
                for check in verdict.checks:
                    what = (
                        check.title if quiz else load_objectives().get((verdict.exam, check.name))
                    )
                    if what and check.max_points:
                        open_ = check.status in ("grader_error", "not_examined")
                        yield student, what, None if open_ else check.points, check.max_points
    exams = {cell: exam for exam, entry in points.table().items() for cell in entry.manual}
    for grade in data.grades:
        for notebook, cells in grade.cells.items():
            if data.has_left_out(grade.student, notebook) or data.is_unreadable(
                grade.student, notebook
            ):
                continue
            for question in data.questions.get(notebook, {}).values():
                cell = question.grade_id
                what = load_objectives().get((exams.get(cell, ""), cell))
                if what and cell in cells:
                    yield grade.student, what, cells[cell], question.max_points


def _notebook_names(data: ClassData) -> list[str]:
    return sorted({notebook for grade in data.grades for notebook in grade.cells})


def _make_mean(about: str, title: str, earned: list[float], most: float, waiting: int) -> Mean:
    mean = statistics.fmean(earned) if earned else None
    return Mean(about, title, len(earned), mean, most, waiting)
