"""Whether submissions can be sandboxed on this machine, and what to do if not."""

from __future__ import annotations

import os
import platform
import shlex
import shutil
import socket
import subprocess
import sys
import threading
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType

from autograder.sandbox import warm_starts
from autograder.sandbox.confinement.network import TOOL_TIMEOUT_S, SandboxStartError
from autograder.sandbox.isolation import Isolation, subject_command
from autograder.sandbox.prefork import ZygoteError
from autograder.sandbox.sandbox import Sandbox
from autograder.sandbox.unsandboxed import Unsandboxed
from course.errors import CourseError
from course.util import containers, executables

TOOLS = {
    "bwrap": "bubblewrap", "ip": "iproute2", "prlimit": "util-linux",
    "unshare": "util-linux", "nsenter": "util-linux", "setpriv": "util-linux",
}  # fmt: skip
TRUST = "or, if you trust every submission, grade with --trust-submissions"
PROFILE = Path(__file__).with_name("bwrap.apparmor")
_APPARMOR = Path("/proc/sys/kernel/apparmor_restrict_unprivileged_userns")


class SandboxError(CourseError):
    """There is no working sandbox here; the message says how to get one."""


@dataclass(frozen=True)
class Abilities:
    """What this machine can do: ``problem`` says in a sentence why there is no sandbox, if so.

    ``loss`` is whether a sandbox's network can be made to lose packets (it takes nftables);
    ``warm`` whether examiners and subjects can be forked from a process that is warm.
    """

    problem: str = ""
    loss: bool = False
    warm: bool = False

    def mode_name(self, *, trust: bool) -> str:
        """Return in a word how submissions are run: outcomes of two modes may differ."""
        if trust:
            return "trusted"
        return "sandboxed" if self.loss else "sandboxed without loss"


def platform_problem(system: str = sys.platform, machine: str | None = None) -> str:
    """Return why submissions cannot be graded on this kind of machine; empty if they can.

    What is refused to a submission, and how it is watched, is written for this system's calls.
    """
    machine = machine or platform.machine()
    if system == "linux" and machine.lower() in ("x86_64", "amd64"):
        return ""
    return (
        f"Submissions are graded on Linux x86-64 only, not on {system} {machine}: grade on such a "
        "machine; notebooks and their check cells run here."
    )


_trying = threading.Lock()


def abilities() -> Abilities:
    """Try a sandbox, once a process, and return what works."""
    with _trying:
        return _probe_abilities()


@cache
def _probe_abilities() -> Abilities:
    if problem := platform_problem():
        return Abilities(problem)
    missing = list(dict.fromkeys(TOOLS[tool] for tool in TOOLS if shutil.which(tool) is None))
    if missing:
        packages = " ".join(sorted({*missing, "bubblewrap", "iproute2", "nftables"}))
        lacking = f"{' and '.join(missing)} {'is' if len(missing) == 1 else 'are'} missing"
        return Abilities(
            f"Submissions cannot be sandboxed here because {lacking}: "
            f"run `sudo apt install {packages}`, {TRUST}."
        )
    with ThreadPoolExecutor() as pool:  # each mostly waits for one process
        loss, warm = pool.submit(_try_sandbox), pool.submit(_try_warm)
        pool.submit(
            warm_starts.examiner_zygote
        )  # it is needed next; the code that needs it gets the error
        try:
            return Abilities(loss=loss.result(), warm=warm.result())
        except SandboxStartError as error:
            return Abilities(_failure_advice(str(error)))


def warm_up() -> None:
    """Begin to try the sandbox, and to start what its processes are forked from; return at once.

    Code that needs one of them waits for it, and gets the error if something is wrong with it.
    """

    def begin() -> None:
        with suppress(Exception):
            abilities()

    threading.Thread(target=begin).start()


