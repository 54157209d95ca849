"""Extensions of students who have not handed in yet: they wait in the state of the course."""

from __future__ import annotations

import json
from pathlib import Path

from autograder.assignments.intake.handed_files.file_names import normalise_name
from autograder.util.state_table import StateTable

KIND = "extension"


class WaitingExtensions:
    """The extensions of one assignment whose students have not handed in yet.

    A student's name may come in any form of Unicode: nbgrader's own commands take it from a folder.
    """

    def __init__(self, work: Path, assignment: str) -> None:
        """Keep them in the engine's folder ``work``."""
        self._table = StateTable(work, KIND, assignment)
        self._take_over(work / "extensions" / f"{assignment}.json")

    def set_hours(self, student: str, hours: float) -> None:
        """Keep one for a student, or with 0 hours none."""
        if hours:
            self._table.put(repr(float(hours)), normalise_name(student))
        else:
            self._table.remove(normalise_name(student))

    def hours_for(self, student: str) -> float:
        """Return the hours that wait for a student; 0 if none do."""
        return float(self._table.get(normalise_name(student)) or 0)

    def _take_over(self, file: Path) -> None:
        """Keep what an earlier version of the course package has left in a file."""
        if file.exists():
            for student, hours in json.loads(file.read_text(encoding="utf-8")).items():
                self.set_hours(student, hours)
            file.unlink()
