"""A control group of each submission's own, where this machine gives us some to make.

The kernel then counts all that a submission has it hold, and ends its processes when that is too
much. It is in addition to the limits of each process and to `ResourceWatch`, which count
everywhere.
"""

from __future__ import annotations

import os
import secrets
import threading
from contextlib import suppress
from pathlib import Path

from autograder.sandbox.resource_limits import Limits
from course.util import cgroups

_dividing = threading.Lock()
_divided: dict[int, Path | None] = {}  # by the process that has done it


def parent_group() -> Path | None:
    """Return the group in which those of submissions are made; None if there is none."""
    with _dividing:
        if os.getpid() not in _divided:
            _divided[os.getpid()] = enable_controllers(cgroups.delegated_group())
        return _divided[os.getpid()]


def enable_controllers(group: Path | None) -> Path | None:
    """Have a group's controllers count for each group in it; return it, None if that fails."""
    if group is None:
        return None
    ours = group / cgroups.OURS
    try:
        ours.mkdir(exist_ok=True)
        for pid in (group / "cgroup.procs").read_text(encoding="ascii").split():
            with suppress(ProcessLookupError):
                (ours / "cgroup.procs").write_text(pid)
        (group / "cgroup.subtree_control").write_text("+memory +pids")
    except OSError:
        return None
    return group


class ControlGroup:
    """The group of one submission."""

    def __init__(self, above: Path, limits: Limits) -> None:
        """Make it in ``above``.

        Raises:
            OSError: that is not possible.
        """
        self._path = above / f"submission-{secrets.token_hex(8)}"
        self._path.mkdir()
        bounds = {"memory.max": limits.memory, "memory.swap.max": 0, "pids.max": limits.tasks}
        for name, bound in bounds.items():
            (self._path / name).write_text(str(bound))

    def add_process(self, pid: int) -> None:
        """Put a process into it, and so all that it starts from now on.

        Raises:
            OSError: it has ended, or may not be moved.
        """
        (self._path / "cgroup.procs").write_text(str(pid))

    def close(self) -> None:
        """Remove it; whatever was in it has ended."""
        with suppress(OSError):
            self._path.rmdir()


def enclose_process(pid: int, limits: Limits) -> ControlGroup | None:
    """Put a process into a group of its own if possible; `ResourceWatch` counts anyway."""
    above = parent_group()
    if above is None:
        return None
    try:
        group = ControlGroup(above, limits)
    except OSError:
        return None
    with suppress(OSError):
        group.add_process(pid)
    return group
