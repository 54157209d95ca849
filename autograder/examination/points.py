"""The points of all exercises: which check is worth what, in which grade cell.

Each exercise has a ``points.toml`` in its folder. It says which notebook of which assignment it is,
and lists its checks part by part: each part is one grade cell of the notebook, called
``<exercise>-<part>`` and worth the sum of its checks. Written answers are graded by hand, and stand
under ``manual`` by the grade id of their cell.

Points are for a student's own work. What the notebook passes as it is handed out is worth 0: a
check that others need, and what these earn is lost with it. The corpus runs the stubs to see it.
"""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass
from functools import cache
from importlib import resources

Parts = dict[str, dict[str, float]]


@dataclass(frozen=True)
class Entry:
    """One exercise: what it is called, where its exam is sat, and its points.

    ``parts`` maps each part to {check: points}; ``manual`` maps grade ids to points.
    """

    title: str
    assignment: str
    notebook: str
    parts: Parts
    manual: dict[str, float]


@cache
def table() -> dict[str, Entry]:
    """Return {exercise: entry}, in the order of their titles: Exercise 2 comes before 10."""
    folders = resources.files("autograder").joinpath("exercises").iterdir()
    files = {folder.name: folder.joinpath("points.toml") for folder in folders}
    entries = {
        name: _entry(tomllib.loads(file.read_text("utf-8")))
        for name, file in files.items()
        if file.is_file()
    }
    return dict(sorted(entries.items(), key=lambda named: _place(named[1])))


def _place(entry: Entry) -> tuple[str, list[int], str]:
    return entry.assignment, [int(n) for n in re.findall(r"\d+", entry.title)], entry.title


def _entry(data: dict[str, object]) -> Entry:
    parts = {
        part: {name: float(points) for name, points in entries.items()}
        for part, entries in data.items()
        if isinstance(entries, dict)
    }
    manual = parts.pop("manual", {})
    return Entry(str(data["title"]), str(data["assignment"]), str(data["notebook"]), parts, manual)


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
