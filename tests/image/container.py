"""A container of the image, as Docker would start it: run by crun, which needs no daemon.

Its user is the image's, it has Docker's capabilities and a network of its own, and either what
Docker forbids unless it is told otherwise, or what ``.devcontainer/seccomp.json`` allows.
"""

from __future__ import annotations

import json
import subprocess
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

ROOT = Path(__file__).parents[2]
PROFILE = ROOT / ".devcontainer" / "seccomp.json"
USER, HOME = 1000, "/home/student"
NAMESPACES = ("pid", "network", "ipc", "uts", "mount")
CAPABILITIES = (
    "CHOWN", "DAC_OVERRIDE", "FOWNER", "FSETID", "KILL", "SETGID", "SETUID", "SETPCAP",
    "NET_BIND_SERVICE", "NET_RAW", "SYS_CHROOT", "MKNOD", "AUDIT_WRITE", "SETFCAP",
)  # fmt: skip
"""What a user who is not root has none of, but could be given by a program."""
MASKED = ["/proc/acpi", "/proc/kcore", "/proc/keys", "/proc/timer_list", "/sys/firmware"]
READ_ONLY = ["/proc/bus", "/proc/fs", "/proc/irq", "/proc/sys", "/proc/sysrq-trigger"]

_NEW_USER_NAMESPACE = 0x10000000
_ENOSYS = 38
REFUSES_NAMESPACES: dict[str, Any] = {
    "defaultAction": "SCMP_ACT_ALLOW",
    "syscalls": [
        {
            "names": ["unshare", "setns", "mount", "umount2", "pivot_root"],
            "action": "SCMP_ACT_ERRNO",
        },
        {
            "names": ["clone"],
            "action": "SCMP_ACT_ERRNO",
            "args": [
                {
                    "index": 0,
                    "op": "SCMP_CMP_MASKED_EQ",
                    "value": _NEW_USER_NAMESPACE,
                    "valueTwo": _NEW_USER_NAMESPACE,
                }
            ],
        },
        {"names": ["clone3"], "action": "SCMP_ACT_ERRNO", "errnoRet": _ENOSYS},
    ],
}
"""What Docker's own profile has against a sandbox."""

_CRUN = (
    "unshare", "--mount", "sh", "-c", 'mount -t tmpfs tmpfs /sys/fs/cgroup && exec "$0" "$@"',
    "crun", "--cgroup-manager=disabled",
)  # fmt: skip
"""A container takes no control group; crun refuses some layouts of them all the same if it sees
them (where version 2 is mounted beside 1, for instance)."""


@dataclass(frozen=True)
class Container:
    """A container whose files are those in ``files``; what is written to them stays."""

    files: Path
    may_grade: bool = False

    def run(self, *command: str, timeout_s: float) -> subprocess.CompletedProcess[str]:
        """Run a command in the image, as its user, and return how it ended and what it said.

        Raises:
            subprocess.TimeoutExpired: it has been stopped.
        """
        with TemporaryDirectory(prefix="container-") as bundle:
            Path(bundle, "config.json").write_text(json.dumps(self._configure(command)))
            crun = [*_CRUN, "--root", f"{bundle}/state"]
            try:
                return subprocess.run(
                    [*crun, "run", "--bundle", bundle, Path(bundle).name],
                    stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                    text=True, timeout=timeout_s, check=False,
                )  # fmt: skip
            finally:
                gone = [*crun, "delete", "--force", Path(bundle).name]
                subprocess.run(gone, capture_output=True, timeout=60, check=False)

    def _configure(self, command: tuple[str, ...]) -> dict[str, Any]:
        """Return the configuration (OCI runtime specification 1.0) of a container."""
        profile = json.loads(PROFILE.read_text()) if self.may_grade else REFUSES_NAMESPACES
        return {
            "ociVersion": "1.0.0",
            "process": {
                "user": {"uid": USER, "gid": USER},
                "args": ["tini", "-g", "--", *command],
                "env": [
                    "PATH=/opt/ros2-course/bin:/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:"
                    "/sbin:/bin",
                    f"HOME={HOME}", "LANG=C.UTF-8",
                ],
                "cwd": HOME,
                "capabilities": {"bounding": [f"CAP_{name}" for name in CAPABILITIES]},
            },
            "root": {"path": str(self.files)},
            "mounts": _mounts(),
            "linux": {
                "namespaces": [{"type": kind} for kind in NAMESPACES],
                "seccomp": profile,
                "maskedPaths": [] if self.may_grade else MASKED,
                "readonlyPaths": [] if self.may_grade else READ_ONLY,
            },
        }  # fmt: skip


def _mounts() -> list[dict[str, Any]]:
    safe = ["nosuid", "noexec", "nodev"]
    return [
        {"destination": "/proc", "type": "proc", "source": "proc", "options": safe},
        {"destination": "/dev", "type": "tmpfs", "source": "tmpfs",
         "options": ["nosuid", "strictatime", "mode=755", "size=65536k"]},
        {"destination": "/dev/pts", "type": "devpts", "source": "devpts",
         "options": ["nosuid", "noexec", "newinstance", "ptmxmode=0666", "mode=0620"]},
        {"destination": "/dev/shm", "type": "tmpfs", "source": "shm",
         "options": [*safe, "mode=1777", "size=256m"]},
        {"destination": "/sys", "type": "sysfs", "source": "sysfs", "options": [*safe, "ro"]},
        {"destination": "/tmp", "type": "tmpfs", "source": "tmpfs",
         "options": ["nosuid", "nodev", "mode=1777"]},
    ]  # fmt: skip
