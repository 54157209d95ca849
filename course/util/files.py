"""Replace files as a whole: a reader sees all or nothing, after a crash as well."""

from __future__ import annotations

import os
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
def replace_file(path: Path, mode: int = 0o644) -> Iterator[BinaryIO]:
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


def write_text(path: Path, text: str, mode: int = 0o644) -> None:
    """Replace the text of a file, as UTF-8 with the line ends that it has.

    Raises:
        OSError: it cannot be written; what stood there before still does.
    """
    with replace_file(path, mode) as file:
        file.write(text.encode("utf-8"))
