"""A cache for the whole run, in which example_interfaces is built once, and Python processes."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from course.interfaces.building.toolchain import compiler_problem
from tests.left_out import leave_out

DEADLINE = 120.0  # seconds; only a hung process reaches it

Python = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def environment(tmp_path: Path) -> dict[str, str]:
    """The environment for a process of its own: an empty cache, logs in the test's folder."""
    return {
        **os.environ,
        "COURSE_INTERFACES_CACHE": str(tmp_path / "cache"),
        "ROS_LOG_DIR": str(tmp_path / "log"),
    }


@pytest.fixture
def python(environment: dict[str, str], tmp_path: Path) -> Python:
    """Run code in a new Python; the code begins with the import hook installed."""

    def run(code: str, **changes: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-c", "from course import interfaces; interfaces.install()\n" + code],
            env={**environment, **changes},
            cwd=tmp_path,
            capture_output=True,
            text=True,
            timeout=DEADLINE,
            check=False,
        )

    return run


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cache in which example_interfaces is built, by the command that a grader runs."""
    if problem := compiler_problem():
        leave_out(problem)
    cache = tmp_path_factory.mktemp("interfaces")
    done = subprocess.run(
        [sys.executable, "-m", "course.interfaces"],
        env={**os.environ, "COURSE_INTERFACES_CACHE": str(cache)},
        capture_output=True,
        text=True,
        timeout=DEADLINE,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == f"example_interfaces: built, in {cache}\n"
    assert done.stderr == ""
    return cache


@pytest.fixture
def here(built: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let this process define and import interfaces, with the shared cache."""
    from course import interfaces

    monkeypatch.setenv("COURSE_INTERFACES_CACHE", str(built))
    interfaces.install()
