"""The engine's side of plain programs: starts one when an examiner asks for it, and signals to it.

It takes nothing from the examiner but data with bounds, and acts on nothing but a further process
of the submission's own, in a sandbox as the subject's is.
"""

from __future__ import annotations

import os
import re
import signal
import socket
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from typing import Any, Self

from autograder.processes.channel import Channel, ChannelClosed, ChannelTimeout
from autograder.sandbox import RunningSubject, SandboxStartError, subject_command
from autograder.sandbox.prefork import ZygoteError
from course.runtime.domains.leases import MAX_DOMAIN

UP_TIMEOUT_S = 30.0
"""Seconds until a program must have started, and until its cells have made its nodes."""
ALL_UP_S = 60.0
"""Seconds that the cells of all programs of an examination may take together: 5 as a rule."""
MOST_NODES, MOST_ARGUMENTS, MAX_ARGUMENT, MOST_THREADS, MOST_LIVES = 8, 4, 200, 8, 8

_CLASS = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,99}")

Start = Callable[[Sequence[str], Sequence[int]], RunningSubject]
"""Starts a command in the submission's network, with descriptors that it inherits."""


class ProgramHost:
    """At most one program at a time. Leaving its block ends that."""

    def __init__(self, start: Start, subject: RunningSubject, sources: Sequence[str]):
        """Start programs with ``start``, beside ``subject``, from the cells that have been run."""
        self._start, self._subject, self._sources = start, subject, sources
        self._held = ExitStack()
        self._program: RunningSubject | None = None
        self._left = ALL_UP_S

    def answer_request(self, request: dict[str, Any]) -> dict[str, Any]:
        """Return the answer to a request of the examiner's; an ``"error"`` says why there is none.

        ``{"wants": "program", "nodes": [[class, arguments], ...], "then": [{"nodes", "tried"},
        ...], "threads", "sim_time", "apart", "twice", "shut_down", "goes_on", "domain"}`` starts
        one; ``{"wants": "interrupt"}`` sends SIGINT, ``{"wants": "end"}`` ends it. From its start
        to its end, the warden shows the program's processes in place of the subject's. The answer
        ``"slow"`` says that none is started any more.
        """
        match request.get("wants"):
            case "program":
                return self._begin_program(request)
            case "interrupt" if self._program is not None:
                with suppress(ProcessLookupError):
                    os.kill(self._program.pid, signal.SIGINT)
                return {}
            case "end":
                self._end_program()
                return {}
        return {"error": "there is no such request"}

    def _begin_program(self, request: dict[str, Any]) -> dict[str, Any]:
        self._end_program()
        try:
            wanted, domain = _parse_request(request)
        except (LookupError, OverflowError, TypeError, ValueError):
            return {"error": "this is no program"}
        if self._left <= 0:
            return {"slow": True}
        engine, theirs = socket.socketpair()
        channel = Channel(engine)
        self._held.callback(channel.close)
        try:
            with theirs:
                program = self._start_program(theirs, domain)
            channel.receive(UP_TIMEOUT_S)
        except (SandboxStartError, ZygoteError, ChannelTimeout, ChannelClosed) as error:
            self._held.close()
            return {"error": f"it did not start ({error})"}
        program.ready()
        self._program = program
        # From here on code of the student's is at work: what goes wrong is theirs.
        try:
            channel.send({"cells": [*self._sources], "program": wanted})
            return {"up": self._comes_up(channel)}
        except ChannelClosed:
            return {"up": False}

    def _comes_up(self, channel: Channel) -> bool:
        """Wait until the program's nodes are made, and count the time; return whether they are."""
        began = time.monotonic()
        try:
            channel.receive(UP_TIMEOUT_S)
        except (ChannelClosed, ChannelTimeout):
            return False
        finally:
            self._left -= time.monotonic() - began
        return True

    def _start_program(self, engine: socket.socket, domain: int) -> RunningSubject:
        control, unused = socket.socketpair()  # a subject has one: nobody talks on this
        with control, unused:
            command = [*subject_command(engine, unused, domain), "--program"]
            program = self._start(command, [engine.fileno(), unused.fileno()])
        return self._held.enter_context(program)

    def _end_program(self) -> None:
        if self._program is not None:
            self._program = None
            self._subject.tell_warden()
        self._held.close()

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the program, if there is one."""
        self._held.close()


def _parse_request(request: dict[str, Any]) -> tuple[dict[str, Any], int]:
    """Return what a program is to be, and its domain.

    It raises what `answer_request` takes for no program.
    """
    nodes = _parse_nodes(request["nodes"])
    then = [
        {"nodes": _parse_nodes(life["nodes"]), "tried": _parse_nodes(life["tried"])}
        for life in request["then"][:MOST_LIVES]
    ]
    threads, domain = int(request["threads"]), int(request["domain"])
    if not 1 <= threads <= MOST_THREADS or not 0 <= domain <= MAX_DOMAIN:
        raise ValueError(threads)
    flags = ("sim_time", "apart", "twice", "shut_down", "goes_on")
    how = {name: bool(request[name]) for name in flags}
    return {"nodes": nodes, "then": then, "threads": threads, **how}, domain


def _parse_nodes(wanted: Any) -> list[Any]:
    """Return classes and texts that their constructors are given.

    It raises what `_parse_request` does.
    """
    nodes = []
    for name, arguments in wanted[:MOST_NODES]:
        texts = [argument for argument in arguments[:MOST_ARGUMENTS] if isinstance(argument, str)]
        if not _CLASS.fullmatch(name) or any(len(text) > MAX_ARGUMENT for text in texts):
            raise ValueError(name)
        nodes.append([name, texts])
    return nodes
