"""What notebooks bring along is built once, outside, and not by each submission for itself."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.machine import needs_sandbox

PROGRAM = """
from autograder.running import runner
from autograder.examination.subject.own_interfaces import DEFINITIONS, NAVIGATE_TO
from autograder.examination.program import Cell

sources = [
    "from course.interfaces import define, status",
    "from course.interfaces.building import toolchain",
    "print(status()['example_interfaces'])",
    "toolchain.compiler_problem = lambda: 'none here'",
    "def none(*args, **more): raise AssertionError('a compiler was asked for')",
    "toolchain.subprocess.run = toolchain.subprocess.Popen = none",
    f"define({NAVIGATE_TO!r}, {DEFINITIONS[NAVIGATE_TO]!r}).__name__",
]
for output in sum(runner.run(tuple(map(Cell, sources))).outputs, []):
    print(output.get("text") or output.get("data") or output)
"""


@needs_sandbox
@pytest.mark.timeout(300)
def test_a_submission_finds_them_built_where_nothing_was_built_before(tmp_path: Path) -> None:
    run = subprocess.run(
        [sys.executable, "-c", PROGRAM], capture_output=True, text=True, timeout=280, check=False,
        env={**os.environ, "COURSE_INTERFACES_CACHE": str(tmp_path / "cache")},
    )  # fmt: skip
    assert run.stdout.split() == ["built", "{'text/plain':", "\"'NavigateTo'\"}"], run.stderr
    assert not run.stderr
