"""The sandbox of one submission: a network of its own with an examiner in it, and a subject.

The outer part is a network namespace with nothing but a loopback that DDS can discover over. The
subject joins that network in namespaces of its own for processes, files, IPC and, unless root
grades, users; so does the examiner, who parses what the subject sends, in others. Root instead
gives each a user id that nobody else has, because the kernel does not count root's processes. A
warden, which is in the network only, tells the examiner what it needs to know of the subject's
processes.
"""

from __future__ import annotations

import os
import secrets
import socket
import subprocess
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple, Self

from autograder.processes import python_module
from autograder.sandbox import warm_starts
from autograder.sandbox.confinement import environment_variables, network, seccomp, visible_files
from autograder.sandbox.isolation import StartedProcess
from autograder.sandbox.resource_limits import Limits
from autograder.sandbox.sandboxed_subject import SandboxedSubject, Warden, WarmSubject, end_process
from autograder.sandbox.unsandboxed import tether_command, write_files
from autograder.util.work_files import scratch_folder
from course.runtime.domains.leases import MAX_DOMAIN

USER = 1000
"""The subject's user id as it sees it, where it has a user namespace."""

HOLDER = ("sh", "-c", "echo up; exec sleep infinity >/dev/null 2>&1")
"""What holds a sandbox open for a subject: it says that the sandbox is there, and only waits."""


EXAMINERS_HOLDER = ("sh", "-c", f"(:); (:); (:); (:); (:); (:); (:); (:); {HOLDER[-1]}")
"""The same for an examiner, whose process number is thereby not its subject's.

Fast DDS makes a participant's GUID of the host, that number and 16 random bits: of two that are
equal, each takes the other's for itself, and hears nothing of it.
"""


