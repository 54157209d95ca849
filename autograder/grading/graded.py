"""What became of one student's submission."""

from __future__ import annotations

from dataclasses import dataclass

from autograder.running.runner import Outcome


@dataclass(frozen=True)
class Graded:
    """One student's submission, and what a person should know about it.

    Attributes:
        student: whose it is.
        outcomes: by notebook; only what `RunProgress.submission_done` is told has them, because a
            class's would fill the memory.
        points: automatic points, of ``max_points``.
        seconds: wall time that its notebooks ran.
        problem: what is wrong with it, in sentences.
        entered: False if the gradebook did not take the scores.
    """

    student: str
    outcomes: dict[str, Outcome]
    points: float = 0.0
    max_points: float = 0.0
    seconds: float = 0.0
    problem: str = ""
    entered: bool = True
