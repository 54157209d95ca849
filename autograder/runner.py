"""Grade one program: a subject runs it, an examiner watches, an outcome comes back."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from autograder import exams
from autograder.exam import unexamined
from autograder.processes import ExaminerError, ExaminerProcess
from autograder.submission import Cell, Program
from autograder.verdict import Status, Verdict
from autograder.wire import Channel, ChannelClosed, ChannelTimeout
from course.domains import lease_domain

CELL_TIMEOUT = 30.0
"""Seconds one cell of a submission may run, as in nbgrader."""


NO_FILES: Mapping[str, bytes] = {}


@dataclass
class Outcome:
    """What came of running one submission.

    ``outputs`` has one list of notebook outputs a code cell, in the program's order; ``verdicts``
    maps the grade id of an exam's cell to its verdict; ``notes`` are remarks for the student.
    ``seconds`` is wall time. ``unreadable`` says that there was nothing to run at all.
    """

    outputs: list[list[dict[str, Any]]] = field(default_factory=list)
    verdicts: dict[str, Verdict] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    seconds: float = 0.0
    unreadable: bool = False

    @property
    def needs_human(self) -> bool:
        """Whether the grader itself failed somewhere."""
        return any(verdict.needs_human for verdict in self.verdicts.values())

    def to_json(self) -> str:
        """Return the outcome as JSON."""
        verdicts = {name: json.loads(verdict.to_json()) for name, verdict in self.verdicts.items()}
        return json.dumps({**vars(self), "verdicts": verdicts}, ensure_ascii=False)

    @classmethod
    def from_json(cls, text: str) -> Outcome:
        """Read an outcome written by `to_json`; raises ValueError or VerdictError if it is none."""
        data = json.loads(text)
        verdicts = {
            name: Verdict.from_json(json.dumps(item)) for name, item in data["verdicts"].items()
        }
        return cls(data["outputs"], verdicts, data["notes"], data["seconds"], data["unreadable"])


def run(
    program: Program, files: Mapping[str, bytes] = NO_FILES, *, cell_timeout: float = CELL_TIMEOUT
) -> Outcome:
    """Run a program in a subject of its own and have its exams sat; never raises for its sake.

    ``files`` are put into the folder that it runs in, by relative path.
    """
    started = time.monotonic()
    outcome = Outcome(outputs=[[] for _ in program])
    with ExitStack() as stack:
        lease = lease_domain()
        stack.callback(lease.release)
        engine, subject_engine = socket.socketpair()
        control, subject_control = socket.socketpair()
        examiner = stack.enter_context(ExaminerProcess(control, lease.domain_id))
        subject = stack.enter_context(
            _SubjectProcess(subject_engine, subject_control, lease.domain_id, files)
        )
        channel = Channel(engine)
        stack.callback(channel.close)
        _follow(program, channel, examiner, subject, outcome, cell_timeout)
    outcome.seconds = round(time.monotonic() - started, 2)
    return outcome


def _follow(
    program: Program,
    channel: Channel,
    examiner: ExaminerProcess,
    subject: _SubjectProcess,
    outcome: Outcome,
    cell_timeout: float,
) -> None:
    """Walk through the program with the subject; on its end, account for what was not reached."""
    moved_on, number = True, 0
    try:
        channel.send({"cells": [_shown(cell) for cell in program]})
        for number, cell in enumerate(program):
            message = channel.receive(cell_timeout)
            if cell.exam:
                examiner.request(
                    cell.exam, cell.part, pid=subject.pid, moved_on=moved_on, key=cell.key
                )
                outcome.verdicts[cell.grade_id] = examiner.verdict()
                moved_on = False
            else:
                moved_on = True
                outcome.outputs[number] = _outputs(message, number)
                _note_error(outcome, number)
    except ChannelTimeout:
        _give_up(
            program,
            outcome,
            f"Code cell {number + 1} was still running after {cell_timeout:.0f} s, so nothing "
            "after it was examined: a cell that never ends (rclpy.spin, an endless loop) blocks "
            "a notebook.",
        )
    except ChannelClosed:
        _give_up(program, outcome, f"The notebook's process ended: {subject.fate()}.")
    except ExaminerError as error:
        _give_up(program, outcome, str(error), "grader_error")


def _shown(cell: Cell) -> dict[str, str]:
    """Return what a subject is told of a cell: never an answer key, nor which part comes."""
    return {"source": "" if cell.exam else cell.source, "exam": cell.exam}


def _outputs(message: dict[str, Any], number: int) -> list[dict[str, Any]]:
    outputs = message.get("outputs")
    if message.get("ran") != number or not isinstance(outputs, list):
        raise ChannelClosed("the subject broke the protocol")
    return outputs


def _note_error(outcome: Outcome, number: int) -> None:
    for output in outcome.outputs[number]:
        if isinstance(output, dict) and output.get("output_type") == "error":
            what = f"{output.get('ename')}: {output.get('evalue')}"
            outcome.notes.append(f"Code cell {number + 1} of the notebook raised {what[:300]}")


def _give_up(
    program: Program, outcome: Outcome, reason: str, status: Status = "not_checked"
) -> None:
    outcome.notes.append(reason)
    for cell in program:
        if cell.exam and cell.grade_id not in outcome.verdicts:
            exam = exams.load(cell.exam)
            outcome.verdicts[cell.grade_id] = unexamined(exam, cell.part, reason, status)


def refuse(program: Program, reason: str, status: Status = "not_checked") -> Outcome:
    """Return the outcome of a program that is not run at all, for ``reason``."""
    outcome = Outcome(outputs=[[] for _ in program], unreadable=True)
    _give_up(program, outcome, reason, status)
    return outcome


def with_notes(outcome: Outcome, notes: list[str]) -> Outcome:
    """Return an outcome whose verdicts carry ``notes`` for the student, too."""
    said = (*notes, *outcome.notes)
    verdicts = {name: replace(v, notes=(*v.notes, *said)) for name, v in outcome.verdicts.items()}
    return replace(outcome, verdicts=verdicts)


class _SubjectProcess:
    """A running subject: started in a session of its own, and ended with all it started."""

    def __init__(
        self,
        engine: socket.socket,
        control: socket.socket,
        domain_id: int,
        files: Mapping[str, bytes],
    ) -> None:
        # What a subject leaves there that cannot be removed is no reason to stop.
        self._home = tempfile.TemporaryDirectory(
            prefix="ros2-course-subject-", ignore_cleanup_errors=True
        )
        home = self._home.name
        for name, content in files.items():
            path = Path(home) / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        cache = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
        env = {
            **os.environ, "HOME": home, "XDG_CACHE_HOME": cache, "IPYTHONDIR": f"{home}/.ipython",
            "ROS_LOG_DIR": f"{home}/log", "MPLBACKEND": "Agg",
        }  # fmt: skip
        command = [
            sys.executable, "-m", "autograder.subject", "--engine", str(engine.fileno()),
            "--control", str(control.fileno()), "--domain", str(domain_id),
        ]  # fmt: skip
        self._process = subprocess.Popen(
            command, cwd=home, env=env, start_new_session=True,
            pass_fds=[engine.fileno(), control.fileno()],
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        engine.close()
        control.close()
        self.pid = self._process.pid

    def fate(self) -> str:
        """Return how the process ended, in words."""
        with suppress(subprocess.TimeoutExpired):
            code = self._process.wait(timeout=5)
            if code >= 0:
                return f"exit code {code}"
            return f"killed by {signal.Signals(-code).name}"
        return "it closed its connection to the grader"

    def __enter__(self) -> _SubjectProcess:
        return self

    def __exit__(self, *_: object) -> None:
        # A process that is killed cannot remove its DDS shared memory, so it is removed for it.
        segments = _shared_memory(self._process.pid)
        with suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
        for segment in segments:
            segment.unlink(missing_ok=True)
        self._home.cleanup()


def _shared_memory(pid: int) -> set[Path]:
    try:
        maps = Path(f"/proc/{pid}/maps").read_text()
    except OSError:
        return set()
    paths = (
        line.split(maxsplit=5)[-1] for line in maps.splitlines() if "/dev/shm/fastrtps_" in line
    )
    return {Path(path) for path in paths}
