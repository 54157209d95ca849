"""The verdicts behind a grade, kept beside the gradebook, which holds only points.

One record of each student and notebook is written when the scores are entered, by whichever command
they come in: ``autograder grade``, ``nbgrader autograde`` or the formgrader.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from autograder.examination.verdict import Verdict
from autograder.util.state_table import StateTable
from course.errors import CourseError

KIND = "verdicts"
MAX_CHARS = 4 * 1024 * 1024
"""Longest record that is read; one of a notebook of this course has 10,000."""


class RecordError(CourseError):
    """A record that cannot be read, as one of another version."""


class RecordedOutcome(Protocol):
    """What of a run is recorded; see `autograder.running.runner.Outcome`."""

    verdicts: dict[str, Verdict]
    notes: list[str]
    seconds: float
    unreadable: bool


@dataclass(frozen=True)
class Record:
    """What came of running one notebook of one student.

    ``verdicts`` is {grade id: verdict}, ``notes`` are the remarks about the run, ``seconds`` is
    its wall time, and ``unreadable`` says that there was nothing to run at all.
    """

    verdicts: Mapping[str, Verdict]
    notes: tuple[str, ...] = ()
    seconds: float = 0.0
    unreadable: bool = False


def write_record(
    work: Path, assignment: str, student: str, notebook: str, outcome: RecordedOutcome
) -> None:
    """Write the record of an outcome in place of an earlier one; raises OSError if it cannot."""
    data = {
        "verdicts": {name: v.as_data() for name, v in outcome.verdicts.items()},
        "notes": list(outcome.notes),
        "seconds": outcome.seconds,
        "unreadable": outcome.unreadable,
    }
    StateTable(work, KIND, assignment).put(json.dumps(data), student, notebook)


def load_record(work: Path, assignment: str, student: str, notebook: str) -> Record | None:
    """Return a record, or None if there is none.

    Raises:
        RecordError: there is one, and it cannot be read.
    """
    text = StateTable(work, KIND, assignment).get(student, notebook)
    if text is None:
        return None
    try:
        if len(text) > MAX_CHARS:
            raise ValueError("too long")
        data = json.loads(text)
        seconds = float(data["seconds"])
        if not math.isfinite(seconds) or seconds < 0:
            raise ValueError(f"{seconds} s")
        verdicts = {str(name): Verdict.from_data(v) for name, v in data["verdicts"].items()}
        notes = tuple(str(note) for note in data["notes"])
        return Record(verdicts, notes, seconds, data["unreadable"] is True)
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError, CourseError):
        raise RecordError(
            f"The record of {student}'s check results for {notebook} is damaged, so it is left "
            f"out: run `autograder grade {assignment}` again to have it written anew."
        ) from None
