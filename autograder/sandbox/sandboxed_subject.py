"""A subject that runs in a sandbox, as the process that started it sees it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
from collections.abc import Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Self

from autograder.processes.descriptors import readable_descriptors
from autograder.processes.fair_deadline import RunDelay, SeenDelay, of_process
from autograder.processes.process_folders import Sandboxed, number_inside
from autograder.sandbox import warm_starts
from autograder.sandbox.confinement import control_groups, network
from autograder.sandbox.confinement.network import SandboxStartError
from autograder.sandbox.isolation import END_TIMEOUT_S, StartedProcess
from autograder.sandbox.prefork import ForkedProcess, ZygoteError
from autograder.sandbox.resource_limits import Limits
from autograder.sandbox.resources.resource_watch import ResourceWatch
from autograder.sandbox.unsandboxed import fate_of

KILL_TIMEOUT_S = 10.0
"""Seconds until a killed subject must have ended: the kernel takes a moment for its memory."""


def end_process(process: StartedProcess) -> None:
    """End a process if it has not ended.

    The first process of a sandbox cannot go before everybody has, and been taken note of.
    """
    process.kill()
    with suppress(subprocess.TimeoutExpired):
        process.wait(KILL_TIMEOUT_S)


class Warden:
    """A running warden (`autograder.processes.outside.warden`), as the engine sees it.

    ``examiner`` is the first process of the sandbox of the examiner whom it answers.
    """

    def __init__(self, process: StartedProcess) -> None:
        """Take the process, and end it with this."""
        self._process, self.examiner = process, 0

    def announce_subject(self, init: int, pid: int, ours: list[int]) -> None:
        """Tell it whom to look at.

        Args:
            init: the first process of the subject's sandbox.
            pid: the subject, by its number in there.
            ours: what else is in there, by such numbers.
        """
        told = {"subject": init, "examiner": self.examiner, "pid": pid, "ours": ours}
        assert self._process.stdin is not None
        with suppress(BrokenPipeError):  # without an answer the examiner reports a grader's error
            self._process.stdin.write(json.dumps(told).encode() + b"\n")
            self._process.stdin.flush()

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """End it."""
        end_process(self._process)
        for stream in (self._process.stdin, self._process.stdout, self._process.stderr):
            if stream is not None:
                with suppress(BrokenPipeError):  # it was told something, and had gone
                    stream.close()


class SandboxedSubject:
    """A running process in its sandbox: a subject, or an examiner."""

    def __init__(
        self,
        process: subprocess.Popen[bytes],
        init: int,
        limits: Limits,
        held: ExitStack,
        warden: Warden | None = None,
    ) -> None:
        """Watch over the process namespace whose process 1 is ``init``; a warden learns of it."""
        self._process = process
        self._init = init
        self._limits = limits
        self._warden = warden
        self._held = held
        self.handle = os.pidfd_open(init)  # unlike its number, never another process's
        held.callback(os.close, self.handle)
        self._watch = ResourceWatch(init, self.handle, limits)
        self.pid = 0
        self._numbers: tuple[int, list[int]] = (0, [])  # of it and of those that hold its sandbox
        self.delay: RunDelay = of_process(0)

    @property
    def unwatched(self) -> bool:
        """Whether it was ended because the watch over it failed."""
        return self._watch.failed

    def describe_excess(self, timeout: float = 0.0) -> str:
        """Return in words what it was ended for using too much of; empty if it was not.

        If it still runs, it has ``timeout`` seconds to be ended.
        """
        readable_descriptors([self.handle], timeout)
        return "" if self._watch.failed else self._watch.reason

    def ready(self) -> None:
        """Find the subject's process, bound it, and tell the warden of it."""
        if not self.pid:  # it is the only one that process 1 has, as yet
            children = Path(f"/proc/{self._init}/task/{self._init}/children").read_text().split()
            self.pid = int(children[0]) if children else 0
        with suppress(OSError):
            # If the machine runs out of memory all the same, this process goes first, and what it
            # starts: it cannot change that where its /proc is read-only.
            Path(f"/proc/{self.pid}/oom_score_adj").write_text("1000")
        if (group := control_groups.enclose_process(self.pid, self._limits)) is not None:
            self._held.callback(group.close)
        pid = number_inside(self.pid)
        # Nothing of the student's runs yet: the others hold the sandbox.
        ours = [number for number in Sandboxed(self._init).inner_pids() if number != pid]
        self.delay = SeenDelay(Sandboxed(self._init, ours), pid, self._watch.cpu_seconds)
        self._numbers = pid, ours
        self.tell_warden()

    def tell_warden(self) -> None:
        """Have the warden look at this subject."""
        if self._warden is not None:
            self._warden.announce_subject(self._init, *self._numbers)

    def require_holder(self) -> None:
        """Wait until what holds the sandbox says that it is there.

        Raises:
            SandboxStartError: the sandbox's tools refuse, or its watch has ended it already.
        """
        assert self._process.stdout is not None
        network.require_word(self._process.stdout, self._process)
        if not self._process.stdout.readline():
            raise SandboxStartError(self.explain_failure())

    def describe_end(self, timeout: float = END_TIMEOUT_S) -> str:
        """Return in words how the process ended, or that it has not within ``timeout`` seconds."""
        try:
            code = self._process.wait(timeout)
        except subprocess.TimeoutExpired:
            return "it closed its connection to the grader"
        if self._watch.reason:
            return self._watch.reason
        # bwrap reports a signal as a shell does.
        is_signal = code > 128 and code - 128 in set(signal.Signals)
        return fate_of(128 - code if is_signal else code)

    def explain_failure(self) -> str:
        """Return why it did not start, in words: how it ended, and what it last said."""
        fate = self.describe_end()
        if self._process.poll() is None:
            return fate
        assert self._process.stderr is not None
        return with_last_words(fate, self._process.stderr.read(65536))

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """End every process of the sandbox: they all go with process 1."""
        self._watch.stop()
        self._kill()
        self._process.wait()
        for stream in (self._process.stdout, self._process.stderr):
            if stream is not None:
                stream.close()
        self._held.close()

    def _kill(self) -> None:
        with suppress(ProcessLookupError):
            signal.pidfd_send_signal(self.handle, signal.SIGKILL)


