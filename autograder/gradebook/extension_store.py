"""Extensions of students who have not handed in yet: they wait in the engine's folder."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock

from autograder.assignments.intake.file_names import normalise_name
from autograder.util.files import write_whole

FOLDER = "extensions"


class WaitingExtensions:
    """The extensions of one assignment whose students have not handed in yet.

    A student's name may come in any form of Unicode: nbgrader's own commands take it from a folder.
    """

    def __init__(self, work: Path, assignment: str) -> None:
        """Keep them in the engine's folder ``work``."""
        self._path = work / FOLDER / f"{assignment}.json"

    def set_hours(self, student: str, hours: float) -> None:
        """Keep one for a student, or with 0 hours none."""
        with self._open_for_change() as waiting:
            waiting.pop(normalise_name(student), None)
            if hours:
                waiting[normalise_name(student)] = hours

    def hours_for(self, student: str) -> float:
        """Return the hours that wait for a student; 0 if none do."""
        if not self._path.exists():
            return 0.0
        with self._open_for_change() as waiting:
            return waiting.get(normalise_name(student), 0.0)

    @contextmanager
    def _open_for_change(self) -> Iterator[dict[str, float]]:
        self._path.parent.mkdir(parents=True, exist_ok=True)
        with FileLock(self._path.with_suffix(".lock")):
            try:
                waiting = json.loads(self._path.read_text(encoding="utf-8"))
            except FileNotFoundError:
                waiting = {}
            before = dict(waiting)
            yield waiting
            if waiting != before:
                write_whole(self._path, json.dumps(waiting))
