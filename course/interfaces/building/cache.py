"""Where built units are kept, safely when several processes build at once.

A unit's folder appears under its final name by one rename, complete, with a manifest of checksums:
a build that was killed leaves only a folder under another name, which the next builder removes.
The cache is ``COURSE_INTERFACES_CACHE`` if that is set, or the user's cache folder. Code is loaded
from it, so anyone who can write there can run code as the user who reads it: a grader that runs
other people's programs gives them the cache read-only.
"""

from __future__ import annotations

import atexit
import contextlib
import functools
import hashlib
import json
import os
import shutil
import sys
import sysconfig
import tempfile
from pathlib import Path

from course.interfaces import installed
from course.interfaces.building.locks import locked
from course.interfaces.building.pruning import (
    MANIFEST,
    lock_of,
    prune,
    scratch_name,
    touch_manifest,
)
from course.interfaces.building.unit import Unit, build_unit
from course.interfaces.errors import BuildError

VARIABLE = "COURSE_INTERFACES_CACHE"
RECIPE = ("generate.py", "unit.py", "toolchain.py", "dispatch.c")

_private: list[Path] = []  # the folder used instead of a cache that cannot be written


def root() -> Path:
    """Return the folder of the cache; it need not exist."""
    chosen = os.environ.get(VARIABLE)
    if chosen:
        return Path(chosen).expanduser().absolute()
    import platformdirs

    folder = platformdirs.user_cache_path("ros2-course", appauthor=False) / "interfaces"
    # An account without a home folder gets "~" back, unexpanded.
    return folder if folder.is_absolute() else private_folder()


@functools.cache
def environment_key() -> str:
    """Return twelve hexadecimal digits that change when a built library may no longer fit."""
    parts = [
        sysconfig.get_config_var("SOABI"),
        sys.prefix,
        os.confstr("CS_GNU_LIBC_VERSION"),
        [str(prefix) for prefix in installed.ament_prefixes()],
        [hashlib.sha256((Path(__file__).parent / f).read_bytes()).hexdigest() for f in RECIPE],
        wheel_versions(),
    ]
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()[:12]


def wheel_versions() -> list[str]:
    """Return the versions of all ROS wheels, and of numpy, whose C interface is compiled in."""
    folders = {sysconfig.get_path("purelib"), sysconfig.get_path("platlib")}
    names = [entry.name for folder in folders for entry in Path(folder).iterdir()]
    wheels = (n for n in names if n.startswith(("ros_", "numpy-")) and n.endswith(".dist-info"))
    return sorted(set(wheels))


def folder_of(unit: Unit, base: Path) -> Path:
    """Return the folder that ``unit`` has in the cache at ``base``."""
    name = f"{unit.type_names[0].name}-" if len(unit.type_names) == 1 else ""
    return base / environment_key() / unit.package / f"{name}{unit.digest}"


def find_built(unit: Unit) -> Path | None:
    """Return the folder of ``unit`` if it is built and whole, else None."""
    folders = [folder_of(unit, base) for base in (root(), *_private)]
    found = next((folder for folder in folders if is_whole(folder)), None)
    if found is not None:
        touch_manifest(found)
    return found


def is_whole(folder: Path) -> bool:
    """Say whether every file of a built unit is there, with the content it was built with."""
    try:
        manifest = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))
        whole = all(file_checksum(folder / name) == digest for name, digest in manifest.items())
        return whole and bool(manifest)
    except (OSError, ValueError, AttributeError):
        return False


def file_checksum(file: Path) -> str:
    """Return the SHA-256 of ``file``."""
    return hashlib.sha256(file.read_bytes()).hexdigest()


def defined_before(package: str) -> list[str]:
    """Return the interfaces of ``package`` that were built here once, for instance by a notebook.

    Cheap for a package of which there is nothing: every failing import in the process asks.
    """
    if not any(root().glob(f"*/{package}")):
        return []
    classes = (root() / environment_key() / package).glob("[!.]*-*/python/*/_*.py")
    found = {(file.parent.name, file.parents[2].name.rpartition("-")[0]) for file in classes}
    return [f"{package}/{kind}/{name}" for kind, name in sorted(found)]


def ensure_built(unit: Unit, *, rebuild: bool = False) -> Path:
    """Return the folder of ``unit``, building it if need be.

    ``rebuild`` throws away what is there: it looked whole and could not be loaded. A cache that
    cannot be written is replaced by a private folder for the life of this process. Raises
    ``CompilerMissingError`` or ``BuildError``.
    """
    found = None if rebuild else find_built(unit)
    if found:
        return found
    try:
        return build_in(root(), unit, rebuild=rebuild)
    except OSError as error:
        try:
            return build_in(private_folder(), unit, rebuild=rebuild)
        except OSError as second:
            raise BuildError(
                f"{unit.label} could not be built, because neither {root()} ({error.strerror}) nor "
                f"{tempfile.gettempdir()} ({second.strerror}) takes its files: free some disk "
                f"space, or set {VARIABLE} to a folder with 20 MB of room."
            ) from None


def private_folder() -> Path:
    """Return a folder of this process's own, removed when it ends."""
    if not _private:
        folder = Path(tempfile.mkdtemp(prefix="ros2-course-interfaces-"))
        _private.append(folder)
        atexit.register(remove_private, folder, os.getpid())
    return _private[0]


def remove_private(folder: Path, owner: int) -> None:
    """Remove a private folder, unless this is a forked child of the process that made it."""
    if os.getpid() == owner:
        shutil.rmtree(folder, ignore_errors=True)


def build_in(base: Path, unit: Unit, *, rebuild: bool) -> Path:
    """Build ``unit`` in the cache at ``base``, unless another process just did.

    Raises ``OSError`` if the files cannot be written, or if the lock stays taken.
    """
    folder = folder_of(unit, base)
    folder.parent.mkdir(parents=True, exist_ok=True)
    with locked(lock_of(folder)):
        if not rebuild and is_whole(folder):
            return folder
        clear_folder(folder)
        temporary = scratch_name(folder)
        try:
            temporary.mkdir()
            build_unit(unit, temporary)
            write_manifest(temporary)
            temporary.rename(folder)
        finally:
            shutil.rmtree(temporary, ignore_errors=True)
    with contextlib.suppress(OSError):  # what was asked for is there
        prune(base)
    return folder


def clear_folder(folder: Path) -> None:
    """Remove a damaged ``folder`` and what dead builders left; the lock is held.

    The compilers of a dead builder may still be writing, so what cannot be removed now is left to
    the next one.
    """
    if folder.exists():
        folder.rename(scratch_name(folder))
    for left in folder.parent.glob(f".building-{folder.name}-*"):
        shutil.rmtree(left, ignore_errors=True)


def write_manifest(folder: Path) -> None:
    """Write the checksum of every file in ``folder``."""
    files = sorted(f for f in folder.rglob("*") if f.is_file())
    manifest = {f.relative_to(folder).as_posix(): file_checksum(f) for f in files}
    (folder / MANIFEST).write_text(json.dumps(manifest, indent=1), encoding="utf-8")
