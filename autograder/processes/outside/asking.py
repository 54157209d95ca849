"""How an examiner asks what it cannot see or do itself: a warden, or in its own process."""

from __future__ import annotations

import os
import socket
import threading
import time
from typing import Any, Protocol

from autograder.processes.channel import Channel
from autograder.processes.fair_deadline import RunDelay, of_process
from autograder.processes.outside import warden_requests
from autograder.processes.outside.holding import HoldError
from autograder.processes.outside.warden_requests import CannotLoseError, RequestError, Scene
from autograder.processes.process_folders import SingleProcess

ANSWER_TIMEOUT_S = 120.0
"""Seconds that an answer may take: a rest takes five at most, on a machine that is busy longer."""


class Outside(Protocol):
    """Something that answers the requests of `autograder.processes.outside.warden_requests`."""

    own_network: bool
    """Whether the network is the submission's alone, so that it may lose packets."""
    delay: RunDelay
    """For how long others have kept the subject from running."""
    usual_patience: float
    """Share of what grading takes as patience for what may never come."""
    patience: float
    """Share of the usual patience: below 1 where it hardly will come."""

    def ask(self, what: str, **given: Any) -> Any:
        """Return the answer to a request, as JSON knows it.

        Raises:
            RequestError: there is none.
            CannotLoseError: this machine cannot make a network lose packets.
            HoldError: this machine does not let threads be held.
        """


class Here:
    """Answers in this process, about another one: the kernel of a student's own."""

    own_network = False
    usual_patience = 0.5  # in a notebook a second look costs a student nothing, and waiting does
    patience = 1.0

    def __init__(self, pid: int) -> None:
        """Answer about the process ``pid``."""
        self._scene = Scene(SingleProcess(pid), pid, SingleProcess(os.getpid()))
        self.delay: RunDelay = of_process(pid)

    def ask(self, what: str, **given: Any) -> Any:
        """Return the answer to a request."""
        if what in ("lose", "deliver"):
            raise CannotLoseError("others use the network, too")
        return warden_requests.answer_request(self._scene, what, given)


class Afar:
    """Has a warden answer, over a channel."""

    own_network = True
    usual_patience = patience = 1.0

    def __init__(self, connection: socket.socket) -> None:
        """Take ownership of the connection to it."""
        self._channel = Channel(connection)
        self._asking = threading.Lock()
        self.delay: RunDelay = AskedDelay(self)

    def ask(self, what: str, **given: Any) -> Any:
        """Return the answer to a request."""
        with self._asking:
            self._channel.send({"what": what, **given})
            reply = self._channel.receive(ANSWER_TIMEOUT_S)
        if "cannot" in reply:
            raise CannotLoseError(reply["cannot"])
        if "no_hold" in reply:
            raise HoldError(reply["no_hold"])
        if "error" in reply:
            raise RequestError(reply["error"])
        return reply["answer"]


class AskedDelay:
    """How long others have kept a subject from running: it is asked only where it matters."""

    def __init__(self, outside: Outside) -> None:
        """Ask ``outside``."""
        self._outside = outside

    def mark(self) -> float:
        """Return what stands for this moment."""
        return time.monotonic()

    def delay_since(self, mark: float) -> float:
        """Return for how many s it was kept since then."""
        return float(self._outside.ask("kept", since=mark))
