"""Warm starts of examiners and subjects: which zygotes there are, and what is forked from them.

The subjects' zygote lives where nothing can be written, so that no way back to the files it was
loaded from is one to change them. Who is not root has it in a user namespace with every right,
which is the parent of all that the submissions get.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence

from autograder.sandbox import environment, network, seccomp, view
from autograder.warm import ForkedProcess, Zygote, shared
from autograder.warm.forked import pipe_in, pipe_out
from autograder.warm.task import Task

SUBJECT = "autograder.subject"
EXAMINER = "autograder.examiner"


def subjects() -> Zygote:
    """Return what subjects are forked from.

    Raises:
        ZygoteError: it does not start.
    """
    read_only = network.owning("--ro-bind", "/", "/", "--dev-bind", "/dev", "/dev")
    return shared.zygote(SUBJECT, environment.submission(), read_only)


def examiners() -> Zygote:
    """Return what examiners are forked from.

    Raises:
        ZygoteError: it does not start.
    """
    return shared.zygote(EXAMINER, environment.examiners())


def arguments_of(command: Sequence[str], module: str) -> Sequence[str] | None:
    """Return the arguments of a command that runs ``module``; None if it runs something else."""
    start = [sys.executable, "-m", module]
    return command[len(start) :] if list(command[: len(start)]) == start else None


def subject(
    arguments: Sequence[str], fds: Sequence[int], process: int, user: int | None
) -> ForkedProcess:
    """Fork a subject into the namespaces of a process, given by its pidfd.

    Args:
        arguments: of its command.
        fds: descriptors that it gets, under the same numbers.
        process: a process in the sandbox.
        user: the user id that it takes on, if root grades.
    """
    task = Task(
        SUBJECT, list(arguments), [0, 1, 2, *fds], process=True, user=user,
        calls=seccomp.program().hex(), folder=str(view.HOME),
    )  # fmt: skip
    nowhere = os.open(os.devnull, os.O_RDWR)
    errors, stderr = pipe_out()
    try:
        forked = subjects().fork(task, [process, nowhere, nowhere, errors, *fds])
    except BaseException:
        stderr.close()
        raise
    finally:
        os.close(nowhere)
        os.close(errors)
    forked.stderr = stderr
    return forked


def examiner(
    arguments: Sequence[str],
    fds: Sequence[int],
    variables: Mapping[str, str],
    namespaces: Mapping[str, int],
    data: int,
) -> ForkedProcess:
    """Fork an examiner into a network, with pipes to its standard streams.

    Args:
        arguments: of its command.
        fds: descriptors that it gets, under the same numbers.
        variables: its environment.
        namespaces: descriptors of what it joins.
        data: bytes of writable memory that it may reserve.
    """
    task = Task(
        EXAMINER, list(arguments), [0, 1, 2, *fds], namespaces=list(namespaces),
        environment=dict(variables), data=data,
    )  # fmt: skip
    (reads, stdin), (writes, stdout), (errors, stderr) = pipe_in(), pipe_out(), pipe_out()
    try:
        forked = examiners().fork(task, [*namespaces.values(), reads, writes, errors, *fds])
    except BaseException:
        for stream in (stdin, stdout, stderr):
            stream.close()
        raise
    finally:
        for descriptor in (reads, writes, errors):
            os.close(descriptor)
    forked.stdin, forked.stdout, forked.stderr = stdin, stdout, stderr
    return forked
