"""Where the course's own material lies: in a clone of the repository or in the installed package.

In a clone (and in an editable installation) the folder ``notebooks`` is beside the packages. A
wheel carries a copy of it as data of the package; see ``force-include`` in ``pyproject.toml``.
"""

from __future__ import annotations

import shutil
from pathlib import Path

from course.errors import CourseError

_PACKAGE = Path(__file__).resolve().parents[1]
_CLONE, _DATA = _PACKAGE.parent, _PACKAGE / "data"

CONFIG = "nbgrader_config.py"


class ContentError(CourseError):
    """Course material that is not where it should be, or cannot be copied."""


def content_root() -> Path:
    """Return the folder with the notebooks and ``nbgrader_config.py`` (an nbgrader course root).

    Raises:
        ContentError: the installation is incomplete.
    """
    return _first_folder("notebooks", _CLONE / "notebooks", _DATA / "notebooks")


def clone_root() -> Path | None:
    """Return the clone of the repository that this runs from, or None if it was installed."""
    return _CLONE if (_CLONE / "pyproject.toml").is_file() else None


def constraints_file() -> Path:
    """Return the file with the versions that the course was tested with, as pip takes it.

    Raises:
        ContentError: the installation is incomplete.
    """
    places = _CLONE / ".ci" / "constraints.txt", _DATA / "constraints.txt"
    for place in places:
        if place.is_file():
            return place
    raise _missing("constraints", places[-1])


def working_root() -> Path:
    """Return the nbgrader course root to work in, where files may be written.

    The current folder or the nearest one above it that has an ``nbgrader_config.py``, or else the
    clone's ``notebooks``.

    Raises:
        ContentError: there is neither.
    """
    here = Path.cwd()
    for folder in (here, *here.parents):
        if (folder / CONFIG).is_file():
            return folder
    if (_CLONE / "notebooks" / CONFIG).is_file():
        return _CLONE / "notebooks"
    raise ContentError(
        f"There is no course root here: go to the folder with {CONFIG}, or name it with --root."
    )


def copy_authoring(root: Path, folder: Path) -> Path:
    """Make ``folder`` an nbgrader course root with the text sources of ``root``; return it.

    Exercises of the course root's own are among them.

    Raises:
        ContentError: ``root`` is incomplete or ``folder`` cannot be written.
    """
    for name in ("authoring", CONFIG):
        if not (root / name).exists():
            raise ContentError(f"There is no {name} in {root}: it is not a course root.")
    try:
        folder.mkdir(parents=True, exist_ok=True)
        left_out = shutil.ignore_patterns("__pycache__", ".*")  # of an editor, or of Python
        for name in ("authoring", "exercises"):
            if (root / name).is_dir():
                shutil.copytree(root / name, folder / name, ignore=left_out, dirs_exist_ok=True)
        shutil.copyfile(root / CONFIG, folder / CONFIG)
    except OSError as error:
        raise ContentError(
            f"The course cannot be copied to {folder} ({error.strerror or error}): make room "
            "there or choose another folder."
        ) from error
    return folder.resolve()


def _first_folder(what: str, *places: Path) -> Path:
    for place in places:
        if place.is_dir():
            return place
    raise _missing(what, places[-1])


def _missing(what: str, place: Path) -> ContentError:
    return ContentError(
        f"The course's {what} are missing from this installation ({place}): install ros2-course "
        "again."
    )
