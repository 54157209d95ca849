"""What nbgrader needs of an assignment's cells, checked before nbgrader stumbles over it.

nbgrader reports most of these mistakes late, and without the cell's name.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from nbformat import NotebookNode
from nbgrader.nbgraderformat import (
    MetadataValidator,
    SchemaTooNewError,
    SchemaTooOldError,
    ValidationError,
)

from autograder.assignments.submission import grade_id, nbgrader_metadata
from course.errors import CourseError

MARKERS = ("SOLUTION", "HIDDEN TESTS", "MARK SCHEME")
"""What may stand between ``### BEGIN ...`` and ``### END ...`` and is cut out of a release."""

_GRADE_ID = re.compile(r"[A-Za-z0-9_-]{1,64}")
_MARKER = re.compile(rf"(BEGIN|END) ({'|'.join(MARKERS)})")


class AssignmentBuildError(CourseError):
    """A text source that makes no sound notebook; the message names the file and the cell."""


def fill_points(notebook: NotebookNode, points: Mapping[str, float]) -> None:
    """Enter the points of every grade cell that ``points`` knows by its grade id."""
    for cell in notebook.cells:
        data = nbgrader_metadata(cell)
        if data.get("grade") and grade_id(cell) in points:
            worth = float(points[grade_id(cell)])
            data["points"] = int(worth) if worth.is_integer() else worth


def validate_assignment(notebook: NotebookNode, name: str) -> None:
    """Return if nbgrader can work with every cell of an assignment.

    Raises:
        AssignmentBuildError: it cannot; names the assignment (``name``) and the cell.
    """
    seen: set[str] = set()
    for number, cell in enumerate(notebook.cells, start=1):
        where = f"{name}, cell {number}" + (f" '{grade_id(cell)}'" if grade_id(cell) else "")
        _validate_cell(cell, where)
        if grade_id(cell) in seen:
            raise AssignmentBuildError(
                f"{where}: the grade_id is used twice, and nbgrader needs it unique."
            )
        seen |= {grade_id(cell)} - {""}
        for problem in _marker_problems(cell):
            raise AssignmentBuildError(f"{where}: {problem}")
    if not any(nbgrader_metadata(cell).get("grade") for cell in notebook.cells):
        raise AssignmentBuildError(f"{name} has no grade cell: nothing in it would be graded.")


def marked_lines(source: str) -> Iterator[tuple[str, str]]:
    """Yield (marker, line) for each line of a cell; the marker is "" outside of every region.

    The lines that carry the markers themselves are left out.
    """
    inside = ""
    for line in source.splitlines():
        if found := _MARKER.search(line):
            inside = found[2] if found[1] == "BEGIN" else ""
        else:
            yield inside, line


def without_hidden(source: str) -> str:
    """Return a cell's text as a release has it: without the lines of its hidden tests."""
    kept = [line for marker, line in marked_lines(source) if marker != "HIDDEN TESTS"]
    return "\n".join(kept).strip("\n")


def without_markers(source: str) -> str:
    """Return a cell's whole text, solution included, without the lines that carry markers."""
    return "\n".join(line for _, line in marked_lines(source))


def has_marker(source: str) -> bool:
    """Whether a line of a cell begins or ends a region that a release must not hold."""
    return _MARKER.search(source) is not None


def _validate_cell(cell: NotebookNode, where: str) -> None:
    if "nbgrader" not in cell.metadata:
        return
    data = nbgrader_metadata(cell)
    if data.get("grade") and not data.get("points"):
        raise AssignmentBuildError(
            f"{where}: a grade cell without points; add it to the points.toml of its exercise or "
            'write "points" into its metadata.'
        )
    if any(data.get(key) for key in ("grade", "solution", "locked")) and not _GRADE_ID.fullmatch(
        grade_id(cell)
    ):
        raise AssignmentBuildError(
            f"{where}: a grade_id has 1 to 64 letters, digits, '-' and '_', not {grade_id(cell)!r}."
        )
    try:
        MetadataValidator().validate_cell(cell)
    except ValidationError as error:
        raise AssignmentBuildError(
            f"{where}: nbgrader refuses the metadata, {error.message}."
        ) from error
    except (SchemaTooOldError, SchemaTooNewError, KeyError) as error:
        raise AssignmentBuildError(f"{where}: nbgrader refuses the metadata, {error}.") from error


def _marker_problems(cell: NotebookNode) -> Iterator[str]:
    data = nbgrader_metadata(cell)
    inside = ""
    for line in cell.source.splitlines():
        found = _MARKER.search(line)
        if found is None:
            continue
        word, marker = found[1], found[2]
        if (word == "BEGIN") == bool(inside) or (inside and inside != marker):
            yield f"'{line.strip()}' does not pair up with the marker before it."
        inside = marker if word == "BEGIN" else ""
        if marker == "SOLUTION" and not data.get("solution"):
            yield 'a solution in a cell whose metadata do not say "solution": true.'
        if marker == "HIDDEN TESTS" and not data.get("grade"):
            yield 'hidden tests in a cell whose metadata do not say "grade": true.'
    if inside:
        yield f"'BEGIN {inside}' has no 'END {inside}'."
