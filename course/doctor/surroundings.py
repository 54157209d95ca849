"""Where this machine runs: in a container, or in Windows' WSL, and what matters there."""

from __future__ import annotations

import os
import platform
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from course.doctor.finding import HealthFinding, make_ok, make_problem, make_warning
from course.util import containers


def examine_surroundings(
    environment: Mapping[str, str] = os.environ,
    release: str | None = None,
    root: Path = containers.ROOT,
    folder: Path | None = None,
    allows_sandbox: Callable[[], bool] = containers.allows_sandbox,
) -> Iterator[HealthFinding]:
    """Yield what there is to say about WSL and containers; nothing on a machine of its own.

    Args:
        environment: such as ``os.environ``.
        release: the kernel's, as `platform.release` gives it.
        root: where the file system begins.
        folder: where notebooks are saved; the working folder if left out.
        allows_sandbox: says whether submissions can be sandboxed in this container.
    """
    release = (platform.release() if release is None else release).lower()
    container = containers.name_container(environment, root)
    if container:
        yield make_ok("container", describe_container(container))
        yield _judge_grading(container, allows_sandbox())
    elif "microsoft" in release:
        yield from _examine_wsl(release, Path.cwd() if folder is None else folder)


def describe_container(kind: str) -> str:
    """Return what a container changes for a student, in two sentences."""
    return (
        f"this is one of {kind}, with a network of its own unless it was started with "
        "--network=host: nodes in it hear each other, and none outside. Files that are not on a "
        "volume go with it"
    )


def _judge_grading(container: str, allowed: bool) -> HealthFinding:
    """Say whether submissions can be graded in a container: no student needs that."""
    name = "grading in this container"
    if allowed:
        return make_ok(name, "it may make the namespaces that a sandbox takes")
    return make_ok(
        name,
        "notebooks and their checks run, but no submission can be sandboxed. To grade here, "
        f"{containers.advise_grading(container)}",
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
