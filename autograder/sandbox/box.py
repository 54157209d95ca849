"""The sandbox of one submission: a network of its own with an examiner in it, and a subject.

The outer part is a network namespace with nothing but a loopback that DDS can discover over; the
examiner runs there and sees files and processes as ever. The subject joins that network in
namespaces of its own for processes, files, IPC and, unless root grades, users. Root instead gives
each subject a user id that nobody else has, because the kernel does not count root's processes.
"""

from __future__ import annotations

import os
import secrets
import subprocess
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Self

from autograder.files import scratch_folder
from autograder.sandbox import environment, network, seccomp, view, warmth
from autograder.sandbox.boxed import BoxedSubject, WarmSubject
from autograder.sandbox.host import tethered, write_files
from autograder.sandbox.limits import MIB, Limits
from autograder.sandbox.place import Process
from course.domains import MAX_DOMAIN

USER = 1000
"""The subject's user id as it sees it, where it has a user namespace."""

EXAMINER_DATA = 3 * 1024 * MIB
"""Bytes of writable memory that an examiner may reserve."""

HOLDER = ("sh", "-c", "echo up; exec sleep infinity >/dev/null 2>&1")
"""What holds a sandbox open for a subject: it says that the sandbox is there, and only waits."""


class Box:
    """The namespaces of one submission."""

    domain_id = MAX_DOMAIN  # all are ours alone here; a program that names one names another
    own_network = True

    def __init__(
        self, limits: Limits | None = None, hidden: Iterable[Path] = (), *, warm: bool = False
    ) -> None:
        """Prepare a sandbox.

        Args:
            limits: what the submission may use.
            hidden: folders that it must not see even if they lie within this Python's folders.
            warm: examiner and subject are forked from processes that have imported everything.
        """
        self._limits = limits or Limits()
        self._hidden = tuple(hidden)
        self._warm = warm
        self._namespaces: dict[str, int] = {}

    def spawn(self, command: Sequence[str], **options: Any) -> Process:
        """Make the network and start the examiner in it.

        Raises:
            BoxError: there is no such network to be had.
        """
        owner = warmth.subjects().pid if self._warm else None
        self._namespaces = network.make(owner)
        variables = {**(options.pop("env", None) or os.environ), **environment.DDS}
        # A flood of messages ends the examiner, not the machine.
        if self._warm and (arguments := warmth.arguments_of(command, warmth.EXAMINER)) is not None:
            return warmth.examiner(
                arguments, options["pass_fds"], variables, self._namespaces, EXAMINER_DATA
            )
        bound = ["prlimit", f"--data={EXAMINER_DATA}", "--"]
        joined = [*network.joining(self._namespaces), *tethered([*bound, *command])]
        return network.start(joined, env=variables, **options)

    def start_subject(
        self, command: Sequence[str], files: Mapping[str, bytes], fds: Sequence[int]
    ) -> BoxedSubject:
        """Start the subject in the network, with everything else its own.

        Raises:
            BoxError: the sandbox's tools refuse.
        """
        command = [*command, "--limits", self._limits.to_json(), "--files", str(view.HANDED_IN)]
        if self._warm and (arguments := warmth.arguments_of(command, warmth.SUBJECT)) is not None:
            return self._fork(arguments, files, fds)
        return self.start(command, files, fds)

    def start(
        self, command: Sequence[str], files: Mapping[str, bytes], fds: Sequence[int]
    ) -> BoxedSubject:
        """Start any command as `start_subject` does, without options for a subject."""
        with ExitStack() as stack:
            user = _user()
            process, init = self._enclose(
                command, user, user, files, _Given(stack), fds, stdout=subprocess.DEVNULL
            )
            return BoxedSubject(process, init, self._limits, stack.pop_all())

    def _fork(
        self, arguments: Sequence[str], files: Mapping[str, bytes], fds: Sequence[int]
    ) -> WarmSubject:
        """Make the sandbox around a process that only waits, and fork the subject into it."""
        with ExitStack() as stack:
            user = _user()
            # Root's subject is another user than what holds its sandbox, and cannot touch that.
            process, init = self._enclose(
                HOLDER, user, _user(), files, _Given(stack), (), stdout=subprocess.PIPE
            )
            subject = WarmSubject(process, init, self._limits, stack.pop_all())
            stack.push(subject)
            subject.fork(arguments, fds, user if network.is_root() else None)
            stack.pop_all()
            return subject

    def _enclose(
        self,
        command: Sequence[str],
        named: int,
        user: int,
        files: Mapping[str, bytes],
        given: _Given,
        fds: Sequence[int],
        *,
        stdout: int,
    ) -> tuple[subprocess.Popen[bytes], int]:
        """Start a command in the sandbox; return bwrap's process and the sandbox's process 1.

        ``named`` is the user id that its files call the student's, ``user`` that of the command.
        """
        # Through a descriptor, so that the sandbox's process 1 does not tell them.
        arguments = given.file("\0".join(self._arguments(given, named, files)).encode())
        info, info_end = os.pipe()
        sandbox = ["bwrap", "--args", arguments, "--info-fd", str(info_end), "--"]
        command = [*sandbox, *(_as_user(user) if network.is_root() else []), *command]
        try:
            process = network.start(
                [*network.joining(self._namespaces), *command],
                env={"PATH": os.environ.get("PATH", os.defpath)}, start_new_session=True,
                pass_fds=[*given.descriptors, info_end, *fds],
                stdin=subprocess.DEVNULL, stdout=stdout, stderr=subprocess.PIPE,
            )  # fmt: skip
        finally:
            os.close(info_end)
        return process, network.child(info, process)

    def _arguments(self, given: _Given, user: int, files: Mapping[str, bytes]) -> Iterator[str]:
        """Yield bwrap's arguments."""
        yield from network.own_user(USER)
        yield from ("--unshare-pid", "--unshare-ipc", "--unshare-uts", "--unshare-cgroup-try")
        yield from ("--hostname", "robot", "--die-with-parent", "--new-session")
        yield from ("--perms", "0755", "--dir", "/etc")
        for path, text in view.written(user).items():
            yield from ("--perms", "0644", "--ro-bind-data", given.file(text.encode()), path)
        yield from view.arguments(self._limits, given.folder(files), self._hidden)
        for name, value in environment.submission().items():
            yield from ("--setenv", name, value)
        yield from ("--seccomp", given.file(seccomp.program()))

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Let the network go; it ends with the last process in it."""
        while self._namespaces:
            os.close(self._namespaces.popitem()[1])


class _Given:
    """What a sandbox is given: descriptors to read from, and a folder; ``stack`` takes it back."""

    def __init__(self, stack: ExitStack) -> None:
        self._stack = stack
        self.descriptors: list[int] = []

    def file(self, content: bytes) -> str:
        """Return the number of a descriptor to read ``content`` from."""
        descriptor = os.memfd_create("sandbox", os.MFD_CLOEXEC)
        self._stack.callback(os.close, descriptor)
        os.write(descriptor, content)
        os.lseek(descriptor, 0, os.SEEK_SET)
        self.descriptors.append(descriptor)
        return str(descriptor)

    def folder(self, files: Mapping[str, bytes]) -> Path:
        """Return a folder with ``files`` that every user can read."""
        folder = self._stack.enter_context(scratch_folder())
        write_files(folder, files)
        for path in (folder, *folder.rglob("*")):
            path.chmod(0o755 if path.is_dir() else 0o644)
        return folder


def _user() -> int:
    return secrets.choice(network.UIDS) if network.is_root() else USER


def _as_user(uid: int) -> list[str]:
    return [
        "setpriv", "--reuid", str(uid), "--regid", str(uid), "--clear-groups",
        "--inh-caps=-all", "--bounding-set=-all", "--no-new-privs",
    ]  # fmt: skip
