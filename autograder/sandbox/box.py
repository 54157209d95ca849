"""The sandbox of one submission: a network of its own with an examiner in it, and a subject.

The outer part is a network namespace with nothing but a loopback that DDS can discover over; the
examiner runs there and sees files and processes as ever. The subject joins that network in
namespaces of its own for processes, files, IPC and, unless root grades, users. Root instead gives
each subject a user id that nobody else has, because the kernel does not count root's processes.
"""

from __future__ import annotations

import os
import secrets
import signal
import subprocess
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any, Self

from autograder.files import scratch_folder
from autograder.sandbox import network, seccomp, view
from autograder.sandbox.host import fate_of, tethered, write_files
from autograder.sandbox.limits import MIB, Limits
from autograder.sandbox.watch import Watch
from course.interfaces import cache

USER = 1000
"""The subject's user id as it sees it, where it has a user namespace."""

EXAMINER_DATA = 3 * 1024 * MIB
"""Bytes of writable memory that an examiner may reserve."""

DDS = {
    # Two processes that share a network but not /dev/shm would find each other and then exchange
    # nothing: Fast DDS takes shared memory for granted on one host. LOCALHOST switches it back on.
    "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4",
    "ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET",
    "COURSE_DISCOVERY": "inherit",
    "FASTRTPS_DEFAULT_PROFILES_FILE": str(Path(__file__).with_name("fastdds.xml")),
}
KEPT = ("LANG", "LC_ALL", "LC_CTYPE", "TZ", "LD_LIBRARY_PATH", "_ROS_WHEELS_BOOTSTRAP_COMPLETE",
        "AMENT_PREFIX_PATH", "PYTHONWARNINGS")  # fmt: skip
"""What a subject gets of the grader's environment: no token, no path of the course."""


class Box:
    """The namespaces of one submission."""

    domain_id = 1  # the network is ours alone, and so is every domain on it
    own_network = True

    def __init__(self, limits: Limits | None = None, hidden: Iterable[Path] = ()) -> None:
        """Prepare a sandbox.

        Args:
            limits: what the submission may use.
            hidden: folders that it must not see even if they lie within this Python's folders.
        """
        self._limits = limits or Limits()
        self._hidden = tuple(hidden)
        self._namespaces: dict[str, int] = {}

    def spawn(self, command: Sequence[str], **options: Any) -> subprocess.Popen[bytes]:
        """Make the network and start the examiner in it.

        Raises:
            BoxError: there is no such network to be had.
        """
        self._namespaces = network.make()
        options["env"] = {**(options.get("env") or os.environ), **DDS}
        # A flood of messages ends the examiner, not the machine.
        bound = ["prlimit", f"--data={EXAMINER_DATA}", "--"]
        joined = [*network.joining(self._namespaces), *tethered([*bound, *command])]
        return network.start(joined, **options)

    def start_subject(
        self, command: Sequence[str], files: Mapping[str, bytes], fds: Sequence[int]
    ) -> BoxedSubject:
        """Start the subject in the network, with everything else its own.

        Raises:
            BoxError: the sandbox's tools refuse.
        """
        options = ["--limits", self._limits.to_json(), "--files", str(view.HANDED_IN)]
        return self.start([*command, *options], files, fds)

    def start(
        self, command: Sequence[str], files: Mapping[str, bytes], fds: Sequence[int]
    ) -> BoxedSubject:
        """Start any command as `start_subject` does, without options for a subject."""
        with ExitStack() as stack:
            user = secrets.choice(network.UIDS) if network.is_root() else USER
            given = _Given(stack)
            # Through a descriptor, so that the sandbox's process 1 does not tell them.
            arguments = given.file("\0".join(self._arguments(given, user, files)).encode())
            info, info_end = os.pipe()
            sandbox = ["bwrap", "--args", arguments, "--info-fd", str(info_end), "--"]
            command = [*sandbox, *(_as_user(user) if network.is_root() else []), *command]
            try:
                process = network.start(
                    [*network.joining(self._namespaces), *command],
                    env={"PATH": os.environ.get("PATH", os.defpath)}, start_new_session=True,
                    pass_fds=[*given.descriptors, info_end, *fds],
                    stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                )  # fmt: skip
            finally:
                os.close(info_end)
            return BoxedSubject(
                process, network.child(info, process), self._limits, stack.pop_all()
            )

    def _arguments(self, given: _Given, user: int, files: Mapping[str, bytes]) -> Iterator[str]:
        """Yield bwrap's arguments."""
        yield from network.own_user(USER)
        yield from ("--unshare-pid", "--unshare-ipc", "--unshare-uts", "--unshare-cgroup-try")
        yield from ("--hostname", "robot", "--die-with-parent", "--new-session")
        yield from ("--perms", "0755", "--dir", "/etc")
        for path, text in view.written(user).items():
            yield from ("--perms", "0644", "--ro-bind-data", given.file(text.encode()), path)
        yield from view.arguments(self._limits, given.folder(files), self._hidden)
        for name, value in _environment().items():
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


