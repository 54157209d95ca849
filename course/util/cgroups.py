"""The control group (cgroups v2) that this process may divide further, if it was given one.

Systemd marks what it has delegated with an attribute. Root may write to every group, but what is
not marked is systemd's own to arrange.
"""

from __future__ import annotations

import os
from pathlib import Path

MOUNT = Path("/sys/fs/cgroup")
NEEDED = frozenset({"memory", "pids"})
MARKS = ("user.delegate", "trusted.delegate")
OURS = "grader"
"""The group in it that a grader moves to: a group that is divided can hold no process."""


def delegated_group(mount: Path = MOUNT, of: Path = Path("/proc/self/cgroup")) -> Path | None:
    """Return the group that was delegated to this process; None if there is none.

    Args:
        mount: where cgroups v2 are mounted.
        of: the process's table of groups.
    """
    try:
        rows = of.read_text(encoding="ascii").splitlines()
        name = next(row[3:] for row in rows if row.startswith("0::"))
        group = mount / name.lstrip("/")
        if group.name == OURS:  # a grader that started this process has divided it
            group = group.parent
        controllers = set((group / "cgroup.controllers").read_text(encoding="ascii").split())
    except (OSError, StopIteration, ValueError):
        return None
    marked = any(_read_attribute(group, mark) == b"1" for mark in MARKS)
    return group if marked and controllers >= NEEDED and os.access(group, os.W_OK) else None


def _read_attribute(path: Path, name: str) -> bytes:
    try:
        return os.getxattr(path, name)
    except OSError:
        return b""
