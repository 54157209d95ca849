"""Outcomes kept on disk, so that what did not change is not run again."""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path

from autograder import runner
from autograder.runner import Outcome
from autograder.sandbox import abilities
from autograder.submission import Program, digest
from course.errors import CourseError


class StoreError(CourseError):
    """An outcome could not be kept (a full disk, say): the whole run has to stop."""


@cache
def exam_salt() -> str:
    """Return a digest of everything that decides a verdict beside the submission itself."""
    state = hashlib.sha256()
    for file in sorted(_sources(resources.files("autograder")), key=lambda f: f.name):
        state.update(file.name.encode() + b"\0" + file.read_bytes())
    return state.hexdigest()


def _sources(folder: Traversable) -> Iterator[Traversable]:
    for entry in folder.iterdir():
        if entry.is_dir():
            yield from _sources(entry)
        elif entry.name.endswith((".py", ".toml", ".xml")):
            yield entry


class OutcomeStore:
    """A folder of outcomes, one file a program, named by the program's digest."""

    def __init__(self, folder: Path, *, trust: bool = False, hidden: Iterable[Path] = ()) -> None:
        """Keep outcomes in ``folder``, which is made when the first one is written.

        ``trust`` and ``hidden`` are those of `runner.run`.
        """
        self._folder = folder
        self._trust, self._hidden = trust, tuple(hidden)

    def outcome(
        self, program: Program, files: Mapping[str, bytes], *, fresh: bool = False
    ) -> Outcome:
        """Return a program's outcome: the one that is kept, or else (or if ``fresh``) a new one.

        Raises:
            SandboxError: a new one is needed, and there is no sandbox to run an untrusted program.
            StoreError: the new one could not be kept.
        """
        kept = None if fresh else self.get(program, files)
        if kept is not None:
            return kept
        outcome = runner.run(program, files, trust=self._trust, hidden=self._hidden)
        self.put(program, files, outcome)
        return outcome

    def get(self, program: Program, files: Mapping[str, bytes]) -> Outcome | None:
        """Return the outcome of an equal program under equal exams, if there is a sound one."""
        try:
            return Outcome.from_json(self._path(program, files).read_text(encoding="utf-8"))
        except (OSError, ValueError, KeyError, TypeError, CourseError):
            return None

    def put(self, program: Program, files: Mapping[str, bytes], outcome: Outcome) -> None:
        """Keep an outcome; one that a grader error spoilt is not kept.

        Raises:
            StoreError: the folder cannot be written (a full disk, say).
        """
        if outcome.spoilt:
            return
        path = self._path(program, files)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            with tempfile.NamedTemporaryFile("w", dir=path.parent, delete=False) as file:
                file.write(outcome.to_json())
            os.replace(file.name, path)  # noqa: PTH105 - atomic: a reader sees all of it or none
        except OSError as error:
            raise StoreError(
                f"The outcome of a submission could not be written to {path.parent} "
                f"({error.strerror}): make room there and run the same command again; what was "
                "graded so far is kept."
            ) from error

    def _path(self, program: Program, files: Mapping[str, bytes]) -> Path:
        # What a sandbox or its lossy network finds is not found without.
        salt = f"{exam_salt()} {abilities().mode(trust=self._trust)}"
        return self._folder / f"{digest(program, files, salt)}.json"
