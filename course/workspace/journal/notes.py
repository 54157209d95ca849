"""Notes in the journal of the working copy which cells of a notebook have run."""

from __future__ import annotations

from typing import Any

from course.workspace.journal.journal_file import JournalError, journal_here


class CellNotes:
    """Notes each cell of one kernel when it has run for the first time without an error."""

    def __init__(self) -> None:
        """Know of no cell yet."""
        self._noted: set[str] = set()
        self._told = False

    def note_cell(self, result: Any) -> str:
        """Note a cell by IPython's result of it; return a sentence, once, if that cannot be done.

        Outside of a working copy, and for code that is no cell of a notebook, nothing is noted.
        """
        cell = getattr(getattr(result, "info", None), "cell_id", None)
        if not isinstance(cell, str) or cell in self._noted or not getattr(result, "success", True):
            return ""
        journal = journal_here()
        if journal is None:
            return ""
        try:
            journal.record_run(cell)
        except JournalError as error:
            told, self._told = self._told, True
            return "" if told else str(error)
        self._noted.add(cell)
        return ""
