"""Texts of a submission as HTML, made in a process that ends when one of them takes too long.

Markdown parsers and lexers take a minute for some texts of 100 kB, and the gradebook's only writer
would wait for them. So a text has a bound on its size, the process that formats it one
on its memory and on its processor time (which counts what the text costs, however busy the machine
is), and so have all texts of a page. What is over is for the caller to show as it was typed.
"""

from __future__ import annotations

import atexit
import json
import os
import select
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Collection, Mapping
from contextlib import suppress
from typing import Any

_LONG, _DISPLAYED = 256 * 1024, 1024 * 1024
MAX_TEXTS = {"markdown": _LONG, "answer": _LONG, "code": _LONG, "html": _DISPLAYED}
"""Characters of a text that is formatted at all; a long answer has 5000."""

MAX_REPLY_BYTES = 64 * 1024 * 1024
TEXT_S, PAGE_S = 0.25, 0.7
"""Processor time of one text, and of all texts of a page; one of the course takes 0.05 s in all."""

PATIENCE_S = 20.0
"""Wall time for one text, in case that the process does not get its processor time at all."""

LENGTH = struct.Struct("!I")


class Page:
    """The texts of one page, or of one notebook: they share a bound on their time."""

    def __init__(self) -> None:
        """Begin with all of the time."""
        self._left = PAGE_S

    def format_markdown(self, text: str, attachments: Mapping[str, Any]) -> str | None:
        """Return Markdown as HTML, with the pictures of its ``attachments``; None if over time."""
        return self._ask_formatter("markdown", text, attachments=attachments)

    def format_answer(
        self, text: str, taken: Collection[str], attachments: Mapping[str, Any]
    ) -> str | None:
        """Return an answer as Markdown (`allowed_html.screen_answer`); None if over time."""
        return self._ask_formatter("answer", text, taken=list(taken), attachments=attachments)

    def highlight_code(self, text: str, language: str = "ipython3") -> str | None:
        """Return code as coloured HTML; None if over time."""
        return self._ask_formatter("code", text, language=language)

    def clean_html(self, text: str) -> str | None:
        """Return HTML of which nothing runs (`allowed_html.cleaned_html`); None if over time."""
        return self._ask_formatter("html", text)

    def _ask_formatter(self, what: str, text: str, **more: Any) -> str | None:
        seconds = min(TEXT_S, self._left)
        if len(text) > MAX_TEXTS[what] or seconds <= 0:
            return None
        made, spent = _formatter.ask({"do": what, "text": text, "seconds": seconds, **more})
        self._left -= seconds if made is None else spent
        return made


class _Formatter:
    """The process that formats (see `formatting`): started on demand, again if lost."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._owner = 0
        self._lock = threading.Lock()

    def start(self) -> subprocess.Popen[bytes]:
        """Return the running process; what it imports takes it a second."""
        if self._owner != os.getpid():  # after a fork it is another process's
            self._process = None
        if self._process is not None and self._process.poll() is not None:
            self.end()
        if self._process is None:
            self._owner = os.getpid()
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-m", "autograder.gradebook.safe_html.formatting"],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                start_new_session=True,
            )  # fmt: skip
        return self._process

    def ask(self, request: dict[str, Any]) -> tuple[str | None, float]:
        """Return what was made, None if it was not in time, and the processor time that it took."""
        data = json.dumps(request).encode()
        with self._lock:
            process = self.start()
            try:
                return self._send_request(process, data)
            except (OSError, ValueError, KeyError):
                self.end()
                return None, TEXT_S

    def _send_request(
        self, process: subprocess.Popen[bytes], data: bytes
    ) -> tuple[str | None, float]:
        assert process.stdin is not None
        process.stdin.write(LENGTH.pack(len(data)) + data)
        process.stdin.flush()
        deadline = time.monotonic() + PATIENCE_S
        (length,) = LENGTH.unpack(_read_bytes(process, LENGTH.size, deadline))
        if length > MAX_REPLY_BYTES:
            raise ValueError("too long")
        reply = json.loads(_read_bytes(process, length, deadline))
        return reply.get("made"), float(reply.get("spent", TEXT_S))

    def end(self) -> None:
        """End the process, and what it has forked."""
        process, self._process = self._process, None
        if process is None or self._owner != os.getpid():
            return
        with suppress(OSError):
            os.killpg(process.pid, 9)
        for pipe in (process.stdin, process.stdout):
            if pipe is not None:
                with suppress(OSError):
                    pipe.close()
        process.wait()


def _read_bytes(process: subprocess.Popen[bytes], count: int, deadline: float) -> bytes:
    """Return so many bytes of what a process writes.

    Raises:
        OSError: it ended, or they did not come before the ``deadline``.
    """
    assert process.stdout is not None
    file, parts, left = process.stdout.fileno(), [], count
    while left:
        ready, _, _ = select.select([file], [], [], max(0.0, deadline - time.monotonic()))
        part = os.read(file, min(left, 1 << 20)) if ready else b""
        if not part:
            raise OSError("no reply")
        parts.append(part)
        left -= len(part)
    return b"".join(parts)


_formatter = _Formatter()
atexit.register(_formatter.end)


def warm_up() -> None:
    """Start the process that formats, while there is nothing to wait for."""
    with _formatter._lock:
        _formatter.start()
