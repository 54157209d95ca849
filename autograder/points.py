"""The table of points (``points.toml``): which check is worth what, in which grade cell."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib import resources

Parts = dict[str, dict[str, float]]


@dataclass(frozen=True)
class Entry:
    """One exam of the table: what it is called, where it is sat, and its points.

    ``parts`` maps each part to {check: points}; ``manual`` maps grade ids to points.
    """

    title: str
    assignment: str
    notebook: str
    parts: Parts
    manual: dict[str, float]


@cache
def table() -> dict[str, Entry]:
    """Return {exam: entry} as ``points.toml`` has it."""
    raw = tomllib.loads(resources.files("autograder").joinpath("points.toml").read_text("utf-8"))
    return {exam: _entry(data) for exam, data in raw.items()}


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
