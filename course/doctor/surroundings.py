"""Where this machine runs: in a container, or in Windows' WSL, and what matters there."""

from __future__ import annotations

import os
import platform
from collections.abc import Iterator, Mapping
from pathlib import Path

from course.doctor.finding import HealthFinding, make_ok, make_problem, make_warning

ROOT = Path("/")
_CONTAINER_MARKS = (".dockerenv", "run/.containerenv")
"""Files that Docker and Podman make in each container."""


def examine_surroundings(
    environment: Mapping[str, str] = os.environ,
    release: str | None = None,
    root: Path = ROOT,
    folder: Path | None = None,
) -> Iterator[HealthFinding]:
    """Yield what there is to say about WSL and containers; nothing on a machine of its own.

    Args:
        environment: such as ``os.environ``.
        release: the kernel's, as `platform.release` gives it.
        root: where the file system begins.
        folder: where notebooks are saved; the working folder if left out.
    """
    release = (platform.release() if release is None else release).lower()
    container = name_container(environment, root)
    if container:
        yield make_ok("container", describe_container(container))
    elif "microsoft" in release:
        yield from _examine_wsl(release, Path.cwd() if folder is None else folder)


def name_container(environment: Mapping[str, str], root: Path = ROOT) -> str:
    """Return what kind of container this is; empty if it is none that is known."""
    if environment.get("CODESPACES") == "true":
        return "Codespaces"
    if "KUBERNETES_SERVICE_HOST" in environment:
        return "Kubernetes"
    if (root / _CONTAINER_MARKS[0]).exists():
        return "Docker"
    return "Podman" if (root / _CONTAINER_MARKS[1]).exists() else ""


def describe_container(kind: str) -> str:
    """Return what a container changes for a student, in two sentences."""
    return (
        f"this is one of {kind}, with a network of its own unless it was started with "
        "--network=host: nodes in it hear each other, and none outside. Files that are not on a "
        "volume go with it"
    )


def _examine_wsl(release: str, folder: Path) -> Iterator[HealthFinding]:
    name = "WSL"
    if "wsl2" not in release and "microsoft-standard" not in release:
        yield make_problem(
            name,
            "This is WSL 1, whose network lacks what DDS needs.",
            "In PowerShell: `wsl --set-version Ubuntu 2`.",
        )
        return
    if folder.parts[:2] == ("/", "mnt") and len(folder.parts) > 2 and len(folder.parts[2]) == 1:
        yield make_warning(
            name,
            f"{folder} lies on a Windows disk, where each file takes many times as long.",
            "Work in a folder of your Linux home: `cd ~`.",
        )
        return
    yield make_ok(
        name,
        "WSL 2: nodes in it hear each other; robots in your network are reached with "
        "networkingMode=mirrored in .wslconfig only",
    )
