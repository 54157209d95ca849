"""Outcomes kept in the state of a course, so that what did not change is not run again."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from autograder import sandbox
from autograder.examination.program import Program
from autograder.running import grading_jobs
from autograder.running.grading_jobs import GradingJob
from autograder.running.runner import Outcome
from autograder.util.state_table import StateTable
from course.errors import CourseError

KIND = "outcome"


class StoreError(CourseError):
    """An outcome could not be kept (a full disk, say): the whole run has to stop."""


class OutcomeStore:
    """The outcomes of programs, each known by the program's digest."""

    def __init__(self, work: Path, *, trust: bool = False, hidden: Iterable[Path] = ()) -> None:
        """Keep outcomes in the engine's folder ``work``, made when the first one is written.

        ``trust`` and ``hidden`` are those of `runner.run`.
        """
        self._work, self._table = work, StateTable(work, KIND)
        self._trust, self._hidden = trust, tuple(hidden)

    def get_or_run(self, program: Program, files: Mapping[str, bytes]) -> Outcome:
        """Return a program's outcome: the one that is kept, or else a new one.

        Raises:
            SandboxError: a new one is needed, and there is no sandbox to run an untrusted program.
            StoreError: the new one could not be kept.
        """
        kept = self.get(program, files)
        if kept is not None:
            return kept
        result = grading_jobs.run(GradingJob(program, files, self._trust), self._hidden)
        self.put(program, files, result.outcome)
        return result.outcome

    def get(self, program: Program, files: Mapping[str, bytes], mode: str = "") -> Outcome | None:
        """Return the outcome of an equal program under equal exams, if there is a sound one.

        ``mode`` is the one in which it was run; that of this machine if left out.
        """
        return self.get_by_key(self.outcome_key(program, files, mode))

    def get_by_key(self, key: str, since: int = 0) -> Outcome | None:
        """Return the outcome whose key is ``key``, if there is a sound one from after ``since``.

        ``since`` is a revision of the state (see `autograder.util.state_table`).
        """
        text = self._table.get(key, since=since)
        if text is None:
            return None
        try:
            return Outcome.from_json(text)
        except (ValueError, KeyError, TypeError, AttributeError, CourseError):
            return None  # of another version

    def put(
        self, program: Program, files: Mapping[str, bytes], outcome: Outcome, mode: str = ""
    ) -> None:
        """Keep an outcome; one that a grader error spoilt is not kept.

        Raises:
            StoreError: it cannot be written (a full disk, say).
        """
        if outcome.has_grader_error:
            return
        try:
            self._table.put(outcome.to_json(), self.outcome_key(program, files, mode))
        except OSError as error:
            raise StoreError(
                f"The outcome of a submission could not be written to {self._work} "
                f"({error.strerror}): make room there and run the same command again; what was "
                "graded so far is kept."
            ) from error

    def outcome_key(self, program: Program, files: Mapping[str, bytes], mode: str = "") -> str:
        """Return the name under which a program's outcome is kept."""
        # What a sandbox or its lossy network finds is not found without.
        mode = mode or sandbox.abilities().mode_name(trust=self._trust)
        return GradingJob(program, files, self._trust).outcome_key(mode)
