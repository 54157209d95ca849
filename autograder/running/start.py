"""Starting the examiner and talking to it, for both callers: a student's kernel and the engine."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

from autograder.examination import points
from autograder.examination.draws import fresh_seed
from autograder.examination.subject import hang_report
from autograder.examination.verdict import Verdict, VerdictError
from autograder.processes import python_module
from autograder.processes.channel import parse_line
from autograder.processes.descriptors import readable_descriptors
from autograder.processes.fair_deadline import FairDeadline, of_process
from course.errors import CourseError
from course.runtime.waiting import Deadline

if TYPE_CHECKING:  # a student's kernel has no use for sandboxes
    from autograder.sandbox.isolation import StartedProcess

MAX_ANSWER_BYTES = 1024 * 1024
EXAM_TIMEOUT_S = 360.0
"""Seconds one part of an exam may take in all: its own deadlines end it before.

They are `check_context.ALL_REPLIES_TIMEOUT_S` for replies and `exam.SITTING_S` for all.
"""

MAX_HANGS = 1000
"""Characters of the sentence that says why a subject cannot be expected to go on."""

MOST_REQUESTS = 500
"""What an examiner may ask for before it gives a verdict: exams come to 20, programs included."""

LAST_WORDS, LAST_LINE = 65536, 1000
"""Bytes that are kept of what an examiner says on standard error, and characters that are told."""

Answering = Callable[[dict[str, Any]], dict[str, Any]]
"""Answers a request of an examiner's, as JSON knows it."""

Spawn = Callable[..., "StartedProcess"]


class ExaminerError(CourseError):
    """The examiner process failed; it is never the student's fault."""


class ExaminerFloodedError(ExaminerError):
    """The examiner ran out of memory under what it was sent: that is the subject's doing."""


