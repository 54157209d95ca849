"""No sandbox: a submission that is trusted runs with the rights of the user who grades it."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
from collections.abc import Mapping, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from types import MappingProxyType
from typing import Any, Self

from autograder.processes.fair_deadline import RunDelay, of_process
from autograder.sandbox.confinement.environment_variables import INLINE
from autograder.sandbox.isolation import END_TIMEOUT_S, StartedProcess
from autograder.util.work_files import scratch_folder
from course.runtime.domains.leases import lease_domain


class Unsandboxed:
    """This machine as it is: only the ROS domain is the submission's own."""

    def __init__(self, exams: Mapping[str, bytes] = MappingProxyType({})) -> None:
        """Lease a domain; ``exams`` are files for the examiner, by path in a course root."""
        self._held = ExitStack()
        lease = lease_domain()
        self._held.callback(lease.release)
        self.domain_id = lease.domain_id
        self.course = self._held.enter_context(scratch_folder()) if exams else None
        if self.course is not None:
            write_files(self.course, exams)

    def spawn(self, command: Sequence[str], **options: Any) -> StartedProcess:
        """Start the examiner."""
        return subprocess.Popen(tether_command(command), **options)

    def start_subject(
        self, command: Sequence[str], files: Mapping[str, bytes], fds: Sequence[int]
    ) -> UnsandboxedSubject:
        """Start the subject in a folder of its own."""
        return UnsandboxedSubject(command, files, fds)

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Give the domain back."""
        self._held.close()


class UnsandboxedSubject:
    """A running subject: started in a session of its own, and ended with that session."""

    unwatched = False

    def __init__(
        self, command: Sequence[str], files: Mapping[str, bytes], fds: Sequence[int]
    ) -> None:
        """Start it."""
        self._held = ExitStack()
        home = str(self._held.enter_context(scratch_folder()))
        write_files(Path(home), files)
        cache = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
        env = {
            **os.environ, "HOME": home, "XDG_CACHE_HOME": cache, "IPYTHONDIR": f"{home}/.ipython",
            "ROS_LOG_DIR": f"{home}/log", "MPLBACKEND": INLINE,
        }  # fmt: skip
        self._process = subprocess.Popen(
            tether_command(command), cwd=home, env=env, start_new_session=True, pass_fds=fds,
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        self.pid = self._process.pid
        self.delay: RunDelay = of_process(self.pid)

    def describe_excess(self, timeout: float = 0.0) -> str:
        """Return nothing: nobody watches what it uses."""
        return ""

    def ready(self) -> None:
        """Need nothing: the process is the one that was started."""

    def tell_warden(self) -> None:
        """Tell nobody: there is no warden."""

    def explain_failure(self) -> str:
        """Return why it did not start, in words."""
        return self.describe_end()

    def describe_end(self, timeout: float = END_TIMEOUT_S) -> str:
        """Return in words how the process ended, or that it has not within ``timeout`` seconds."""
        with suppress(subprocess.TimeoutExpired):
            return fate_of(self._process.wait(timeout))
        return "it closed its connection to the grader"

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """End the process and its session, and remove what it left."""
        # A process that is killed cannot remove its DDS shared memory, so it is removed for it.
        segments = _shared_memory(self._process.pid)
        with suppress(ProcessLookupError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
        for segment in segments:
            segment.unlink(missing_ok=True)
        self._held.close()


def tether_command(command: Sequence[str]) -> list[str]:
    """Return a command that is killed when the process that starts it dies, by ``kill -9`` too.

    It dies with the thread that starts it: one that sees the whole run through.
    """
    setpriv = shutil.which("setpriv")
    return [*([setpriv, "--pdeathsig", "KILL", "--"] if setpriv else []), *command]


def write_files(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write ``files``, by relative path, into ``folder``."""
    for name, content in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)


def fate_of(code: int) -> str:
    """Return what an exit code says; a negative one is the number of a signal."""
    return f"exit code {code}" if code >= 0 else f"killed by {signal.Signals(-code).name}"


def _shared_memory(pid: int) -> set[Path]:
    try:
        maps = Path(f"/proc/{pid}/maps").read_text()
    except OSError:
        return set()
    paths = (
        line.split(maxsplit=5)[-1] for line in maps.splitlines() if "/dev/shm/fastrtps_" in line
    )
    return {Path(path) for path in paths}
