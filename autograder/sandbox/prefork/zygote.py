"""The zygote: a process that imports what others need, and then only forks.

Started as ``python -P -m autograder.sandbox.prefork.zygote --socket FD MODULE``. It says when it is
ready; each packet that follows is a `Task`, with descriptors: first one to report over, then what
the task names. A fork (the keeper) joins the namespaces, because a process that joins a process
namespace is itself not in it, forks once more, reports that process and, when it has ended, how.
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

from autograder.sandbox.prefork.task import Task, close_others

MOST_DESCRIPTORS = 64
LARGEST_TASK = 128 * 1024
"""Bytes of a task's JSON; an environment is the largest part of it."""


def serve_tasks(tasks: socket.socket) -> Task | None:
    """Fork what is asked for until nobody asks any more.

    Returns:
        None in the zygote itself; in a fork that is to run a task, the task.
    """
    while True:
        text, handed, _, _ = socket.recv_fds(tasks, LARGEST_TASK, MOST_DESCRIPTORS)
        if not text:
            return None
        report = socket.socket(fileno=handed.pop(0))
        if _fork_or_report(report) == 0:
            tasks.close()
            return _run_keeper(Task.from_json(text), report, handed)
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


def _run_keeper(task: Task, report: socket.socket, handed: list[int]) -> Task:
    """Join, and fork the task's process; return in that process only."""
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    try:
        handed, holder = task.join_namespaces(handed)
    except OSError as error:
        _send_report(report, {"error": str(error)})
        os._exit(1)
    pid = _fork_or_report(report)
    if pid == 0:
        report.detach()  # closed with everything else that is not the task's
        task.become_process(handed)
        return task
    if pid is not None:
        _wait_as_keeper(report, pid, holder)
    os._exit(1)


def _wait_as_keeper(report: socket.socket, pid: int, holder: int | None) -> NoReturn:
    """Report a process and how it ended; its number is its own until whoever asked is done.

    When whoever asked is gone, by ``kill -9`` too, nobody wants the process any more: it is killed.
    With it ends the process of which ``holder`` is the pidfd, and so all that it has left behind.
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

    def run(self, task: Task) -> int:
        """Run a task in this process, which is a fork; return its exit code."""
        self._code = 1  # for what it raises
        try:
            self._code = task.run()
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
    parser.add_argument("--socket", type=int, required=True, help="file descriptor of the tasks")
    parser.add_argument("module", help="the module whose main() is run")
    options = parser.parse_args(arguments)
    leaving = _Leaving()  # before anything else has an exit function
    tasks = socket.socket(fileno=options.socket)
    gc.disable()  # what is imported stays: there is little in it to collect
    module: Any = import_module(options.module)
    module.preload()
    # A fork has no thread but the one that forked. Two libraries have some that are not Python's:
    # the workers of OpenBLAS are made anew in a fork, LTTng's only listen for a tracer.
    if threading.active_count() > 1:
        sys.exit(f"{options.module} starts threads when it is imported, which no fork would have")
    # What is here now stays: nothing of it needs to be looked at, and so copied, by a fork.
    gc.collect()
    gc.freeze()
    gc.enable()
    signal.signal(signal.SIGCHLD, _reap_children)
    tasks.send(json.dumps({"ready": os.getpid()}).encode())
    task = serve_tasks(tasks)
    return 0 if task is None else leaving.run(task)


if __name__ == "__main__":
    sys.exit(main())