class ExaminerProcess:
    """A running examiner, bound to one subject by a control channel.

    ``hangs`` says in a sentence that the subject did not answer in time, if a verdict came with it.
    """

    def __init__(
        self,
        control: socket.socket,
        domain_id: int,
        *,
        env: Mapping[str, str] | None = None,
        spawn: Spawn = subprocess.Popen,
        course: Path | None = None,
    ) -> None:
        """Start the process.

        Args:
            control: its end of the channel to the subject; closed here.
            domain_id: the subject's domain.
            env: its environment; this process's if left out.
            spawn: starts it, as `subprocess.Popen` does.
            course: a course root, as it sees it, that has exams which the package has not.
        """
        command = [
            *python_module.command("autograder.running.examiner"),
            "--control", str(control.fileno()), "--domain", str(domain_id),
            *(["--course", str(course)] if course else []),
        ]  # fmt: skip
        try:
            # What the examiner's libraries print on stderr must never reach a graded cell.
            self._process = spawn(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                pass_fds=[control.fileno()],
                start_new_session=True,
                env=dict(os.environ if env is None else env),
            )
        finally:
            control.close()
        self._buffer = b""
        self._asked: deque[tuple[str, str]] = deque()
        self._said, self._mute = b"", False
        self.hangs = ""

    def request(
        self,
        exam: str,
        parts: Sequence[tuple[str, Mapping[str, Any]]],
        *,
        pid: int,
        seed: int | None = None,
        last: bool = False,
        follows: bool = False,
    ) -> None:
        """Ask for parts of an exam; their verdicts come one by one with `verdict`.

        Args:
            exam: the exam's name.
            parts: the name of each, and the answer key of its cell, if it has one.
            pid: the subject's process, for an examiner that looks at it itself.
            seed: what the exam's numbers are drawn from; one that nobody knows if left out.
            last: nothing of the notebook runs after it, so in a sandbox nothing is taken down.
            follows: the subject's server is told of each check before it is made.
        """
        self._asked = deque((exam, part) for part, _ in parts)
        self._send_message(
            {
                "exam": exam,
                "parts": [[part, dict(key)] for part, key in parts],
                "pid": pid,
                "seed": fresh_seed() if seed is None else seed,
                "last": last,
                "follows": follows,
            }
        )

    def verdict(
        self, timeout: float = EXAM_TIMEOUT_S, answer_with: Answering | None = None
    ) -> Verdict:
        """Return the verdict of the next part that was asked for.

        ``answer_with`` answers what the examiner asks for meanwhile (see `program_host`).

        Raises:
            ExaminerError: the examiner ended, took longer than ``timeout`` seconds, asked for too
                much, or wrote what is no verdict.
        """
        deadline = FairDeadline(timeout, of_process(self._process.pid))
        for _ in range(MOST_REQUESTS):
            line = self._read_line(deadline, timeout)
            try:
                answer = parse_line(line)
                if not isinstance(answer, dict):
                    raise TypeError("it is no JSON object")
                if answer_with is None or "wants" not in answer:
                    return self._verdict_of(answer)
            except (ValueError, LookupError, TypeError, RecursionError, VerdictError) as error:
                said = str(error)[:LAST_LINE]
                raise ExaminerError(f"What the examiner wrote is no verdict: {said}") from None
            self._send_message(answer_with(answer))
            if not deadline.seconds_left:
                raise self._late_error(timeout)
        raise ExaminerError(f"The examiner asked {MOST_REQUESTS} times, and gave no verdict.")

    def _read_line(self, deadline: FairDeadline, timeout: float) -> bytes:
        assert self._process.stdout is not None
        stream = self._process.stdout.fileno()
        while b"\n" not in self._buffer:
            if self._buffer and not deadline.seconds_left:
                raise self._late_error(timeout)
            if stream not in self._wait_readable(deadline.seconds_left):
                if deadline.seconds_left:
                    continue
                raise self._late_error(timeout)
            chunk = os.read(stream, 65536)
            if not chunk or len(self._buffer) > MAX_ANSWER_BYTES:
                raise self._ended_error("The examiner ended without a verdict")
            self._buffer += chunk
        line, self._buffer = self._buffer.split(b"\n", 1)
        return line

    def _late_error(self, timeout: float) -> ExaminerError:
        return ExaminerError(
            f"The examiner gave no verdict within {timeout:.0f} s{self._describe_place()}."
        )

    def _verdict_of(self, answer: dict[str, Any]) -> Verdict:
        self.hangs = str(answer["hangs"])[:MAX_HANGS]
        verdict = Verdict.from_data(answer["verdict"])
        asked = self._asked.popleft()
        verdict.require_asked(*asked, points.of_part(*asked))
        return verdict

    def _send_message(self, message: dict[str, Any]) -> None:
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(json.dumps(message).encode() + b"\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            raise self._ended_error("The examiner ended at once") from None

    def _wait_readable(self, timeout: float) -> list[int]:
        """Return which of its streams can be read, and take what is said on standard error.

        A student's nodes can have its libraries warn for ever; it must not wait for a reader.
        """
        assert self._process.stdout is not None
        assert self._process.stderr is not None
        errors_too = [] if self._mute else [self._process.stderr]
        ready = readable_descriptors([self._process.stdout, *errors_too], timeout)
        if (errors := self._process.stderr.fileno()) in ready:
            said = os.read(errors, 65536)
            self._mute = not said
            self._said = (self._said + said)[-LAST_WORDS:]
        return ready

    def _describe_place(self) -> str:
        """Return where it is stuck, to help find the mistake; empty if it does not say."""
        self._said = b""
        with suppress(ProcessLookupError, PermissionError):
            os.kill(self._process.pid, hang_report.ASK)
        assert self._process.stdout is not None
        deadline = Deadline(hang_report.PATIENCE)
        frames: list[hang_report.Frame] = []
        while not frames and not self._mute and deadline.seconds_left:
            if self._process.stdout.fileno() in self._wait_readable(deadline.seconds_left):
                break  # it is not stuck any more, or has ended: it says no more
            frames = hang_report.of_first_thread(
                self._said.decode(errors="replace"), hang_report.EXAMINER
            )
        return f" ({hang_report.describe_frames(frames)})" if frames else ""

    def _ended_error(self, when: str) -> ExaminerError:
        self._kill_process()
        assert self._process.stderr is not None
        while self._process.stderr.fileno() in self._wait_readable(0.0):
            pass
        if b"bad_alloc" in self._said or b"MemoryError" in self._said:
            return ExaminerFloodedError(
                f"{when}: it ran out of memory, as under a flood of messages. Do your nodes send "
                "more than anybody can read?"
            )
        return ExaminerError(f"{when}: {self._last_words()}")

    def _last_words(self) -> str:
        lines = self._said.decode(errors="replace").strip().splitlines()
        return lines[-1][:LAST_LINE] if lines else f"exit code {self._process.returncode}"

    def _kill_process(self) -> None:
        if self._process.poll() is None:
            # One that has only just been forked does not lead a group yet, nor has it any members.
            with suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGKILL)
            self._process.kill()
        self._process.wait()

    def __enter__(self) -> ExaminerProcess:
        """Return itself; leaving the block ends the process."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Let the process end by itself, or end it if it does not."""
        assert self._process.stdin is not None
        try:
            self._process.stdin.close()
            self._process.wait(timeout=5 if error is None else 0)
        except (subprocess.TimeoutExpired, BrokenPipeError):
            self._kill_process()
        for stream in (self._process.stdout, self._process.stderr):
            if stream is not None:
                stream.close()
