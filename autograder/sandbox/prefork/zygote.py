"""The zygote: a process that imports what others need, and then only forks.

Started as ``python -P -m autograder.sandbox.prefork.zygote --socket FD MODULE``. It says when it is
ready; each packet that follows is a `ForkRequest`, with descriptors: first one to report over, then
what the request names. A fork (the keeper) joins the namespaces, because a process that joins a
process namespace is itself not in it, forks once more, reports that process and, when it has
ended, how.
"""

from __future__ import annotations

import argparse
import atexit
import gc
import json
import os
import select
import signal
import socket
import sys
import threading
from collections.abc import Sequence
from contextlib import suppress
from importlib import import_module
from typing import Any, NoReturn

from autograder.sandbox.prefork.fork_request import ForkRequest, close_others

MOST_DESCRIPTORS = 64
LARGEST_TASK_BYTES = 128 * 1024
"""Bytes of a request's JSON; an environment is the largest part of it."""


def serve_requests(requests: socket.socket) -> ForkRequest | None:
    """Fork what is asked for until nobody asks any more.

    Returns:
        None in the zygote itself; in a fork that is to run a request, the request.
    """
    while True:
        text, handed, _, _ = socket.recv_fds(requests, LARGEST_TASK_BYTES, MOST_DESCRIPTORS)
        if not text:
            return None
        report = socket.socket(fileno=handed.pop(0))
        if _fork_or_report(report) == 0:
            requests.close()
            return _run_keeper(ForkRequest.from_json(text), report, handed)
        report.close()
        for descriptor in handed:
            os.close(descriptor)


def _fork_or_report(report: socket.socket) -> int | None:
    """Fork; if the machine refuses, report that and return None."""
    try:
        return os.fork()
    except OSError as error:
        _send_report(report, {"error": f"fork: {error.strerror}"})
        return None


def _run_keeper(request: ForkRequest, report: socket.socket, handed: list[int]) -> ForkRequest:
    """Join, and fork the request's process; return in that process only."""
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    try:
        handed, holder = request.join_namespaces(handed)
    except OSError as error:
        _send_report(report, {"error": str(error)})
        os._exit(1)
    pid = _fork_or_report(report)
    if pid == 0:
        report.detach()  # closed with everything else that is not the request's
        request.become_process(handed)
        return request
    if pid is not None:
        _wait_as_keeper(report, pid, holder)
    os._exit(1)


def _wait_as_keeper(report: socket.socket, pid: int, holder: int | None) -> NoReturn:
    """Report a process and how it ended; keep its number until the process that asked is done.

    When the process that asked is gone, by ``kill -9`` too, nobody wants the new one any more: it
    is killed. With it ends the process of which ``holder`` is the pidfd, and so all that it has
    left behind.
    """
    handle = os.pidfd_open(pid)
    with suppress(OSError):
        socket.send_fds(report, [json.dumps({"pid": pid}).encode()], [handle])
    # The others are the process's own: that it has closed one must be seen at the other end.
    close_others({report.fileno(), handle, *([] if holder is None else [holder])})
    select.select([handle, report.fileno()], [], [])  # it has ended, or nobody is at the other end
    ended = os.waitid(os.P_PID, pid, os.WEXITED | os.WNOWAIT | os.WNOHANG)
    if ended is None:
        signal.pidfd_send_signal(handle, signal.SIGKILL)
        ended = os.waitid(os.P_PID, pid, os.WEXITED | os.WNOWAIT)
    assert ended is not None
    code = ended.si_status if ended.si_code == os.CLD_EXITED else -ended.si_status
    if holder is not None:
        with suppress(ProcessLookupError):
            signal.pidfd_send_signal(holder, signal.SIGKILL)
    _send_report(report, {"code": code})
    with suppress(OSError):
        report.recv(1)
    os.waitpid(pid, 0)
    os._exit(0)


def _send_report(report: socket.socket, message: dict[str, Any]) -> None:
    with suppress(OSError):
        report.send(json.dumps(message).encode())


def _reap_children(*_: object) -> None:
    with suppress(ChildProcessError):
        while os.waitpid(-1, os.WNOHANG)[0]:
            pass


class _Leaving:
    """How a fork ends: as any Python program, but without the exit functions of C libraries.

    Those know threads that a fork does not have; LTTng's cancels its own, and crashes. So this is
    the last of Python's exit functions, which are called in the order opposite to their arrival.
    """

    def __init__(self) -> None:
        self._code: int | None = None
        atexit.register(self)

    def run(self, request: ForkRequest) -> int:
        """Run a request in this process, which is a fork; return its exit code."""
        self._code = 1  # for what it raises
        try:
            self._code = request.run()
        except SystemExit as leaving:
            if leaving.code is None or isinstance(leaving.code, int):
                self._code = leaving.code or 0
            raise
        return self._code

    def __call__(self) -> None:
        if self._code is not None:
            for stream in (sys.stdout, sys.stderr):
                with suppress(OSError, ValueError):  # nobody reads it any more, or it is closed
                    stream.flush()
            os._exit(self._code)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the process, and in a fork of it what that is to be; returns its exit code."""
    parser = argparse.ArgumentParser(prog="autograder.sandbox.prefork.zygote")
    parser.add_argument("--socket", type=int, required=True, help="file descriptor of the requests")
    parser.add_argument("module", help="the module whose main() is run")
    options = parser.parse_args(arguments)
    leaving = _Leaving()  # before anything else has an exit function
    requests = socket.socket(fileno=options.socket)
    gc.disable()  # what is imported stays: there is little in it to collect
    module: Any = import_module(options.module)
    module.preload()
    # A fork has no thread but the one that forked. Two libraries have some that are not Python's:
    # the workers of OpenBLAS are made again in a fork, LTTng's only listen for a tracer.
    if threading.active_count() > 1:
        sys.exit(f"{options.module} starts threads when it is imported, which no fork would have")
    # What is here now stays: nothing of it needs to be looked at, and so copied, by a fork.
    gc.collect()
    gc.freeze()
    gc.enable()
    signal.signal(signal.SIGCHLD, _reap_children)
    requests.send(json.dumps({"ready": os.getpid()}).encode())
    request = serve_requests(requests)
    return 0 if request is None else leaving.run(request)


if __name__ == "__main__":
    sys.exit(main())
