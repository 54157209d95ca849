"""Tests that a machine cannot run: left out with the reason, but never in CI."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests import machine

PROBLEM = "Only root can act for several Unix users."
TESTS = f"""
import pytest

@pytest.fixture
def users():
    raise AssertionError("made without need")

@pytest.mark.needs({PROBLEM!r})
def test_of_users(users):
    pass

@pytest.mark.needs("")
def test_of_what_is_there():
    pass
"""


def run(folder: Path, ci: str) -> subprocess.CompletedProcess[str]:
    tests = folder / "test_needs.py"
    tests.write_text(TESTS)
    command = [
        sys.executable, "-m", "pytest", "-p", "tests.conftest", "-p", "no:cacheprovider", "-ra",
        f"--rootdir={folder}", str(tests),
    ]  # fmt: skip
    return subprocess.run(
        command, cwd=Path(__file__).parents[1], env={**os.environ, "CI": ci}, text=True,
        capture_output=True, timeout=120, check=False,
    )  # fmt: skip


def test_what_a_machine_cannot_run_is_left_out_with_the_reason(tmp_path: Path) -> None:
    ran = run(tmp_path, ci="")
    assert ran.returncode == 0, ran.stdout
    assert "1 passed, 1 skipped" in ran.stdout
    assert PROBLEM in ran.stdout


def test_what_a_machine_cannot_run_fails_in_ci_with_the_reason(tmp_path: Path) -> None:
    ran = run(tmp_path, ci="true")
    assert ran.returncode == 1, ran.stdout
    assert "1 passed, 1 error" in ran.stdout
    assert PROBLEM in ran.stdout


@pytest.mark.parametrize("name", [name for name in dir(machine) if name.startswith("needs_")])
def test_all_that_a_test_may_need_of_a_machine_goes_by_this_rule(name: str) -> None:
    assert getattr(machine, name).name == "needs"
