"""The zygotes of this process: one a module, started at first use, ended with this process."""

from __future__ import annotations

import atexit
import json
import os
import socket
import subprocess
import tempfile
import threading
from collections.abc import Mapping, Sequence
from typing import IO
from weakref import WeakSet

from autograder.processes import python_module
from autograder.sandbox.prefork.fork_request import ForkRequest
from autograder.sandbox.prefork.forked import ForkedProcess, ZygoteError

START_TIMEOUT_S = 120.0
"""Seconds until a zygote must have imported everything; it takes two on a machine that is idle."""


class Zygote:
    """A running zygote, which forks processes that run one module."""

    def __init__(
        self, module: str, environment: Mapping[str, str], before: Sequence[str] = ()
    ) -> None:
        """Start it and wait until it is ready.

        Args:
            module: what its forks run; it has a ``main`` and a ``preload``.
            environment: its environment, which its forks can read.
            before: what goes before its command: a sandbox of its own, say.

        Raises:
            ZygoteError: it did not start.
        """
        self.module = module
        self.environment = dict(environment)
        self.before = list(before)
        self._requests, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._sending = threading.Lock()
        self._forked: WeakSet[ForkedProcess] = WeakSet()
        command = python_module.command("autograder.sandbox.prefork.zygote")
        command += ["--socket", str(theirs.fileno())]
        with theirs, tempfile.TemporaryFile() as said:
            try:
                self._process = subprocess.Popen(
                    [*before, *command, module], env=self.environment, pass_fds=[theirs.fileno()],
                    stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=said,
                    start_new_session=True,
                )  # fmt: skip
            except FileNotFoundError as error:
                self._requests.close()
                raise ZygoteError(f"there is no {error.filename}") from error
            theirs.close()
            self.pid = self._wait_until_ready(said)

    def _wait_until_ready(self, said: IO[bytes]) -> int:
        self._requests.settimeout(START_TIMEOUT_S)
        try:
            text = self._requests.recv(4096)
        except TimeoutError:
            self._process.kill()
            text = b""
        self._requests.settimeout(None)
        if text:
            return int(json.loads(text)["ready"])
        self.close()
        said.seek(0)
        words = said.read(65536).decode(errors="replace").strip().splitlines()
        raise ZygoteError(
            f"the process that {self.module} is forked from did not start "
            f"({words[-1] if words else f'exit code {self._process.returncode}'})"
        )

    @property
    def is_alive(self) -> bool:
        """Whether it still runs."""
        return self._process.poll() is None

    def fork(self, request: ForkRequest, descriptors: Sequence[int]) -> ForkedProcess:
        """Fork a process; ``descriptors`` are those that the request names, in its order.

        Raises:
            ZygoteError: it could not be forked.
        """
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            try:
                with self._sending:
                    socket.send_fds(
                        self._requests, [request.to_json()], [theirs.fileno(), *descriptors]
                    )
            except OSError as error:
                ours.close()
                reason = error.strerror
                raise ZygoteError(f"{request.module} could not be forked ({reason})") from error
        forked = ForkedProcess(ours, request.module)
        with self._sending:
            self._forked.add(forked)
        return forked

    @property
    def started_pid(self) -> int:
        """The process that was started for it: what goes before it, if anything does."""
        return self._process.pid

    def kill_forked(self) -> None:
        """Kill what it has forked, and go on."""
        with self._sending:
            running = list(self._forked)
        for process in running:
            process.kill()

    def close(self) -> None:
        """Let it end; what it has forked goes on."""
        self._requests.close()
        self._process.wait()


class ZygotePool:
    """At most one zygote a module, started when it is first needed."""

    def __init__(self) -> None:
        """Start none yet."""
        self._zygotes: dict[str, Zygote] = {}
        self._lock = threading.Lock()
        self._starting: dict[str, threading.Lock] = {}  # one a module: they start side by side
        self._owner = os.getpid()

    def get_zygote(
        self, module: str, environment: Mapping[str, str], before: Sequence[str] = ()
    ) -> Zygote:
        """Return the zygote of a module; another one if it has ended, or was started otherwise.

        Raises:
            ZygoteError: it did not start.
        """
        with self._lock:
            if self._owner != os.getpid():  # a fork of ours has no say over our children
                self._zygotes, self._starting, self._owner = {}, {}, os.getpid()
            starting = self._starting.setdefault(module, threading.Lock())
        with starting:
            known = self._zygotes.get(module)
            wanted = (dict(environment), list(before))
            if known is None or not known.is_alive or (known.environment, known.before) != wanted:
                if known is not None:
                    self._zygotes.pop(module).close()
                known = self._zygotes[module] = Zygote(module, environment, before)
            return known

    @property
    def started_pids(self) -> set[int]:
        """The processes that were started for the zygotes."""
        return {zygote.started_pid for zygote in self._of_this_process()}

    def kill_forked(self) -> None:
        """Kill all that was forked; the zygotes go on."""
        for zygote in self._of_this_process():
            zygote.kill_forked()

    def _of_this_process(self) -> list[Zygote]:
        # Without the locks: one is held for as long as a zygote takes to start.
        return list(self._zygotes.values()) if self._owner == os.getpid() else []

    def close(self) -> None:
        """Let all zygotes end; what they have forked goes on."""
        if self._owner != os.getpid():
            return
        for module, starting in list(self._starting.items()):
            with starting:
                if (known := self._zygotes.pop(module, None)) is not None:
                    known.close()


shared = ZygotePool()
"""The zygote pool of this process."""

atexit.register(shared.close)
