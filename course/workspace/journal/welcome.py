"""The notebook that `course lab` opens first: what it shows is brought up to date before."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from course.util.files import write_text
from course.workspace.journal import progress_page
from course.workspace.journal.journal_file import Journal
from course.workspace.journal.progress import WELCOME, Progress, progress_of

TAG = "progress"
"""Tag of the cell whose output is the student's progress."""


def refresh_progress(folder: Path) -> bool:
    """Put today's progress into the first notebook of a working copy; return whether it is there.

    Nothing but the outputs of the cell tagged `TAG` is changed, and a notebook that cannot be read
    is left alone.

    Raises:
        OSError: the folder cannot be written.
    """
    path = folder / WELCOME
    try:
        notebook = json.loads(path.read_text(encoding="utf-8"))
        cells = [cell for cell in notebook["cells"] if _is_ours(cell)]
    except FileNotFoundError:
        return False
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return False  # JupyterLab says what is wrong with it
    if cells:
        outputs = [_progress_output(progress_of(Journal(folder)), folder)]
        for cell in cells:
            cell["outputs"], cell["execution_count"] = outputs, None
        write_text(path, json.dumps(notebook, ensure_ascii=False, indent=1) + "\n")
    return True


def _is_ours(cell: dict[str, Any]) -> bool:
    return cell["cell_type"] == "code" and TAG in cell.get("metadata", {}).get("tags", [])


def _progress_output(progress: Progress, folder: Path) -> dict[str, Any]:
    data = {
        "text/markdown": progress_page.render_markdown(progress, folder),
        "text/plain": repr(progress),
    }
    return {"output_type": "display_data", "data": data, "metadata": {}}
