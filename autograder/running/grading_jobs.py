"""A job: one notebook of one submission to be run, here or on another machine.

A job travels as JSON, and so does what comes back: an outcome holds what a stranger's program
printed, and is data wherever it goes.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from autograder import sandbox
from autograder.examination.program import Cell, Program, program_digest
from autograder.examination.subject import outputs
from autograder.processes import descriptors
from autograder.running import digests, runner
from autograder.running.runner import Outcome
from course.errors import CourseError

MAX_OUTCOME_CHARS = 16 * 1024 * 1024
"""Largest outcome in characters; what is kept of all its cells is half of that."""


class JobError(CourseError):
    """A job that cannot be run where it is; the message says what to do."""


@dataclass(frozen=True)
class GradingJob:
    """What is to be run.

    Attributes:
        program: the cells.
        files: what is put into the folder that it runs in, by relative path.
        trust: run it outside of a sandbox.
    """

    program: Program
    files: Mapping[str, bytes]
    trust: bool = False

    @property
    def exam_names(self) -> tuple[str, ...]:
        """The exams that the program sits."""
        return tuple(sorted({cell.exam for cell in self.program if cell.exam}))

    @property
    def code_digest(self) -> str:
        """A digest of the code that decides its verdicts."""
        return digests.of_exams(self.exam_names)

    def outcome_key(self, mode: str) -> str:
        """Return the name of its outcome: equal jobs run in one ``mode`` come to the same."""
        return program_digest(self.program, self.files, f"{self.code_digest} {mode}")

    def to_json(self) -> str:
        """Return the job as JSON."""
        files = {name: base64.b64encode(content).decode() for name, content in self.files.items()}
        cells = [vars(cell) for cell in self.program]
        return json.dumps(
            {"cells": cells, "files": files, "trust": self.trust, "salt": self.code_digest}
        )

    @classmethod
    def from_json(cls, text: str) -> GradingJob:
        """Read what `to_json` wrote.

        Raises:
            JobError: the code here would decide differently from the code that sent the job.
        """
        data = json.loads(text)
        files = {name: base64.b64decode(content) for name, content in data["files"].items()}
        job = cls(tuple(Cell(**cell) for cell in data["cells"]), files, data["trust"])
        if job.code_digest != data["salt"]:
            raise JobError(
                "it has another version of ros2-course than the engine: install the same one on "
                "every machine"
            )
        return job


@dataclass(frozen=True)
class JobResult:
    """What came of a job: an outcome and the ``mode`` in which it was run (see `Abilities`)."""

    outcome: Outcome
    mode: str

    def to_json(self) -> str:
        """Return the result as JSON."""
        return json.dumps({"mode": self.mode, "outcome": self.outcome.to_json()})

    @classmethod
    def from_json(cls, text: str) -> JobResult:
        """Read what `to_json` wrote; raises ValueError, KeyError or VerdictError if it is none."""
        data = json.loads(text)
        return cls(Outcome.from_json(data["outcome"]), str(data["mode"]))


def run(job: GradingJob, hidden: Iterable[Path] = ()) -> JobResult:
    """Run a job in this process's machine, beside any number of others.

    Raises:
        SandboxError: the submission is not trusted, and there is no working sandbox here.
    """
    descriptors.allow_many()
    mode = sandbox.abilities().mode_name(trust=job.trust)
    outcome = runner.run(job.program, job.files, trust=job.trust, hidden=hidden)
    return JobResult(bounded_outcome(outcome), mode)


def bounded_outcome(outcome: Outcome) -> Outcome:
    """Return an outcome that is small enough to keep and to send: verdicts before outputs."""
    if len(outcome.to_json()) <= MAX_OUTCOME_CHARS:
        return outcome
    short = [outputs.only_error(of_cell) for of_cell in outcome.outputs]
    return replace(outcome, outputs=short, notes=[*outcome.notes, runner.TOO_MUCH])
