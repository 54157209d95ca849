"""A network of one submission's own: a loopback that DDS can discover over, and nothing else."""

from __future__ import annotations

import json
import os
import signal
import subprocess
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import IO, Any

from autograder.processes.descriptors import readable_descriptors
from course.errors import CourseError

Namespaces = dict[str, int]
"""Open descriptors of namespaces by kind, in the order in which they are joined."""

UIDS = range(2**30, 2**31 - 2)
"""Where root takes a subject's user id from: above all that systems and containers hand out."""

TOOL_TIMEOUT_S = 60.0
"""Seconds that a tool may take over its part of a sandbox: an idle machine takes milliseconds."""

_SET_UP = """
ip -batch - <<END && echo "up $$" && read -r _
link set lo up multicast on
route add 224.0.0.0/4 dev lo
END
"""


class SandboxStartError(CourseError):
    """A sandbox could not be made; the message is what its tools said."""


def make_network(owner: int | None = None) -> Namespaces:
    """Make a network namespace; it lasts as long as a process is in it or a descriptor is open.

    A user who is not root owns it by a user namespace, which bubblewrap makes: where a system
    restricts that (AppArmor), bubblewrap is the one program that has to be allowed to. Its own
    network set-up is not used: version 0.8 fails in one of 100 runs if several make one at a time.

    Args:
        owner: a process in a user namespace that is to own it; None for one of its own.

    Raises:
        SandboxStartError: there is no such network to be had.
    """
    command = ["unshare", "--net", "--", "sh", "-c", _SET_UP]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    if owner is not None and not is_root():
        command = [*enter_prefix(owner), *command]
    elif not is_root():
        command = [*privileged_prefix("--die-with-parent", "--dev-bind", "/", "/"), *command]
    with start_tool(command, **pipes) as holder:
        assert holder.stdout is not None
        require_word(holder.stdout, holder)
        said = holder.stdout.readline().split()
        if len(said) != 2:
            raise SandboxStartError(_collect_stderr(holder) or "no network namespace can be set up")
        made = {
            kind: os.open(f"/proc/{int(said[1])}/ns/{kind}", os.O_RDONLY)
            for kind in _namespace_kinds()
        }
        holder.communicate(b"\n")
    return made


def join_prefix(namespaces: Mapping[str, int]) -> list[str]:
    """Return what goes before a command to run it in ``namespaces``, of this process's."""
    # Not by inheritance: a submission must not find these descriptors among its own.
    kinds = [f"--{kind}=/proc/{os.getpid()}/fd/{fd}" for kind, fd in namespaces.items()]
    return ["nsenter", *kinds, *([] if is_root() else ["--preserve-credentials"]), "--"]


def enter_prefix(owner: int) -> list[str]:
    """Return what goes before a command to run it in the user namespace of a process."""
    return ["nsenter", f"--user=/proc/{owner}/ns/user", "--preserve-credentials", "--"]


@cache
def is_root() -> bool:
    """Whether root grades, who can be any user, and so needs no user namespaces.

    Root of a container or of a user namespace is not meant: it is a user like others.
    """
    if os.geteuid() != 0:
        return False
    maps = (line.split() for line in Path("/proc/self/uid_map").read_text().splitlines())
    ranges = (range(int(first), int(first) + int(count)) for first, _, count in maps)
    return any(UIDS[0] in known and UIDS[-1] in known for known in ranges)


def own_user(uid: int) -> list[str]:
    """Return bwrap's arguments for a user namespace with one user, if one is needed."""
    return [] if is_root() else ["--unshare-user", "--uid", str(uid), "--gid", str(uid)]


def privileged_prefix(*options: str) -> list[str]:
    """Return what goes before a command to run it with every right in a user namespace.

    ``options`` are bwrap's for the files that the command sees. Root needs no such namespace.
    """
    return [] if is_root() else ["bwrap", *own_user(0), *options, "--cap-add", "ALL", "--"]


def _namespace_kinds() -> tuple[str, ...]:
    return ("net",) if is_root() else ("user", "net")


def start_tool(command: Sequence[str], **options: Any) -> subprocess.Popen[bytes]:
    """Start one of the sandbox's tools.

    Raises:
        SandboxStartError: it is not installed.
    """
    try:
        return subprocess.Popen(command, **options)
    except FileNotFoundError as error:
        raise SandboxStartError(f"there is no {error.filename}") from error


def child(info: int, process: subprocess.Popen[bytes]) -> int:
    """Return the process id that bwrap writes to ``info`` once its namespaces are made.

    Raises:
        SandboxStartError: it fails before.
    """
    with os.fdopen(info) as stream:
        require_word(stream, process)
        text = stream.read()
    if not text:
        raise SandboxStartError(
            _collect_stderr(process) or f"bwrap ended with exit code {process.returncode}"
        )
    return int(json.loads(text)["child-pid"])


def require_word(stream: IO[Any], process: subprocess.Popen[bytes]) -> None:
    """Wait until one of the sandbox's tools has written to ``stream``, or closed it.

    Raises:
        SandboxStartError: it does neither; it is killed.
    """
    if not readable_descriptors([stream], TOOL_TIMEOUT_S):
        process.kill()
        raise SandboxStartError(f"it was not there after {TOOL_TIMEOUT_S:.0f} s")


def _collect_stderr(process: subprocess.Popen[bytes]) -> str:
    """Return what a process that ends left on standard error.

    One of bwrap's that is killed while it makes its namespaces leaves a child, which waits for it
    for ever and holds its standard error.
    """
    with suppress(subprocess.TimeoutExpired):
        process.wait(TOOL_TIMEOUT_S)
    with suppress(ProcessLookupError):  # it may have had no group of its own, or left nobody
        os.killpg(process.pid, signal.SIGKILL)
    process.kill()
    _, said = process.communicate()
    return said.decode(errors="replace").strip() if said else ""
