"""Put a submission into ``submitted/`` as a whole: after a kill it is there, or comes again."""

from __future__ import annotations

import errno
import os
import shutil
from pathlib import Path

REPLACED = "replaced"
"""How the folder ends, beside a submission, of the one that it took the place of."""

_PARTIAL = "partial"


def place_submission(new: Path, place: Path) -> None:
    """Move the finished folder ``new`` to ``place``.

    What stood there is kept beside it, hidden, until the next time (see `kept_folder`): a wrong
    download must not cost anybody their work. The folder may be on another disk; then it is copied
    first.

    Raises:
        OSError: there is no room, or no right to write there; what stood there still does.
    """
    place.parent.mkdir(parents=True, exist_ok=True)
    partial = place.parent / f".{place.name}.{_PARTIAL}"
    shutil.rmtree(partial, ignore_errors=True)
    try:
        new.rename(partial)
    except OSError as error:
        if error.errno != errno.EXDEV:
            raise
        shutil.copytree(new, partial, symlinks=True)
        shutil.rmtree(new)
    if os.path.lexists(place):
        kept = kept_folder(place)
        if kept.is_symlink():
            kept.unlink()
        shutil.rmtree(kept, ignore_errors=True)
        place.rename(kept)
    partial.rename(place)


def kept_folder(place: Path) -> Path:
    """Return where the submission is kept that the one at ``place`` has replaced."""
    return place.parent / f".{place.name}.{REPLACED}"
