"""A forked process, for the process that asked: like `subprocess.Popen`, but not its child."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import threading
from contextlib import suppress
from typing import IO, Any

from autograder.processes.descriptors import readable_descriptors
from course.errors import CourseError

FORK_TIMEOUT_S = 60.0
"""Seconds until a fork must have been made; it takes some milliseconds."""


class ZygoteError(CourseError):
    """A warm start failed; the message says what refused."""


class ForkedProcess:
    """A process that a zygote has forked. Its streams are pipes to it, or None."""

    def __init__(self, report: socket.socket, what: str) -> None:
        """Wait until the process is there, and take ownership of ``report``.

        Raises:
            ZygoteError: there is none: the machine refuses, or the zygote has ended.
        """
        self._report = report
        self._what = what
        self._ending = threading.Lock()  # the thread that waits closes its handle
        self.returncode: int | None = None
        self.stdin: IO[bytes] | None = None
        self.stdout: IO[bytes] | None = None
        self.stderr: IO[bytes] | None = None
        report.settimeout(FORK_TIMEOUT_S)
        try:
            text, handles, _, _ = socket.recv_fds(report, 4096, 1)
        except OSError as error:
            report.close()
            raise ZygoteError(f"{what} could not be forked ({error})") from error
        said: dict[str, Any] = json.loads(text) if text else {"error": "its zygote has ended"}
        if "error" in said:
            report.close()
            raise ZygoteError(f"{what} could not be forked ({said['error']})")
        self.pid = int(said["pid"])
        self._handle = handles[0]

    def poll(self) -> int | None:
        """Return how the process ended, as `subprocess.Popen.poll` does; None if it has not."""
        with suppress(subprocess.TimeoutExpired):
            self.wait(0)
        return self.returncode

    def wait(self, timeout: float | None = None) -> int:
        """Return how the process ended; a negative number is that of a signal.

        Raises:
            subprocess.TimeoutExpired: it has not ended within ``timeout`` seconds.
        """
        if self.returncode is None:
            if not readable_descriptors([self._report], timeout):
                raise subprocess.TimeoutExpired(self._what, timeout or 0.0)
            text = self._report.recv(4096)
            # Without its keeper, which only the machine itself can have ended, nobody knows.
            self._release_handle(int(json.loads(text)["code"]) if text else -signal.SIGKILL)
        assert self.returncode is not None
        return self.returncode

    def kill(self) -> None:
        """Kill the process, if it has not ended."""
        with self._ending:
            if self.returncode is None:
                with suppress(ProcessLookupError):
                    signal.pidfd_send_signal(self._handle, signal.SIGKILL)

    def _release_handle(self, code: int) -> None:
        with self._ending:
            self.returncode = code
            os.close(self._handle)
        self._report.close()


def pipe_in() -> tuple[int, IO[bytes]]:
    """Return a descriptor to read from, for a process, and what it reads is written to."""
    read, write = os.pipe()
    return read, os.fdopen(write, "wb")


def pipe_out() -> tuple[int, IO[bytes]]:
    """Return a descriptor to write to, for a process, and what it writes is read from."""
    read, write = os.pipe()
    return write, os.fdopen(read, "rb")
