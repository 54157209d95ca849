"""Files that are there as a whole or not at all, and folders that a killed process leaves behind.

A process that is killed cleans nothing up. Its scratch folders carry a mark by which the next one
knows that nobody uses them any more, and removes them.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import islice
from pathlib import Path

from course.util.files import replace_file

SCRATCH = "ros2-course-scratch-"
PRIVATE = 0o600
"""Mode of what is written: grades are nobody else's business."""

MAX_FILES = 2000
"""Files of one submission that are looked at, and folders."""

NOT_COUNTED = {".ipynb_checkpoints", "__pycache__"}
"""Folders that appear when somebody merely opens or runs what is beside them."""

MAX_DEPTH = 20
"""Folders within each other in which they are found."""


def write_whole(path: Path, text: str) -> None:
    """Write a file in one step: a reader sees all of it or none, after a kill as well.

    Raises:
        OSError: it cannot be written; what stood there before still does.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with replace_file(path, PRIVATE) as file:
        file.write(text.encode("utf-8", errors="replace"))


def walk_files(folder: Path) -> list[Path]:
    """Return the files anywhere in a stranger's folder, the upper ones first; no link is followed.

    There may be any number of them, as deep as paths go: no more than `MAX_FILES` are returned, and
    none that lies deeper than `MAX_DEPTH`. What cannot be listed is passed over, and so are folders
    that appear by themselves (`NOT_COUNTED`).
    """
    found: list[Path] = []
    level, seen = [folder], 0
    for _ in range(MAX_DEPTH):
        below: list[Path] = []
        for place in level[: max(0, MAX_FILES - seen)]:
            files, folders = _list_folder(place)
            found += files
            below += folders
            seen += 1
            if len(found) >= MAX_FILES:
                return found[:MAX_FILES]
        level = below
    return found


def _list_folder(folder: Path) -> tuple[list[Path], list[Path]]:
    """Return the files (links, pipes and devices, too) and the folders right in a folder."""
    try:
        with os.scandir(folder) as entries:
            counted = (entry for entry in entries if entry.name not in NOT_COUNTED)
            some = sorted(islice(counted, 2 * MAX_FILES), key=lambda entry: os.fsencode(entry.name))
            kinds = [(Path(entry.path), entry.is_dir(follow_symlinks=False)) for entry in some]
    except OSError:
        return [], []
    return [p for p, deeper in kinds if not deeper], [p for p, deeper in kinds if deeper]


@contextmanager
def scratch_folder() -> Iterator[Path]:
    """Make a folder for the block, and remove it afterwards.

    `sweep_scratch` does if this is killed.
    """
    folder, handle = _make_locked_folder()
    try:
        yield folder
    finally:
        # What a submission leaves there that cannot be removed is no reason to stop.
        shutil.rmtree(folder, ignore_errors=True)
        os.close(handle)


def _make_locked_folder() -> tuple[Path, int]:
    """Return a new folder and the descriptor that holds a lock on it."""
    while True:
        folder = Path(tempfile.mkdtemp(prefix=SCRATCH))
        handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        fcntl.flock(handle, fcntl.LOCK_EX)
        if folder.exists():  # nobody took it for abandoned before it was locked
            return folder, handle
        os.close(handle)


def sweep_scratch() -> int:
    """Remove scratch folders whose processes are gone; return how many there were."""
    swept = 0
    for folder in Path(tempfile.gettempdir()).glob(f"{SCRATCH}*"):
        with suppress(OSError):
            swept += _remove_abandoned(folder)
    return swept


def _remove_abandoned(folder: Path) -> bool:
    """Remove a folder of ours that nobody holds; return whether it was one."""
    if folder.lstat().st_uid != os.geteuid():
        return False
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        shutil.rmtree(folder, ignore_errors=True)
        return True
    except BlockingIOError:
        return False
    finally:
        os.close(handle)
