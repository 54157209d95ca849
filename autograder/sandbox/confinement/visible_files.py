"""The files that a submission sees: the system and this Python read-only, and a small scratch.

Not among them: home folders, the course root with its gradebook, sources and other submissions,
the exercises' solutions and corpora, and the host's processes, which a /proc of its own hides.
"""

from __future__ import annotations

import importlib.util
import os
import site
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import course
from autograder.sandbox.resource_limits import Limits
from autograder.util import exercise_folders
from course.interfaces.building import cache

HOME = Path("/home/student")
SCRATCH = (Path("/tmp"), HOME, Path("/dev/shm"))
"""Folders that can be written to, each a small file system in memory."""
HANDED_IN = Path("/run/handed-in")
"""Where a submission's other files lie, read-only; the subject copies them to its home."""
COURSE = Path("/run/course")
"""Where an examiner finds the exams that only a course root has, read-only."""

PACKAGES = ("autograder", "course", "quizzes")

_MERGED = ("bin", "lib", "lib32", "lib64", "libx32", "sbin")
_ETC = (
    "alternatives", "fonts", "ld.so.cache", "ld.so.conf", "ld.so.conf.d", "localtime", "mime.types",
)  # fmt: skip


def bwrap_arguments(
    limits: Limits, given: Mapping[Path, Path], hidden: Iterable[Path]
) -> Iterator[str]:
    """Yield bwrap's arguments for the files.

    Args:
        limits: has the size of the scratch folders.
        given: {where it is seen: the folder}, such as one with the submission's other files.
        hidden: folders that must not be seen even if they lie within something that is.
    """
    yield from _system_mounts()
    for scratch in SCRATCH:
        yield from _way_to(scratch)
        yield from ("--perms", "1777", "--size", str(limits.scratch), "--tmpfs", str(scratch))
    shown = list(python_folders())
    cached = cache.root()
    for folder in (*shown, *([cached] if cached.is_dir() else [])):
        yield from _way_to(folder)
        yield from ("--ro-bind", str(folder), str(folder))
    for place, folder in given.items():
        yield from _way_to(place)
        yield from ("--ro-bind", str(folder), str(place))
    for path in (*hidden, *_bundled_folders()):
        if _is_within(path, [Path("/usr"), *shown]):
            yield from _mask_path(path)
    # In /proc a process could have the machine spare it when memory runs out, or write to others.
    for mount in ("/proc", "/dev", "/"):
        yield from ("--remount-ro", mount)
    yield from ("--chdir", str(HOME))


def _mask_path(path: Path) -> Iterator[str]:
    """Yield what puts something empty in the place of a file or folder, if it is there."""
    if path.is_dir():
        yield from ("--tmpfs", str(path), "--remount-ro", str(path))
    elif path.exists():
        yield from ("--ro-bind", "/dev/null", str(path))


def _way_to(folder: Path) -> Iterator[str]:
    """Yield what makes the folders above a mount point: bwrap itself would lock others out."""
    for above in reversed(folder.parents[:-1]):
        yield from ("--perms", "0755", "--dir", str(above))


def _system_mounts() -> Iterator[str]:
    yield from ("--ro-bind", "/usr", "/usr")
    for name in _MERGED:
        folder = Path("/", name)
        if folder.is_symlink():
            yield from ("--symlink", str(folder.readlink()), str(folder))
        elif folder.is_dir():
            yield from ("--ro-bind", str(folder), str(folder))
    for name in _ETC:
        yield from ("--ro-bind-try", f"/etc/{name}", f"/etc/{name}")
    yield from ("--proc", "/proc", "--dev", "/dev")
    # A shared map of it is memory that the filter of system calls would refuse.
    yield from ("--ro-bind", "/dev/null", "/dev/zero")


def python_folders() -> Iterator[Path]:
    """Yield the folders of this Python, of what is installed for it, and of our own packages."""
    seen = [Path("/usr")]
    named = [sys.base_prefix, sys.base_exec_prefix, sys.prefix, sys.exec_prefix]
    if site.ENABLE_USER_SITE:
        named.append(site.getusersitepackages())
    packages = [Path(place) for name in PACKAGES for place in _package_folders(name)]
    wanted = [*(Path(os.path.abspath(name)) for name in named), *packages]  # noqa: PTH100 - links
    for folder in [variant for path in wanted for variant in (path, path.resolve())]:
        if folder.is_dir() and not _is_within(folder, seen):
            seen.append(folder)
            yield folder


def _package_folders(package: str) -> Sequence[str]:
    """Return the folders of a package without importing it: a subject has no time for that."""
    found = importlib.util.find_spec(package)
    return (found and found.submodule_search_locations) or []


def _bundled_folders() -> Iterator[Path]:
    """Yield where notebooks, solutions and corpora may lie among installed packages.

    An editable installation has its notebooks beside the other packages, not beside its modules.
    """
    folders = [*map(Path, sys.path), Path(course.__path__[0]).parent]
    for folder in {variant for path in folders for variant in (path, path.resolve())}:
        yield folder / "course" / "data"
        if (package := folder / "autograder").is_dir():
            yield from exercise_folders.kept_from_students(package)


def _is_within(folder: Path, others: Sequence[Path]) -> bool:
    return any(folder.is_relative_to(other) for other in others)


def sandbox_files(uid: int) -> dict[str, str]:
    """Return {path: text} of the few files that are the sandbox's own: who is who in it."""
    return {
        "/etc/passwd": f"student:x:{uid}:{uid}:Student:{HOME}:/bin/sh\n",
        "/etc/group": f"student:x:{uid}:\n",
        "/etc/hosts": "127.0.0.1 localhost robot\n::1 localhost\n",
        "/etc/nsswitch.conf": "passwd: files\ngroup: files\nhosts: files\n",
    }
