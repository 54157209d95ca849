"""Answer keys: where a question has one right choice, its key stands in a hidden cell.

The hidden cell of the source notebook says ``check("patterns", part="choices", key={...})``. A
release has no such line, and a subject never runs it: the key is read here and given to the
examiner.
"""

from __future__ import annotations

import ast
from typing import Any

from course.errors import CourseError


class KeyCellError(CourseError):
    """A hidden cell whose key is not plain data; the message says what it must be."""


def of_cell(source: str) -> dict[str, Any]:
    """Return the ``key`` of the first ``check(..., key=...)`` in a cell; empty without one.

    Raises:
        KeyCellError: the key is not a dictionary of plain data.
    """
    try:
        calls = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Call)]
    except SyntaxError:
        return {}
    given = [keyword.value for call in calls for keyword in call.keywords if keyword.arg == "key"]
    if not given:
        return {}
    try:
        key = ast.literal_eval(given[0])
    except ValueError:
        key = None
    if not isinstance(key, dict):
        raise KeyCellError(
            "The key of a check must be written out as a dictionary of plain data, so that it can "
            "be read without running the cell."
        )
    return key
