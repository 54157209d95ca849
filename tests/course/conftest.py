"""Fixtures for tests with real nodes: each test has its own Context on its own leased domain."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import course
from course.runtime.domains import domain_discovery


@pytest.fixture(autouse=True)
def _nobody_next_door(monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep a diagnosis from finding what another test offers, which runs at the same time."""
    monkeypatch.setattr(domain_discovery, "all_claims", tuple)


@pytest.fixture
def session() -> Iterator[course.Session]:
    """Give a session of one thread."""
    with course.Session() as opened:
        yield opened


@pytest.fixture(params=[1, 3], ids=["one thread", "three threads"])
def any_session(request: pytest.FixtureRequest) -> Iterator[course.Session]:
    """Give a session of one thread, then one of three: both must keep the same promises."""
    with course.Session(threads=request.param) as opened:
        yield opened


@pytest.fixture
def start_script(tmp_path: Path) -> Iterator[Callable[[str], subprocess.Popen[str]]]:
    """Start a Python script in a process of its own; it is killed if the test leaves it running."""
    running: list[subprocess.Popen[str]] = []

    def start(source: str) -> subprocess.Popen[str]:
        script = tmp_path / f"script_{len(running)}.py"
        script.write_text(source, encoding="utf-8")
        # The ROS wheels mark a prepared environment; a child has to prepare its own.
        environment = {
            name: value
            for name, value in os.environ.items()
            if name != "_ROS_WHEELS_BOOTSTRAP_COMPLETE"
        }
        process = subprocess.Popen(
            [sys.executable, str(script)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=environment,
        )
        running.append(process)
        return process

    yield start
    for process in running:
        if process.poll() is None:
            process.kill()
        process.communicate()
