"""Keep the cache from growing for ever: what nobody has used for long is removed.

A unit is used when it is found in the cache; its manifest's time stamp says when that was last.
"""

from __future__ import annotations

import contextlib
import os
import secrets
import shutil
import time
from collections.abc import Iterator
from pathlib import Path

from course.interfaces.building.locks import locked

MANIFEST = "manifest.json"
UNUSED_FOR_S = 90 * 86400.0  # s after which a unit goes
IN_USE_FOR_S = (
    86400.0  # s after its last use in which a unit never goes: somebody may be loading it
)
MAX_UNITS = 200  # units; about 0.3 MB each


def touch_manifest(folder: Path) -> None:
    """Note that the unit in ``folder`` is used; a cache that is read-only keeps no such notes."""
    with contextlib.suppress(OSError):
        os.utime(folder / MANIFEST)


def prune(base: Path) -> list[Path]:
    """Remove old units, of other versions of ROS too, from the cache at ``base``; return them.

    Safe beside other processes: a unit is locked and looked at again before it goes, and it leaves
    its name by one rename, as it came.
    """
    now = time.time()
    units = sorted(_list_units(base), reverse=True)
    old = [
        folder
        for rank, (used, folder) in enumerate(units)
        if now - used > (UNUSED_FOR_S if rank < MAX_UNITS else IN_USE_FOR_S)
    ]
    return [folder for folder in old if _remove_unit(folder, now)]


def scratch_name(folder: Path) -> Path:
    """Return a new name beside ``folder`` that no reader takes for a built unit."""
    return folder.parent / f".building-{folder.name}-{secrets.token_hex(4)}"


def lock_of(folder: Path) -> Path:
    """Return the file that a process keeps locked while it builds or removes ``folder``."""
    return folder.parent / f".{folder.name}.lock"


def _list_units(base: Path) -> Iterator[tuple[float, Path]]:
    for manifest in base.glob(f"*/*/*/{MANIFEST}"):
        if not manifest.parent.name.startswith("."):
            with contextlib.suppress(OSError):  # another process prunes too
                yield manifest.stat().st_mtime, manifest.parent


def _remove_unit(folder: Path, now: float) -> bool:
    try:
        with locked(lock_of(folder), deadline=0.0):
            if now - (folder / MANIFEST).stat().st_mtime <= IN_USE_FOR_S:
                return False  # used just now
            gone = scratch_name(folder)
            folder.rename(gone)
            lock_of(folder).unlink()
    except OSError:  # locked: it is in use; or it has gone, or is not ours to remove
        return False
    shutil.rmtree(gone, ignore_errors=True)
    return True
