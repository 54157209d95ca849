"""Options that several commands have, and the course root that one of them names."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from autograder.util import exercise_folders
from course.workspace.content import CONFIG, ContentError, working_root

Root = Annotated[
    Path | None,
    typer.Option("--root", help="The nbgrader course root (default: the one you are in)."),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON for machines.")]


def use_root(root: Path | None) -> Path:
    """Have the exercises of a course root among those there are, and return it.

    Args:
        root: what was named; None for the one that the current folder is in.

    Raises:
        ContentError: it is none, or there is none here.
    """
    found = course_root(root)
    exercise_folders.use_course(found)
    return found


def use_root_if_any(root: Path | None) -> None:
    """As `use_root`; where none was named and there is none here, exercises are the package's.

    Raises:
        ContentError: what was named is none.
    """
    if (found := root_if_any(root)) is not None:
        exercise_folders.use_course(found)


def root_if_any(root: Path | None) -> Path | None:
    """As `course_root`; None where none was named and there is none here.

    Raises:
        ContentError: what was named is none.
    """
    try:
        return course_root(root)
    except ContentError:
        if root is not None:
            raise
        return None


def course_root(root: Path | None) -> Path:
    """Return the course root that was named, or the one that the current folder is in.

    Raises:
        ContentError: it is none, or there is none here.
    """
    if root is None:
        return working_root()
    if not (root / CONFIG).is_file():
        raise ContentError(
            f"{root} is no course root, as it has no {CONFIG}: name another folder with --root, or "
            "make one with `autograder new course FOLDER`."
        )
    return root.resolve()
