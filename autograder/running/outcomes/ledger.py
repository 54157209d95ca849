"""What has been entered into the gradebook, so that it is not entered again without need.

A record says from what a student's grades were made and how they then stood in the gradebook. It
is removed before a student is entered and written afterwards, so what a kill interrupted has none.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path

from autograder.assignments.intake.handed_files.folder_digest import of_folder
from autograder.running import digests
from autograder.util.state_table import StateTable

KIND = "entered"


@dataclass(frozen=True)
class Standing:
    """How a student stands in the gradebook: digests of what was found and of what people set."""

    automatic: str
    manual: str


@dataclass(frozen=True)
class LedgerEntry:
    """A record of one student's grades.

    Attributes:
        made_of: digest of all that its grades depend on, a blank, and that of the submission.
        standing: how they stood in the gradebook afterwards.
        points: automatic points, of ``max_points``.
        seconds: wall time that the submission's notebooks ran.
        problem: what a person should know about the submission.
        feedback: whether HTML feedback was written, too.
    """

    made_of: str
    standing: Standing
    points: float
    max_points: float
    seconds: float
    problem: str
    feedback: bool

    def is_of(self, made_of: str) -> bool:
        """Whether the submission is the same, whatever became of the assignment meanwhile."""
        return self.made_of.split()[-1] == made_of.split()[-1]


class Ledger:
    """The records of one assignment."""

    def __init__(self, work: Path, assignment: str) -> None:
        """Keep them in the engine's folder ``work``."""
        self._table = StateTable(work, KIND, assignment)

    def get(self, student: str, since: int = 0) -> LedgerEntry | None:
        """Return a student's record, or None if there is no sound one from after ``since``."""
        text = self._table.get(student, since=since)
        if text is None:
            return None
        try:
            data = json.loads(text)
            return LedgerEntry(**{**data, "standing": Standing(**data["standing"])})
        except (ValueError, KeyError, TypeError):  # of another version
            return None

    def put(self, student: str, entry: LedgerEntry) -> None:
        """Keep a student's record; raises OSError if it cannot be written."""
        self._table.put(json.dumps(asdict(entry)), student)

    def remove(self, student: str) -> None:
        """Forget a student's record."""
        self._table.remove(student)


def of_course(
    root: Path, folders: Iterable[Path], mode: str, exams: tuple[str, ...], late_rule: str
) -> str:
    """Return a digest of what all students' grades depend on.

    Args:
        root: the course root, whose configuration, with what it imports from there, and quizzes
            count.
        folders: the assignment's source and release.
        mode: how submissions are run (see `autograder.sandbox.Abilities`).
        exams: sorted names of the assignment's exams.
        late_rule: digest of what is taken off for lateness (see `penalties.rule_digest`).
    """
    state = hashlib.sha256(f"{mode} {digests.of_grading(exams)} {late_rule}".encode())
    for path in (*sorted(root.glob("*.py")), root / "authoring" / "banks", *folders):
        state.update(of_folder(path).encode())
    return state.hexdigest()
