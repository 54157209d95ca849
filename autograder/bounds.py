"""How much a notebook may hold: more than anybody writes, and less than what stops the grader."""

from __future__ import annotations

import json
from typing import Any

from nbformat import NotebookNode

MAX_CELLS = 1000
"""Cells of a notebook; one of the course has some thirty."""

MAX_CODE = 1024 * 1024
"""Bytes of all its code, as it travels; one of the course has 20 kB. A subject takes twice that."""

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


def excess(notebook: NotebookNode) -> str:
    """Say what there is too much of in a notebook, and what to do; empty if there is not."""
    if len(notebook.cells) > MAX_CELLS:
        return (
            f"has {len(notebook.cells)} cells, more than the {MAX_CELLS} that are graded: delete "
            "those that are not needed, and hand it in again."
        )
    sources = [cell.source for cell in notebook.cells if cell.cell_type == "code"]
    size = len(json.dumps(sources, ensure_ascii=False).encode())
    if size > MAX_CODE:
        return (
            f"has {size / 2**20:.1f} MB of code, more than the {MAX_CODE // 2**20} MB that are "
            "run: put data into a file beside it, and hand in both."
        )
    return ""