class BoxedSubject:
    """A running subject in its sandbox."""

    def __init__(
        self, process: subprocess.Popen[bytes], init: int, limits: Limits, held: ExitStack
    ) -> None:
        """Watch over the process namespace whose process 1 is ``init``."""
        self._process = process
        self._init = init
        self._held = held
        self._handle = os.pidfd_open(init)  # unlike its number, never another process's
        held.callback(os.close, self._handle)
        self._watch = Watch(init, self._handle, limits)
        self.pid = 0

    def ready(self) -> None:
        """Find the subject's process: the only one that process 1 has, as yet."""
        children = Path(f"/proc/{self._init}/task/{self._init}/children").read_text().split()
        self.pid = int(children[0]) if children else 0

    def fate(self) -> str:
        """Return how the process ended, in words."""
        try:
            code = self._process.wait(timeout=5)
        except subprocess.TimeoutExpired:
            return "it closed its connection to the grader"
        if self._watch.reason:
            return self._watch.reason
        # bwrap reports a signal as a shell does.
        is_signal = code > 128 and code - 128 in set(signal.Signals)
        return fate_of(128 - code if is_signal else code)

    def failed(self) -> str:
        """Return why it did not start, in words: how it ended, and what it last said."""
        fate = self.fate()
        if self._process.poll() is None:
            return fate
        assert self._process.stderr is not None
        said = self._process.stderr.read(65536).decode(errors="replace").strip().splitlines()
        return f"{fate} ({said[-1]})" if said else fate

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """End every process of the sandbox: they all go with process 1."""
        self._watch.stop()
        with suppress(ProcessLookupError):
            signal.pidfd_send_signal(self._handle, signal.SIGKILL)
        self._process.wait()
        if self._process.stderr is not None:
            self._process.stderr.close()
        self._held.close()


def _as_user(uid: int) -> list[str]:
    return [
        "setpriv", "--reuid", str(uid), "--regid", str(uid), "--clear-groups",
        "--inh-caps=-all", "--bounding-set=-all", "--no-new-privs",
    ]  # fmt: skip


def _environment() -> dict[str, str]:
    kept = {name: os.environ[name] for name in KEPT if name in os.environ}
    programs = f"{Path(sys.executable).parent}:/usr/local/bin:/usr/bin:/bin"
    home = str(view.HOME)
    return {
        **kept, **DDS, "PATH": programs, "HOME": home, "USER": "student", "LOGNAME": "student",
        "IPYTHONDIR": f"{home}/.ipython", "ROS_LOG_DIR": f"{home}/log", "MPLBACKEND": "Agg",
        "COURSE_INTERFACES_CACHE": str(cache.root()), "TMPDIR": "/tmp",
        # A numeric library's threads, one a processor of the machine, count as processes.
        "OPENBLAS_NUM_THREADS": "2", "OMP_NUM_THREADS": "2", "PYTHONDONTWRITEBYTECODE": "1",
    }  # fmt: skip
