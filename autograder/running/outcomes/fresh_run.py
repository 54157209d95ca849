"""Grading again: remember what ``--fresh`` has begun, so that a killed run can go on with it.

A mark says when such a run began, until it is complete. What was kept before the mark does not
count. What was kept since then does, also for a run that continues after a kill.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from autograder.util.state_table import StateTable

KIND = "fresh"


class FreshRun:
    """The mark of one assignment: only one engine looks at it at a time."""

    def __init__(self, work: Path, assignment: str, students: Iterable[str] = ()) -> None:
        """Keep it in the engine's folder ``work``; a run for some ``students`` has its own."""
        self._table = StateTable(work, KIND, assignment)
        self._students = sorted(students)

    @property
    def start_revision(self) -> int:
        """Revision of the state when the run started; 0 if no such run is under way."""
        return self._table.revision(*self._students)

    def begin(self) -> None:
        """Begin such a run; one that was ended before it was through goes on."""
        if not self.start_revision:
            self._table.put("", *self._students)

    def end(self) -> None:
        """It is through."""
        self._table.remove(*self._students)
