"""The table of points (``points.toml``): which check is worth what, in which grade cell."""

from __future__ import annotations

import tomllib
from functools import cache
from importlib import resources

Table = dict[str, dict[str, dict[str, float]]]


@cache
def table() -> Table:
    """Return {exam: {part: {check or manual grade id: points}}} as ``points.toml`` has it."""
    raw = tomllib.loads(resources.files("autograder").joinpath("points.toml").read_text("utf-8"))
    return {
        exam: {
            part: {name: float(points) for name, points in entries.items()}
            for part, entries in parts.items()
            if isinstance(entries, dict)
        }
        for exam, parts in raw.items()
    }


def of_part(exam: str, part: str) -> dict[str, float]:
    """Return {check: points} of one part of an exam; empty if there is no such part."""
    return table().get(exam, {}).get(part, {})


def grade_cells() -> dict[str, tuple[str, str]]:
    """Return {grade_id: (exam, part)} for every grade cell that an exam fills."""
    return {
        f"{exam}-{part}": (exam, part)
        for exam, parts in table().items()
        for part in parts
        if part != "manual"
    }


def of_grade_cells() -> dict[str, float]:
    """Return {grade_id: points} for every grade cell, those graded by hand included."""
    points = {cell: sum(of_part(*where).values()) for cell, where in grade_cells().items()}
    for parts in table().values():
        points.update(parts.get("manual", {}))
    return points