class Sandbox:
    """The namespaces of one submission."""

    domain_id = MAX_DOMAIN  # all are ours alone here; a program that names one names another

    def __init__(
        self,
        limits: Limits | None = None,
        hidden: Iterable[Path] = (),
        exams: Mapping[str, bytes] = MappingProxyType({}),
        *,
        warm: bool = False,
    ) -> None:
        """Prepare a sandbox.

        Args:
            limits: what the submission may use.
            hidden: folders that must not be seen even if they lie within this Python's folders.
            exams: the files of exams that the examiner is given, by path in a course root.
            warm: examiner and subject are forked from processes that have imported everything.
        """
        self._limits = limits or Limits()
        self._hidden = tuple(hidden)
        self._exams = exams
        self.course = visible_files.COURSE if exams else None
        self._warm = warm
        self._namespaces: dict[str, int] = {}
        self._held = ExitStack()
        self._warden: Warden | None = None

    def spawn(self, command: Sequence[str], **options: Any) -> StartedProcess:
        """Make the network, and start the warden and the examiner.

        Raises:
            SandboxStartError: there is no such network to be had, or the sandbox's tools refuse.
        """
        self._make_network()
        asked, asks = socket.socketpair()
        with asked, asks:
            warden = self._held.enter_context(Warden(self._start_warden(asked)))
            command = [*command, "--outside", str(asks.fileno())]
            fds = [*options.pop("pass_fds", ()), asks.fileno()]
            examiner, warden.examiner = self._start_examiner(command, fds, options)
        self._warden = warden
        return examiner

    def run_in_network(self, command: Sequence[str], **options: Any) -> subprocess.Popen[bytes]:
        """Run a command of ours in the network, and else as everything of ours runs.

        Raises:
            SandboxStartError: there is no such network to be had.
        """
        self._make_network()
        joined = [*network.join_prefix(self._namespaces), *tether_command(command)]
        return network.start_tool(joined, **options)

    def _make_network(self) -> None:
        if not self._namespaces:
            owner = warm_starts.subject_zygote().pid if self._warm else None
            self._namespaces = network.make_network(owner)

    def _start_warden(self, asked: socket.socket) -> StartedProcess:
        arguments = ["--examiner", str(asked.fileno())]
        if self._warm:
            return warm_starts.fork_warden(arguments, [asked.fileno()], self._namespaces)
        return self.run_in_network(
            [*python_module.command(warm_starts.WARDEN), *arguments], pass_fds=[asked.fileno()],
            stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip

    def _start_examiner(
        self, command: Sequence[str], fds: Sequence[int], options: Mapping[str, Any]
    ) -> tuple[StartedProcess, int]:
        """Start the examiner in a sandbox of its own; return it, and the sandbox's process 1."""
        limits = Limits.of_examiner()
        arguments = warm_starts.arguments_of(command, warm_starts.EXAMINER) if self._warm else None
        bounds = [f"--{name}={most}" for name, most in limits.of_processes().items()]
        with ExitStack() as stack:
            user, holder = _choose_user(), _choose_user()
            exams = {visible_files.COURSE: self._exams} if self._exams else {}
            sandbox = _Sandbox(limits, environment_variables.examiner_environment(), exams)
            if arguments is None:
                streams = {name: options.get(name) for name in ("stdin", "stdout", "stderr")}
                command = ["prlimit", *bounds, "--", *command]
                process, init = self._start_enclosed(
                    command, user, user, sandbox, stack, fds, **streams
                )  # fmt: skip
                self._held.push(SandboxedSubject(process, init, limits, stack.pop_all()))
                return process, init
            process, init = self._start_enclosed(
                EXAMINERS_HOLDER, user, holder, sandbox, stack, (), stdout=subprocess.PIPE
            )
            enclosed = SandboxedSubject(process, init, limits, stack.pop_all())
            self._held.push(enclosed)
            enclosed.require_holder()
            as_user = user if network.is_root() else None
            examiner = warm_starts.fork_examiner(arguments, fds, enclosed.handle, as_user, limits)
            self._held.callback(end_process, examiner)
            return examiner, init

    def start_subject(
        self, command: Sequence[str], files: Mapping[str, bytes], fds: Sequence[int]
    ) -> SandboxedSubject:
        """Start the subject in the network, with everything else its own.

        Raises:
            SandboxStartError: the sandbox's tools refuse.
        """
        command = [
            *command,
            "--limits",
            self._limits.to_json(),
            "--files",
            str(visible_files.HANDED_IN),
        ]
        if (
            self._warm
            and (arguments := warm_starts.arguments_of(command, warm_starts.SUBJECT)) is not None
        ):
            return self._fork_subject(arguments, files, fds)
        return self.start(command, files, fds)

    def start(
        self, command: Sequence[str], files: Mapping[str, bytes], fds: Sequence[int]
    ) -> SandboxedSubject:
        """Start any command as `start_subject` does, without options for a subject."""
        with ExitStack() as stack:
            user = _choose_user()
            process, init = self._start_enclosed(
                command,
                user,
                user,
                self._subject_sandbox(files),
                stack,
                fds,
                stdout=subprocess.DEVNULL,
            )
            return SandboxedSubject(process, init, self._limits, stack.pop_all(), self._warden)

    def _fork_subject(
        self, arguments: Sequence[str], files: Mapping[str, bytes], fds: Sequence[int]
    ) -> WarmSubject:
        """Make the sandbox around a process that only waits, and fork the subject into it."""
        with ExitStack() as stack:
            user = _choose_user()
            # Root's subject is another user than what holds its sandbox, and cannot touch that.
            process, init = self._start_enclosed(
                HOLDER,
                user,
                _choose_user(),
                self._subject_sandbox(files),
                stack,
                (),
                stdout=subprocess.PIPE,
            )
            subject = WarmSubject(process, init, self._limits, stack.pop_all(), self._warden)
            stack.push(subject)
            subject.fork(arguments, fds, user if network.is_root() else None)
            stack.pop_all()
            return subject

    def _subject_sandbox(self, files: Mapping[str, bytes]) -> _Sandbox:
        return _Sandbox(
            self._limits,
            environment_variables.submission_environment(),
            {visible_files.HANDED_IN: files},
        )

    def _start_enclosed(
        self,
        command: Sequence[str],
        named: int,
        user: int,
        sandbox: _Sandbox,
        stack: ExitStack,
        fds: Sequence[int],
        *,
        stdin: int | None = subprocess.DEVNULL,
        stdout: int | None = None,
        stderr: int | None = subprocess.PIPE,
    ) -> tuple[subprocess.Popen[bytes], int]:
        """Start a command in a sandbox; return bwrap's process and the sandbox's process 1.

        ``named`` is the user id that its files call the student's, ``user`` that of the command.
        """
        given = _Given(stack)
        # Through a descriptor, so that the sandbox's process 1 does not tell them.
        arguments = given.add_file("\0".join(self._bwrap_arguments(given, named, sandbox)).encode())
        info, info_end = os.pipe()
        bwrap = ["bwrap", "--args", arguments, "--info-fd", str(info_end), "--"]
        command = [*bwrap, *(_as_user(user) if network.is_root() else []), *command]
        try:
            process = network.start_tool(
                [*network.join_prefix(self._namespaces), *command],
                env={"PATH": os.environ.get("PATH", os.defpath)}, start_new_session=True,
                pass_fds=[*given.descriptors, info_end, *fds],
                stdin=stdin, stdout=stdout, stderr=stderr,
            )  # fmt: skip
        finally:
            os.close(info_end)
        return process, network.child(info, process)

    def _bwrap_arguments(self, given: _Given, user: int, sandbox: _Sandbox) -> Iterator[str]:
        """Yield bwrap's arguments."""
        yield from network.own_user(USER)
        yield from ("--unshare-pid", "--unshare-ipc", "--unshare-uts", "--unshare-cgroup-try")
        yield from ("--hostname", "robot", "--die-with-parent", "--new-session")
        yield from ("--perms", "0755", "--dir", "/etc")
        for path, text in visible_files.sandbox_files(user).items():
            yield from ("--perms", "0644", "--ro-bind-data", given.add_file(text.encode()), path)
        folders = {place: given.add_folder(files) for place, files in sandbox.files.items()}
        yield from visible_files.bwrap_arguments(sandbox.limits, folders, self._hidden)
        for name, value in sandbox.variables.items():
            yield from ("--setenv", name, value)
        yield from ("--seccomp", given.add_file(seccomp.filter_program()))

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Let everything go; the network ends with the last process in it."""
        self._held.close()
        while self._namespaces:
            os.close(self._namespaces.popitem()[1])


class _Sandbox(NamedTuple):
    """What makes a sandbox the subject's or the examiner's; ``files`` are given it, by folder."""

    limits: Limits
    variables: Mapping[str, str]
    files: Mapping[Path, Mapping[str, bytes]]


class _Given:
    """What a sandbox is given: descriptors to read from, and a folder; ``stack`` takes it back."""

    def __init__(self, stack: ExitStack) -> None:
        self._stack = stack
        self.descriptors: list[int] = []

    def add_file(self, content: bytes) -> str:
        """Return the number of a descriptor to read ``content`` from."""
        descriptor = os.memfd_create("sandbox", os.MFD_CLOEXEC)
        self._stack.callback(os.close, descriptor)
        os.write(descriptor, content)
        os.lseek(descriptor, 0, os.SEEK_SET)
        self.descriptors.append(descriptor)
        return str(descriptor)

    def add_folder(self, files: Mapping[str, bytes]) -> Path:
        """Return a folder with ``files`` that every user can read."""
        folder = self._stack.enter_context(scratch_folder())
        write_files(folder, files)
        for path in (folder, *folder.rglob("*")):
            path.chmod(0o755 if path.is_dir() else 0o644)
        return folder


def _choose_user() -> int:
    return secrets.choice(network.UIDS) if network.is_root() else USER


def _as_user(uid: int) -> list[str]:
    return [
        "setpriv", "--reuid", str(uid), "--regid", str(uid), "--clear-groups",
        "--inh-caps=-all", "--bounding-set=-all", "--no-new-privs",
    ]  # fmt: skip
