"""The points of all exercises: which check is worth what, in which grade cell.

Each exercise has a ``points.toml`` in its folder. It says what the file of its notebook is called
(like the exercise, if it does not), and lists its checks part by part: each part is one grade cell
of the notebook, called ``<exercise>-<part>`` and worth the sum of its checks. Written answers are
graded by hand, and stand under ``manual`` by the grade id of their cell.

Points are for a student's own work. What the notebook passes as it is handed out is worth 0: a
check that others need, and what these earn is lost with it. The corpus runs the stubs to see it.
"""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from autograder.util import exercise_folders
from autograder.util.exercise_folders import ExerciseError, Exercises

Parts = dict[str, dict[str, float]]


@dataclass(frozen=True)
class PointsEntry:
    """One exercise: what it is called, what its notebook's file is called, and its points.

    ``parts`` maps each part to {check: points}; ``manual`` maps grade ids to points.
    """

    title: str
    notebook: str
    parts: Parts
    manual: dict[str, float]


def table() -> dict[str, PointsEntry]:
    """Return {exercise: entry}, in the order of their titles: Exercise 2 comes before 10.

    Raises:
        ExerciseError: a table of points is not sound.
    """
    return _load_table(exercise_folders.current_exercises())


@lru_cache(maxsize=2)
def _load_table(exercises: Exercises) -> dict[str, PointsEntry]:
    files = {name: folder / exercise_folders.POINTS for name, folder in exercises.folders.items()}
    entries = {name: read_points(file) for name, file in files.items() if file.is_file()}
    entries = dict(sorted(entries.items(), key=lambda named: _title_order(named[1])))
    notebooks: dict[str, str] = {}
    for name, entry in entries.items():
        other = notebooks.setdefault(entry.notebook, name)
        if other != name:
            raise ExerciseError(
                f"The exercises '{other}' and '{name}' have a notebook of the same name, "
                f"'{entry.notebook}': give one of them another in its {exercise_folders.POINTS}."
            )
    return entries


def _title_order(entry: PointsEntry) -> tuple[list[int], str]:
    return [int(n) for n in re.findall(r"\d+", entry.title)], entry.title


def read_points(file: Path) -> PointsEntry:
    """Return what the table of points in an exercise's folder says.

    Raises:
        ExerciseError: it is not sound.
    """
    try:
        data = tomllib.loads(file.read_text(encoding="utf-8"))
        parts = {
            part: {name: float(points) for name, points in entries.items()}
            for part, entries in data.items()
            if isinstance(entries, dict)
        }
        manual = parts.pop("manual", {})
        notebook = str(data.get("notebook", file.parent.name))
        return PointsEntry(str(data["title"]), notebook, parts, manual)
    except KeyError:
        raise ExerciseError(f"{file} must begin with the exercise's title: title = '…'.") from None
    except (OSError, ValueError, TypeError) as error:
        raise ExerciseError(f"{file} is no table of points: {error}.") from None


def of_part(exam: str, part: str) -> dict[str, float]:
    """Return {check: points} of one part of an exam; empty if there is no such part."""
    return table()[exam].parts.get(part, {}) if exam in table() else {}


def grade_cells() -> dict[str, tuple[str, str]]:
    """Return {grade_id: (exam, part)} for every grade cell that an exam fills."""
    return {
        f"{exam}-{part}": (exam, part) for exam, entry in table().items() for part in entry.parts
    }


def of_grade_cells() -> dict[str, float]:
    """Return {grade_id: points} for every grade cell, those graded by hand included."""
    points = {cell: sum(of_part(*where).values()) for cell, where in grade_cells().items()}
    for entry in table().values():
        points.update(entry.manual)
    return points