def choose_isolation(
    *,
    trust: bool = False,
    hidden: Iterable[Path] = (),
    exams: Mapping[str, bytes] = MappingProxyType({}),
) -> Isolation:
    """Return the isolation in which one submission is to run.

    Args:
        trust: run it on this machine as it is, with the rights of the user who grades.
        hidden: folders that a sandboxed submission must never see (the course root).
        exams: the files of exams that only a course root has, by path in it, for the examiner.

    Raises:
        SandboxError: nothing is graded here, or it is not trusted and there is no sandbox.
    """
    if problem := platform_problem():
        raise SandboxError(problem)
    if trust:
        return Unsandboxed(exams)
    require_sandbox()
    return Sandbox(hidden=hidden, exams=exams, warm=abilities().warm)


def require_sandbox() -> None:
    """Raise SandboxError unless submissions can be sandboxed here."""
    if problem := abilities().problem:
        raise SandboxError(problem)


def _try_sandbox() -> bool:
    """Run this Python in a sandbox; return whether its network can lose packets."""
    with Sandbox() as box:
        tool = executables.find_tool("nft")
        nft = f"{shlex.quote(tool)} add table inet probe" if tool else "false"
        with (
            _in_the_network(box, f"{nft} && echo yes; read -r _") as said,
            box.start([sys.executable, "-c", "import rclpy"], {}, ()) as subject,
        ):
            if subject.describe_end(TOOL_TIMEOUT_S) != "exit code 0":
                raise SandboxStartError(subject.explain_failure())
    return said == [b"yes"]


def _try_warm() -> bool:
    """Return whether a subject can be forked: without anything to run it ends at once."""
    try:
        with Sandbox(warm=True) as box, _in_the_network(box, "read -r _"), ExitStack() as stack:
            (engine, ours), (control, theirs) = socket.socketpair(), socket.socketpair()
            for end in (engine, ours, control, theirs):
                stack.enter_context(end)
            fds = [engine.fileno(), control.fileno()]
            command = subject_command(engine, control, box.domain_id)
            subject = stack.enter_context(box.start_subject(command, {}, fds))
            ours.close()
            return subject.describe_end(TOOL_TIMEOUT_S) == "exit code 1"
    except (SandboxStartError, ZygoteError):
        return False


@contextmanager
def _in_the_network(box: Sandbox, script: str) -> Iterator[list[bytes]]:
    """Make a sandbox's network and run a script in it until the end; yield what it says by then."""
    said: list[bytes] = []
    outer = box.run_in_network(
        ["sh", "-c", script],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    try:
        yield said
    finally:
        said += outer.communicate(b"\n", timeout=60)[0].split()


def _failure_advice(said: str) -> str:
    """Return one sentence about why bwrap failed and what helps."""
    reason = said.splitlines()[-1] if said else "it said nothing"
    restricted = _reads(_APPARMOR) == "1"
    if container := containers.name_container(os.environ):
        host = f", with {PROFILE} as its host's /etc/apparmor.d/bwrap" if restricted else ""
        return (
            "Submissions cannot be sandboxed here because this container may not make namespaces "
            f"({reason}): {containers.advise_grading(container)}{host}, {TRUST}."
        )
    if restricted:
        return (
            "Submissions cannot be sandboxed here because this system's AppArmor keeps bubblewrap "
            f"from making namespaces ({reason}): allow it with `sudo cp {PROFILE} "
            f"/etc/apparmor.d/bwrap && sudo apparmor_parser -r /etc/apparmor.d/bwrap`, {TRUST}."
        )
    if _reads(Path("/proc/sys/kernel/unprivileged_userns_clone")) == "0":
        return (
            f"Submissions cannot be sandboxed here because user namespaces are off ({reason}): "
            f"turn them on with `sudo sysctl kernel.unprivileged_userns_clone=1`, {TRUST}."
        )
    return (
        f"Submissions cannot be sandboxed here because bubblewrap fails ({reason}): if this is a "
        "container, start it with the right to make namespaces (docker run --privileged, for "
        f"instance), {TRUST}."
    )


def _reads(path: Path) -> str:
    try:
        return path.read_text(encoding="ascii").strip()
    except OSError:
        return ""
