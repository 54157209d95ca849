"""Grading anew: what ``--fresh`` has begun, so that a kill does not have it begin again.

A mark on disk says when such a run began, until it has come to its end. What was kept before the
mark does not count; what was kept since does, whoever goes on after a kill.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from pathlib import Path

from autograder.util.files import write_whole

FOLDER = "fresh"


class FreshRun:
    """The mark of one assignment: only one engine looks at it at a time."""

    def __init__(self, work: Path, assignment: str, students: Iterable[str] = ()) -> None:
        """Keep it in the engine's folder ``work``; a run for some ``students`` has its own."""
        chosen = json.dumps(sorted(students)) if students else ""
        some = f"+{hashlib.sha256(chosen.encode()).hexdigest()[:32]}" if chosen else ""
        # No assignment of nbgrader's has a plus sign in its name.
        self._path = work / FOLDER / f"{assignment}{some}"

    @property
    def began_ns(self) -> int:
        """When the run that grades anew began, as nanoseconds of a file's date; 0 if there is none.

        The file system's own clock, which is not always this machine's.
        """
        try:
            return self._path.stat().st_mtime_ns
        except FileNotFoundError:
            return 0

    def begin(self) -> None:
        """Begin such a run; one that was ended before it was through goes on."""
        if not self.began_ns:
            write_whole(self._path, "")

    def end(self) -> None:
        """It is through."""
        self._path.unlink(missing_ok=True)


def is_since(path: Path, since: int) -> bool:
    """Whether a file was written after ``since``; raises OSError if there is none."""
    return path.stat().st_mtime_ns > since