class WarmSubject(SandboxedSubject):
    """A subject that is forked into a sandbox in which nothing else runs yet."""

    _forked: ForkedProcess | None = None

    def fork(self, arguments: Sequence[str], fds: Sequence[int], user: int | None) -> None:
        """Fork the subject once the sandbox is complete.

        Raises:
            SandboxStartError: the sandbox's tools refuse, or its watch has ended it already.
            ZygoteError: there is no fork to be had.
        """
        self.require_holder()
        try:
            self._forked = warm_starts.subject(arguments, fds, self.handle, user)
        except ZygoteError as error:
            if self._watch.reason:  # there is nothing left to fork into
                raise SandboxStartError(self._watch.reason) from error
            raise
        self.pid = self._forked.pid

    def describe_end(self, timeout: float = END_TIMEOUT_S) -> str:
        """Return in words how the process ended, or that it has not within ``timeout`` seconds."""
        if self._forked is None:
            return super().describe_end(timeout)
        try:
            code = self._forked.wait(timeout)
        except subprocess.TimeoutExpired:
            return "it closed its connection to the grader"
        return self._watch.reason or fate_of(code)

    def explain_failure(self) -> str:
        """Return why it did not start, in words: how it ended, and what it last said."""
        if self._forked is None:
            return super().explain_failure()
        fate = self.describe_end()
        if self._forked.returncode is None:
            return fate
        assert self._forked.stderr is not None
        return with_last_words(fate, self._forked.stderr.read(65536))

    def __exit__(self, *details: object) -> None:
        """End every process of the sandbox; the subject goes with the others."""
        self._watch.stop()
        self._kill()
        if self._forked is not None:
            # First: process 1 cannot go before everybody has, and been taken note of.
            with suppress(subprocess.TimeoutExpired):
                self._forked.wait(KILL_TIMEOUT_S)
            if self._forked.stderr is not None:
                self._forked.stderr.close()
        super().__exit__(*details)


def with_last_words(fate: str, said: bytes) -> str:
    """Return how a process ended, with the last line that it wrote."""
    lines = said.decode(errors="replace").strip().splitlines()
    return f"{fate} ({lines[-1]})" if lines else fate
