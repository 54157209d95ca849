"""The control channel between examiner and subject: one JSON object a line, over a socket.

What comes from a subject is data written by a stranger: it is bounded in size, parsed as JSON and
nothing else, and every read has a deadline.
"""

from __future__ import annotations

import json
import socket
import time
from contextlib import suppress
from typing import Any

from autograder.processes.fair_deadline import FairDeadline, RunDelay

MAX_LINE_BYTES = 2 * 1024 * 1024
"""Largest message in bytes: the outputs of one cell are the largest, and are cut well below it."""


class ChannelClosed(Exception):  # noqa: N818 - a state of the other side, not a fault of ours
    """The other side closed the channel or its process ended."""


class ChannelBroken(ChannelClosed):
    """The other side sent what is no message: nothing that follows can be made sense of."""


class ChannelTimeout(Exception):  # noqa: N818
    """The other side did not answer before the deadline."""


def parse_line(line: bytes) -> Any:
    """Return what is in a line of JSON, in UTF-8.

    Half of a surrogate pair is replaced, as `Channel.send` does: it is legal in JSON, but nothing
    could write it again.

    Raises:
        ValueError: it is no JSON.
        RecursionError: it is nested too deep.
    """
    text = line.decode("utf-8")
    data = json.loads(text)
    if "\\ud" in text.lower():
        data = json.loads(json.dumps(data, ensure_ascii=False).encode(errors="replace"))
    return data


class Channel:
    """A line-based JSON channel over a connected stream socket."""

    def __init__(self, sock: socket.socket, most: int = MAX_LINE_BYTES) -> None:
        """Take ownership of ``sock``; messages of more than ``most`` bytes are not received."""
        self._sock = sock
        self._most = most
        self._buffer = b""

    def fileno(self) -> int:
        """Return the socket's descriptor."""
        return self._sock.fileno()

    def send(self, message: dict[str, Any]) -> None:
        """Send one message.

        Raises:
            ChannelClosed: the other side is gone.
            ValueError: the message is larger than ``MAX_LINE_BYTES``.
        """
        line = json.dumps(message, ensure_ascii=False).encode(errors="replace") + b"\n"
        if len(line) > MAX_LINE_BYTES:
            raise ValueError(f"control message of {len(line)} bytes is over {MAX_LINE_BYTES}")
        try:
            self._sock.settimeout(None)
            self._sock.sendall(line)
        except OSError as error:
            raise ChannelClosed(str(error)) from error

    def receive(self, timeout: float | None = None) -> dict[str, Any]:
        """Return the next message, waiting at most ``timeout`` seconds (None: for ever).

        Raises:
            ChannelClosed: end of stream.
            ChannelBroken: something that is not a JSON object of bounded size.
            ChannelTimeout: nothing came in time.
        """
        deadline = None if timeout is None else time.monotonic() + timeout
        while b"\n" not in self._buffer:
            if len(self._buffer) > self._most:
                raise ChannelBroken(f"a message of more than {self._most} bytes was sent")
            self._fill(deadline)
        line, self._buffer = self._buffer.split(b"\n", 1)
        try:
            message = parse_line(line)
        except (ValueError, RecursionError) as error:
            raise ChannelBroken("a message that is not JSON was sent") from error
        if not isinstance(message, dict):
            raise ChannelBroken("a message that is not a JSON object was sent")
        return message

    def receive_fairly(self, timeout: float, delay: RunDelay) -> dict[str, Any]:
        """Do `receive`, where time in which others kept a program from running does not count.

        That other programs keep a subject from running is no fault of the student's.
        """
        deadline = FairDeadline(timeout, delay)
        while True:
            try:
                return self.receive(deadline.seconds_left)
            except ChannelTimeout:
                if not deadline.seconds_left:
                    raise

    def _fill(self, deadline: float | None) -> None:
        if deadline is not None:
            left = deadline - time.monotonic()
            if left <= 0:
                raise ChannelTimeout
            self._sock.settimeout(left)
        else:
            self._sock.settimeout(None)
        try:
            chunk = self._sock.recv(65536)
        except TimeoutError as error:
            raise ChannelTimeout from error
        except OSError as error:
            raise ChannelClosed(str(error)) from error
        if not chunk:
            raise ChannelClosed("end of stream")
        self._buffer += chunk

    def read_leftovers(self, patience: float, silence: float) -> bytes:
        """Return what comes that need be no message, up to the largest size of one.

        It waits for ``patience`` seconds at most, and no longer than ``silence`` seconds once
        something has come and nothing more does.
        """
        end = until = time.monotonic() + patience
        with suppress(ChannelTimeout, ChannelClosed):
            while len(self._buffer) < self._most:
                self._fill(until)
                until = min(end, time.monotonic() + silence)
        return self._buffer

    def close(self) -> None:
        """Close the socket; closing twice is fine."""
        self._sock.close()
