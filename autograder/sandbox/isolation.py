"""What a runner needs of the isolation that a submission runs in: it starts two processes there."""

from __future__ import annotations

import socket
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Protocol, Self

from autograder.processes import python_module
from autograder.processes.fair_deadline import RunDelay

END_TIMEOUT_S = 5.0
"""Seconds in which a subject that says no more must have ended."""


class StartedProcess(Protocol):
    """A process with pipes to its standard streams: what of `subprocess.Popen` is made use of."""

    stdin: IO[bytes] | None
    stdout: IO[bytes] | None
    stderr: IO[bytes] | None
    pid: int

    @property
    def returncode(self) -> int | Any:
        """How it ended; a negative number is that of a signal; None if it has not."""

    def poll(self) -> int | None:
        """Return how it ended; None if it has not."""

    def wait(self, timeout: float | None = None) -> int:
        """Return how it ended; raises `subprocess.TimeoutExpired` if it has not in time."""

    def kill(self) -> None:
        """Kill it, if it has not ended."""


def subject_command(engine: socket.socket, control: socket.socket, domain_id: int) -> list[str]:
    """Return the command of a subject, which gets its ends of these two channels."""
    return [
        *python_module.command("autograder.examination.subject.process"),
        "--engine", str(engine.fileno()), "--control", str(control.fileno()),
        "--domain", str(domain_id),
    ]  # fmt: skip


class RunningSubject(Protocol):
    """A subject's process. Leaving its block ends it with everything it started."""

    @property
    def pid(self) -> int:
        """Its process id as seen from here; known once it has said that it is ready."""

    @property
    def delay(self) -> RunDelay:
        """For how long others have kept it from running."""

    @property
    def unwatched(self) -> bool:
        """Whether it was ended because the grader failed to watch over it."""

    def describe_excess(self, timeout: float = 0.0) -> str:
        """Return in words what it was ended for using too much of; empty if it was not.

        If it still runs, it has ``timeout`` seconds to be ended.
        """

    def ready(self) -> None:
        """Note that the subject has started and has not run any of the student's code yet."""

    def tell_warden(self) -> None:
        """Have the warden, if there is one, look at this subject from now on."""

    def explain_failure(self) -> str:
        """Return why it did not start, in words."""

    def describe_end(self, timeout: float = END_TIMEOUT_S) -> str:
        """Return in words how the process ended, or that it has not within ``timeout`` seconds."""

    def __enter__(self) -> Self:
        """Return itself."""

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """End the process and all that it started, and remove what they left."""


class Isolation(Protocol):
    """Where an examiner and a subject find each other over DDS, and nobody else does."""

    domain_id: int
    """The ROS domain of both."""

    course: Path | None
    """A course root, as the examiner sees it, that has the exams it was given."""

    def spawn(self, command: Sequence[str], **options: Any) -> StartedProcess:
        """Start the examiner; ``options`` are those of `subprocess.Popen`.

        If it does not see the subject it is told how to reach a warden.
        """

    def start_subject(
        self, command: Sequence[str], files: Mapping[str, bytes], fds: Sequence[int]
    ) -> RunningSubject:
        """Start the subject with ``files`` in its working folder and the descriptors ``fds``."""

    def __enter__(self) -> Self:
        """Return itself."""

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Give back what the isolation holds."""
