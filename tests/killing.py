"""Ends engines at random moments, starts them again, and looks whether anything was lost.

The engine is the real command on a real class. What must hold after every end: the gradebook is
whole, no process of the engine's is left, and no outcome that was kept is ever made again. In the
end the grades must be those of a run that nobody disturbed.
"""

from __future__ import annotations

import os
import random
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path

import psutil

from autograder.gradebook.course_gradebook import CourseGradebook, Grade

STATE = ".autograder/state.db"
GONE = 20.0
"""Seconds in which what a dead engine has started must be gone."""

Signal = signal.Signals


class LostError(Exception):
    """Something did not survive; the message says what."""


@dataclass
class Engine:
    """`autograder grade` on a course root, again and again."""

    root: Path
    assignment: str
    scratch: Path
    arguments: tuple[str, ...] = ()
    jobs: int = 2

    def start(self) -> subprocess.Popen[str]:
        """Start it in a process group of its own."""
        command = [
            str(Path(sys.executable).with_name("autograder")), "grade", self.assignment,
            "--root", str(self.root), "--jobs", str(self.jobs), *self.arguments,
        ]  # fmt: skip
        self.scratch.mkdir(exist_ok=True)
        return subprocess.Popen(
            command, env={**os.environ, "TMPDIR": str(self.scratch)}, start_new_session=True,
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip

    def finish(self) -> str:
        """Let it run to its end; return what it said."""
        with self.start() as process:
            said, complaint = process.communicate(timeout=600)
        if process.returncode != 0:
            raise LostError(f"exit code {process.returncode}: {said} {complaint}")
        if left := list(self.scratch.glob("ros2-course-scratch-*")):
            raise LostError(f"scratch folders are left: {left}")
        return said

    def kill(self, after: float, signum: Signal, *, group: bool) -> bool:
        """Start it and end it after so many seconds; return whether it was still at work."""
        before = self.outcomes()
        with self.start() as process:
            with suppress(subprocess.TimeoutExpired):
                process.communicate(timeout=after)
            at_work = process.poll() is None
            children = _frozen_children(process) if at_work else []
            if at_work:
                (os.killpg if group else os.kill)(process.pid, signum)
                os.killpg(process.pid, signal.SIGCONT)
            said = "".join(process.communicate(timeout=60))
        # Python's own, of an engine that has not begun yet, is none of ours.
        if "Traceback" in said and f"{os.sep}autograder{os.sep}" in said:
            raise LostError(said)
        _, alive = psutil.wait_procs(children, timeout=GONE)
        if alive:
            raise LostError(f"still running after {signum.name}: {[p.cmdline() for p in alive]}")
        self.check(before)
        return at_work

    def check(self, before: dict[str, int]) -> None:
        """Look whether the gradebook is whole, and every earlier outcome untouched."""
        with sqlite3.connect(self.root / "gradebook.db") as book:
            (verdict,) = book.execute("pragma integrity_check").fetchone()
        book.close()
        if verdict != "ok":
            raise LostError(f"the gradebook is damaged: {verdict}")
        now = self.outcomes()
        again = [name for name, mark in before.items() if now.get(name) != mark]
        if again:
            raise LostError(f"outcomes were lost or made again: {again}")

    def outcomes(self) -> dict[str, int]:
        """Return the revision of each outcome that is kept: one that is made again has another."""
        file = self.root / STATE
        if not file.exists():
            return {}
        with closing(sqlite3.connect(file, timeout=60)) as state:
            if not state.execute("SELECT 1 FROM sqlite_schema").fetchall():
                return {}
            rows = "SELECT name, revision FROM state WHERE kind = 'outcome'"
            return dict(state.execute(rows).fetchall())

    def grades(self) -> dict[str, Grade]:
        """Return what stands in the gradebook."""
        found = CourseGradebook(self.root).read_grades(self.assignment)
        return {grade.student: grade for grade in found}


def copy_outcomes(graded: Path, root: Path) -> None:
    """Let a course root have the outcomes of another, and nothing else of what was kept there."""
    (root / STATE).parent.mkdir(exist_ok=True)
    shutil.copyfile(graded / STATE, root / STATE)
    with closing(sqlite3.connect(root / STATE)) as state, state:
        state.execute("DELETE FROM state WHERE kind != 'outcome'")


def fresh_copy(course: Path, folder: Path) -> Path:
    """Return a copy of a course root, over whatever is in ``folder``."""
    shutil.rmtree(folder, ignore_errors=True)
    return Path(shutil.copytree(course, folder))


def episode(
    engine: Engine, chance: random.Random, longest: float, signals: list[Signal]
) -> list[str]:
    """End an engine once with each signal, or until it is done; return what ended it at work.

    ``kill -9`` is for the engine alone or for its whole process group, by chance.
    """
    ended: list[str] = []
    for signum in signals:
        group = signum is signal.SIGKILL and chance.random() < 0.5
        if not engine.kill(chance.uniform(0.2, longest), signum, group=group):
            break
        ended.append(f"{signum.name} of the group" if group else signum.name)
    return ended


def _frozen_children(process: subprocess.Popen[str]) -> list[psutil.Process]:
    """Stop a process group, and return all that it has started."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGSTOP)
    parent = psutil.Process(process.pid)
    deadline = time.monotonic() + 5
    while parent.status() != psutil.STATUS_STOPPED and time.monotonic() < deadline:
        os.sched_yield()
    return parent.children(recursive=True)
