"""A digest of what was handed in: whether a file or a folder is as it was."""

from __future__ import annotations

import hashlib
import os
import stat
from pathlib import Path

from autograder.assignments.intake.handed_files.attachments import MAX_BYTES
from autograder.assignments.submission import MAX_NOTEBOOK_BYTES
from autograder.util.work_files import walk_files

MAX_FILE = MAX_NOTEBOOK_BYTES + MAX_BYTES
"""Bytes of one file beyond which only its size and date are looked at: it is not read anyway."""


def of_folder(folder: Path) -> str:
    """Return a digest of a file or of a folder's files: names, kinds and contents."""
    state = hashlib.sha256()
    paths = [folder] if folder.is_file() else sorted(walk_files(folder))
    for path in paths:
        name = os.fsencode(path.relative_to(folder) if path != folder else path.name)
        state.update(name + b"\0" + _digest_file(path) + b"\0")
    return state.hexdigest()


def _digest_file(path: Path) -> bytes:
    try:
        status = path.lstat()
        if not stat.S_ISREG(status.st_mode) or status.st_size > MAX_FILE:
            return f"{status.st_mode} {status.st_size} {status.st_mtime_ns}".encode()
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").digest()
    except OSError as error:
        return str(error.errno).encode()
