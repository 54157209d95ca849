"""What a student has done, as plain data."""

from __future__ import annotations

import datetime
from dataclasses import dataclass, field
from pathlib import Path

from course.workspace.journal.journal_file import Checked
from course.workspace.journal.student_notebooks import Section, StudentNotebook
from quizzes.attempts.record import Attempt


@dataclass(frozen=True)
class Chapter:
    """A chapter; ``ran`` has for each of its sections how many of the cells have run."""

    notebook: StudentNotebook
    ran: tuple[int, ...]

    @property
    def done(self) -> int:
        """Cells that have run."""
        return sum(self.ran)

    @property
    def total(self) -> int:
        """Cells that there are."""
        return sum(len(section.cells) for section in self.notebook.sections)

    @property
    def unfinished_sections(self) -> tuple[Section, ...]:
        """The sections with cells that have not run."""
        pairs = zip(self.notebook.sections, self.ran, strict=True)
        return tuple(section for section, ran in pairs if ran < len(section.cells))


@dataclass(frozen=True)
class ExerciseWork:
    """An exercise: what its visible checks found when they ran last (None: never)."""

    notebook: StudentNotebook
    checked: Checked | None

    @property
    def is_done(self) -> bool:
        """Whether nothing is left that a student can do."""
        passed = self.checked is not None and not self.checked.open
        return passed and self.notebook.written == self.notebook.to_write


@dataclass(frozen=True)
class QuizTaken:
    """A quiz and its attempts, as read from the file in the notebook's folder."""

    notebook: StudentNotebook
    attempts: tuple[Attempt, ...]
    damaged: int = 0

    @property
    def best_attempt(self) -> Attempt | None:
        """The attempt with the best score, the earliest of equal ones."""
        return max(self.attempts, key=lambda a: (a.score, -a.attempt), default=None)

    @property
    def is_passed(self) -> bool:
        """Whether an attempt was passed when it was submitted."""
        return any(attempt.passed for attempt in self.attempts)


@dataclass(frozen=True)
class WorkDone:
    """What a student has done.

    Attributes:
        folder: the working copy.
        moment: when this was read.
        notices: sentences about files that could not be read.
    """

    folder: Path
    moment: datetime.datetime
    chapters: tuple[Chapter, ...] = ()
    exercises: tuple[ExerciseWork, ...] = ()
    quizzes: tuple[QuizTaken, ...] = ()
    notices: tuple[str, ...] = field(default=())
