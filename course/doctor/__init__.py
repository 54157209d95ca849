"""What ``course doctor`` does: look at a machine, and say in plain words what is wrong with it."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Sequence

from course.doctor import environment, machine, ros, software, surroundings
from course.doctor.finding import HealthFinding, make_problem
from course.errors import CourseError

__all__ = ["HealthFinding", "examine_all", "exit_code", "summary_line"]


def examine_all() -> Iterator[HealthFinding]:
    """Yield what is found on this machine, each as soon as it is known. Takes about 3 s."""
    parts = (
        software.examine_software,
        lambda: environment.examine_environment(os.environ, sys.prefix),
        surroundings.examine_surroundings,
        machine.examine_machine,
        ros.examine_ros,
    )
    for part in parts:
        try:
            yield from part()
        except (CourseError, OSError) as error:
            yield make_problem("doctor", f"A check could not be finished: {error}")


def exit_code(findings: Sequence[HealthFinding]) -> int:
    """Return 1 if something must be mended before the course runs, else 0."""
    return int(any(finding.status == "problem" for finding in findings))


def summary_line(findings: Sequence[HealthFinding]) -> str:
    """Return the last line: how many problems and warnings there are."""
    problems = sum(finding.status == "problem" for finding in findings)
    warnings = sum(finding.status == "warning" for finding in findings)
    if problems:
        return f"{problems} to mend before the course can run here, and {warnings} to know about."
    if warnings:
        return f"The course runs here. {warnings} to know about."
    return "All is well: the course runs here."
