"""Warm starts of examiners and subjects: which zygotes there are, and what is forked from them.

Both zygotes live where nothing can be written, so that no way back to the files they were loaded
from is one to change them. A user who is not root has them in a user namespace with every right,
which is the parent of all that the sandboxes get. Wardens, who run in none, are forked like
examiners.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence

from autograder.processes import python_module
from autograder.sandbox.confinement import environment_variables, network, seccomp, visible_files
from autograder.sandbox.prefork import ForkedProcess, Zygote, shared
from autograder.sandbox.prefork.fork_request import ForkRequest
from autograder.sandbox.prefork.forked import pipe_in, pipe_out
from autograder.sandbox.resource_limits import Limits

SUBJECT = "autograder.examination.subject.process"
EXAMINER = "autograder.running.examiner"
WARDEN = "autograder.processes.outside.warden"
_READ_ONLY = ("--ro-bind", "/", "/", "--dev-bind", "/dev", "/dev")


def subject_zygote() -> Zygote:
    """Return what subjects are forked from.

    Raises:
        ZygoteError: it does not start.
    """
    return shared.get_zygote(
        SUBJECT,
        environment_variables.submission_environment(),
        network.privileged_prefix(*_READ_ONLY),
    )


def examiner_zygote() -> Zygote:
    """Return what examiners are forked from.

    Raises:
        ZygoteError: it does not start.
    """
    before: list[str] = []
    if not network.is_root():
        before = [
            *network.enter_prefix(subject_zygote().pid),
            "bwrap",
            *_READ_ONLY,
            "--cap-add",
            "ALL",
            "--",
        ]
    return shared.get_zygote(EXAMINER, environment_variables.examiner_environment(), before)


def arguments_of(command: Sequence[str], module: str) -> Sequence[str] | None:
    """Return the arguments of a command that runs ``module``; None if it runs something else."""
    start = python_module.command(module)
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
    request = ForkRequest(
        SUBJECT, list(arguments), [0, 1, 2, *fds], process=True, user=user,
        calls=seccomp.filter_program().hex(),
        folder=str(visible_files.HOME),
    )  # fmt: skip
    nowhere = os.open(os.devnull, os.O_RDWR)
    errors, stderr = pipe_out()
    try:
        forked = subject_zygote().fork(request, [process, nowhere, nowhere, errors, *fds])
    except BaseException:
        stderr.close()
        raise
    finally:
        os.close(nowhere)
        os.close(errors)
    forked.stderr = stderr
    return forked


def fork_examiner(
    arguments: Sequence[str], fds: Sequence[int], process: int, user: int | None, limits: Limits
) -> ForkedProcess:
    """Fork an examiner into the namespaces of a process, with pipes to its standard streams.

    Args:
        arguments: of its command.
        fds: descriptors that it gets, under the same numbers.
        process: a process in its sandbox, by a pidfd.
        user: the user id that it takes on, if root grades.
        limits: what it may use.
    """
    request = ForkRequest(
        EXAMINER, list(arguments), [0, 1, 2, *fds], process=True, user=user,
        limits=limits.to_json(), calls=seccomp.filter_program().hex(),
        folder=str(visible_files.HOME),
    )  # fmt: skip
    return _with_streams(request, [process], fds)


def fork_warden(
    arguments: Sequence[str], fds: Sequence[int], namespaces: Mapping[str, int]
) -> ForkedProcess:
    """Fork a warden into a network, by descriptors of the ``namespaces`` that it joins."""
    request = ForkRequest(
        WARDEN, list(arguments), [0, 1, 2, *fds], namespaces=list(namespaces),
        environment=dict(os.environ),
    )  # fmt: skip
    return _with_streams(request, [*namespaces.values()], fds)


def _with_streams(request: ForkRequest, joined: Sequence[int], fds: Sequence[int]) -> ForkedProcess:
    (reads, stdin), (writes, stdout), (errors, stderr) = pipe_in(), pipe_out(), pipe_out()
    try:
        forked = examiner_zygote().fork(request, [*joined, reads, writes, errors, *fds])
    except BaseException:
        for stream in (stdin, stdout, stderr):
            stream.close()
        raise
    finally:
        for descriptor in (reads, writes, errors):
            os.close(descriptor)
    forked.stdin, forked.stdout, forked.stderr = stdin, stdout, stderr
    return forked
