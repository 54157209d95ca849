"""Containers: which kind this one is, and how it is started so that submissions can be graded."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

ROOT = Path("/")
_MARKS = {".dockerenv": "Docker", "run/.containerenv": "Podman"}
"""Files that Docker and Podman make in each container."""

PROFILE = Path(sys.prefix, "share", "ros2-course", "seccomp.json")
"""Where the course's image has the system calls that Docker is to allow."""
_TRIAL = ("unshare", "--user", "--map-root-user", "--pid", "--fork", "--mount-proc", "true")
_TRIAL_TIMEOUT_S = 10.0


def name_container(environment: Mapping[str, str], root: Path = ROOT) -> str:
    """Return what kind of container this is; empty if it is none that is known.

    Args:
        environment: such as ``os.environ``.
        root: where the file system begins.
    """
    if environment.get("CODESPACES") == "true":
        return "Codespaces"
    if "KUBERNETES_SERVICE_HOST" in environment:
        return "Kubernetes"
    return next((kind for mark, kind in _MARKS.items() if (root / mark).exists()), "")


def allows_sandbox() -> bool:
    """Return whether namespaces and a /proc of their own can be made here, as a sandbox needs."""
    try:
        return (
            subprocess.run(
                _TRIAL, stdin=subprocess.DEVNULL, capture_output=True, timeout=_TRIAL_TIMEOUT_S
            ).returncode
            == 0
        )
    except (OSError, subprocess.TimeoutExpired):
        return False


def advise_grading(kind: str) -> str:
    """Return how a container of this kind is started so that submissions can be sandboxed in it.

    Docker's own profile of system calls refuses namespaces, its mask on /proc refuses one to
    them, and its AppArmor profile, where there is AppArmor, refuses mounts. Podman's refuses
    only what the mask does.
    """
    if kind == "Codespaces":
        return "grade on a machine of your own, as no Codespace is started with the right to that"
    if kind == "Podman":
        return "start it with `--security-opt unmask=ALL`"
    if kind == "Kubernetes":
        start = "give its pod hostUsers: false, and procMount: Unmasked and seccomp.json as profile"
    else:
        start = (
            "start it with `--security-opt seccomp=seccomp.json "
            "--security-opt systempaths=unconfined --security-opt apparmor=unconfined`"
        )
    return f"{start} ({_name_profile()})"


def _name_profile() -> str:
    if PROFILE.is_file():
        return f"the file: `docker run --rm IMAGE cat {PROFILE} > seccomp.json`"
    return "the file lies in the course's folder .devcontainer"
