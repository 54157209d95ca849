"""Standard output and error of a process that runs cells: Python's streams, and the descriptors.

ipykernel has a thread that sends what is printed, and one for each descriptor. Here one thread does
for both descriptors what those do; the thread that prints does all else.
"""

# mypy: allow-untyped-calls
# ipykernel leaves most of its functions untyped.

from __future__ import annotations

import codecs
import fcntl
import os
import select
import sys
import threading
from contextlib import suppress
from typing import Any

from ipykernel.iostream import BackgroundSocket, IOPubThread, OutStream

from autograder.examination.subject.recording import Recording

PIPE_BYTES = 1024 * 1024
"""Room of the pipe behind a descriptor: C code that prints may keep Python from reading it."""

MAX_CHUNK_BYTES = 4 * 1024 * 1024
"""Bytes that are read of a descriptor before somebody else has a turn."""


class Publisher(IOPubThread):
    """Stands in for ipykernel's publishing thread, but sends at once what it is given."""

    def __init__(self) -> None:
        """Open nothing, and start nothing."""
        self.socket: Any = None
        self.io_loop: Any = None
        self.thread = threading.Thread(name="IOPub")  # never started: `OutStream` looks at it
        self.background_socket = BackgroundSocket(self)

    def schedule(self, f: Any) -> None:
        """Do it now."""
        f()


class CapturedStream(OutStream):
    """`sys.stdout` or `sys.stderr` of a cell, which keeps the beginning of what is printed."""

    def __init__(self, session: Any, publisher: Publisher, name: str, recording: Recording) -> None:
        """Publish as the stream ``name`` what there is room for."""
        super().__init__(session, publisher, name, watchfd=False)
        self._recording = recording
        self._descriptor = {"stdout": 1, "stderr": 2}[name]
        self.descriptors: Descriptors | None = None

    def fileno(self) -> int:
        """Return the descriptor: what is written there is shown as well."""
        return self._descriptor

    def write(self, string: str) -> int:
        """Show some text in the cell that runs, or in that whose task writes it."""
        if not isinstance(string, str):
            raise TypeError(f"write() argument must be str, not {type(string)}")
        if not self._is_master_process():
            os.write(self._descriptor, string.encode(errors="replace"))
            return len(string)
        if self.descriptors is not None:
            self.descriptors.read_pipes()  # what was written there before comes before it
        self.show_text(string)
        return len(string)

    def show_text(self, text: str) -> None:
        """Show as much of a text as there is room for."""
        request = self.parent_header.get("msg_id", "")
        if kept := self._recording.reserve_room(self.name, request, len(text)):
            super().write(text[:kept])

    def _schedule_flush(self) -> None:
        self._flush()


class Descriptors:
    """Shows what is written to descriptors 1 and 2: by programs that are started, and by C code."""

    def __init__(self, stdout: CapturedStream, stderr: CapturedStream) -> None:
        """Put pipes in the place of the two, and start the thread that reads them."""
        self._process = os.getpid()
        self._reading = threading.RLock()
        self._pipes: dict[int, tuple[CapturedStream, codecs.IncrementalDecoder]] = {}
        for stream in (stdout, stderr):
            stream.descriptors = self
            reads, writes = os.pipe()
            os.dup2(writes, stream.fileno())
            os.close(writes)
            os.set_blocking(reads, False)
            with suppress(OSError):  # more than this user may have in all: it is only less room
                fcntl.fcntl(reads, fcntl.F_SETPIPE_SZ, PIPE_BYTES)
            self._pipes[reads] = (stream, codecs.getincrementaldecoder("utf-8")("replace"))
        threading.Thread(target=self._follow_pipes, name="descriptors", daemon=True).start()

    def read_pipes(self, *, wait: bool = False) -> None:
        """Show what has been written by now; if another thread is at it, only with ``wait``."""
        if os.getpid() != self._process or not self._reading.acquire(blocking=wait):
            return
        try:
            for number, (stream, decoder) in self._pipes.items():
                _show_pipe(number, stream, decoder)
        finally:
            self._reading.release()

    def _follow_pipes(self) -> None:
        poll = select.poll()
        for number in self._pipes:
            poll.register(number, select.POLLIN)
        left = set(self._pipes)
        while left:
            for number, event in poll.poll():
                if event & select.POLLIN:
                    self.read_pipes(wait=True)
                else:  # nobody can write to it any more
                    poll.unregister(number)
                    left.discard(number)


def _show_pipe(number: int, stream: CapturedStream, decoder: codecs.IncrementalDecoder) -> None:
    read = 0
    with suppress(OSError):  # there is no more, or a cell has closed it
        while read < MAX_CHUNK_BYTES and (data := os.read(number, 65536)):
            read += len(data)
            stream.show_text(decoder.decode(data))


def replace_streams(session: Any, publisher: Publisher, recording: Recording) -> Descriptors:
    """Put streams of this module in the place of this process's."""
    sys.stdout, sys.stderr = (
        CapturedStream(session, publisher, name, recording) for name in ("stdout", "stderr")
    )
    return Descriptors(sys.stdout, sys.stderr)
