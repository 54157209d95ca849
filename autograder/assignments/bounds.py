"""How much a notebook may hold: more than anybody writes, and less than what stops the grader."""

from __future__ import annotations

import json
from typing import Any

from nbformat import NotebookNode

MAX_CELLS = 1000
"""Cells of a notebook; one of the course has some thirty."""

MAX_CODE_BYTES = 1024 * 1024
"""Bytes of all its code, as it travels; one of the course has 20 kB. A subject takes twice that."""

MAX_OUTPUTS, MAX_PARTS = 1000, 30_000
"""Outputs of all cells, and entries of all objects and lists; one of the course has 30 and 1000.

Whether they follow the notebook format takes time for each, and much more if they do not.
"""

MAX_TAGS = 100
"""Tags of a cell: that they differ is found out by comparing each with each."""

MAX_NESTING = 100
"""Levels of lists and objects in its JSON: with a plot among its outputs it has some twenty."""


def is_too_deep(data: Any) -> bool:
    """Whether lists and objects are nested deeper than what copies or writes them can go."""
    level = [data]
    for _ in range(MAX_NESTING):
        inner = (
            item for node in level for item in (node.values() if isinstance(node, dict) else node)
        )
        level = [item for item in inner if isinstance(item, (dict, list))]
        if not level:
            return False
    return True


def excess_of_parts(data: dict[str, Any]) -> str:
    """Say what a notebook's JSON has too much of to look at it closely.

    It does so as `excess_of_notebook` does. Tags that could not be compared in time are taken out.
    """
    cells = [cell for cell in _as_list(data.get("cells")) if isinstance(cell, dict)]
    if too_many := _excess_of_cells(_as_list(data.get("cells"))):
        return too_many
    for cell in cells:
        about = cell.get("metadata")
        if not isinstance(about, dict):
            continue
        tags = _as_list(about.get("tags"))
        if len(tags) > MAX_TAGS or not all(isinstance(tag, str) for tag in tags):
            about.pop("tags")
    outputs = sum(len(_as_list(cell.get("outputs"))) for cell in cells)
    level: list[Any] = [data]
    parts = 0
    while level and parts <= MAX_PARTS:
        parts += sum(1 + len(node) if isinstance(node, dict) else 1 for node in level)
        inner = (
            item for node in level for item in (node.values() if isinstance(node, dict) else node)
        )
        level = [item for item in inner if isinstance(item, (dict, list))]
    if outputs > MAX_OUTPUTS or parts > MAX_PARTS:
        return (
            f"has more than {MAX_OUTPUTS} outputs, or more than {MAX_PARTS} entries in all its "
            "outputs, attachments and metadata: clear its outputs, or begin with a new copy of "
            "the notebook, and hand it in again."
        )
    return ""


def _as_list(value: Any) -> list[Any]:
    return value if isinstance(value, list) else []


def _excess_of_cells(cells: list[Any]) -> str:
    if len(cells) <= MAX_CELLS:
        return ""
    return (
        f"has {len(cells)} cells, more than the {MAX_CELLS} that are graded: delete "
        "those that are not needed, and hand it in again."
    )


def excess_of_notebook(notebook: NotebookNode) -> str:
    """Say what there is too much of in a notebook, and what to do; empty if there is not."""
    if too_many := _excess_of_cells(notebook.cells):
        return too_many
    sources = [cell.source for cell in notebook.cells if cell.cell_type == "code"]
    size = len(json.dumps(sources, ensure_ascii=False).encode())
    if size > MAX_CODE_BYTES:
        return (
            f"has {size / 2**20:.1f} MB of code, more than the {MAX_CODE_BYTES // 2**20} MB that "
            "are run: put data into a file beside it, and hand in both."
        )
    return ""
