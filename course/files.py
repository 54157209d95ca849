"""Files that are replaced whole: a reader, and whoever comes after a crash, sees all or nothing."""

from __future__ import annotations

import os
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

PARTIAL = ".partial"
"""How the name of a file ends that is being written: a killed process leaves it behind."""

_PREFIX = 60
"""Characters of the file's own name in that name, which must not get too long."""


@contextmanager
def replacing(path: Path, mode: int = 0o644) -> Iterator[BinaryIO]:
    """Give an open file for the block that takes the place of ``path`` when the block is through.

    Args:
        path: the file; its folder must be there.
        mode: who may read and write it.

    Raises:
        OSError: it cannot be written; what stood there before still does.
    """
    handle, name = tempfile.mkstemp(PARTIAL, f".{path.name[:_PREFIX]}.", path.parent)
    partial = Path(name)
    try:
        with os.fdopen(handle, "wb") as file:
            yield file
        partial.chmod(mode)  # mkstemp's own mode hides it from everyone else
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def read_plain(path: Path, most: int) -> bytes:
    """Return what a file holds, at most its first ``most`` bytes.

    A link is not followed, and what is no plain file (a pipe, a device) is not waited for.

    Raises:
        OSError: it cannot be read.
    """
    handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    with os.fdopen(handle, "rb") as file:
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            raise OSError("it is not a plain file")
        return file.read(most)


def write_text(path: Path, text: str, mode: int = 0o644) -> None:
    """Replace the text of a file, as UTF-8 with the line ends that it has.

    Raises:
        OSError: it cannot be written; what stood there before still does.
    """
    with replacing(path, mode) as file:
        file.write(text.encode("utf-8"))
