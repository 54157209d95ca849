"""Why a check was not made: what a student is told in place of a finding.

`autograder.examination.exam.Exam` decides which of these it is. A whole program that could not be
run at all has its reason from `autograder.running.runner`.
"""

from __future__ import annotations

from autograder.examination.verdict import CheckResult


def needed_check(missing: CheckResult) -> str:
    """Return that a check which this one needs has not passed."""
    title = missing.title.rstrip(".")
    if missing.status in ("grader_error", "not_examined"):
        return f"This needs “{title}”, which could not be examined here. It is not your fault."
    return f"This needs “{title}” first."


def time_was_up(sitting_s: float) -> str:
    """Return that the checks before this one took all the seconds that there are."""
    return (
        f"What was examined before this took {sitting_s:.0f} s in all: which of your callbacks "
        "takes so long for each answer?"
    )


def program_was_gone(gone: CheckResult) -> str:
    """Return that the student's program ended or hung in an earlier check, ``gone``."""
    return f"Your program hung or ended in “{gone.title.rstrip('.')}”, and was gone by then."
