"""A student's working copy of the course: made, kept, and never overwritten."""

from __future__ import annotations

import hashlib
import json
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn

from course.errors import CourseError
from course.workspace.content import content_root
from course.workspace.journal import welcome
from course.workspace.journal.journal_file import MANIFEST
from course.workspace.journal.progress import WELCOME

DEFAULT = Path("ros2-course")


class WorkingCopyError(CourseError):
    """A working copy that cannot be made or opened."""


_SETTINGS = Path(__file__).resolve().parent / "jupyter"
"""A Jupyter configuration folder: no questions about news, no look for updates on the internet, and
time for nbgrader's Validate button to run checks that take several seconds of simulated time."""


@dataclass(frozen=True)
class Copied:
    """What happened to a working copy; paths are relative to it.

    Attributes:
        folder: the working copy.
        new: files that were not there.
        beside: {the student's file: the course's newer version put beside it}.
    """

    folder: Path
    new: list[Path] = field(default_factory=list)
    beside: dict[Path, Path] = field(default_factory=dict)


def make_copy(folder: Path, root: Path | None = None, *, assignments: bool = True) -> Copied:
    """Put the chapters and the released assignments into ``folder``.

    A file that is there is never changed, but for the progress that the first notebook shows. Where
    the course has a version that was not handed out yet, that one is put beside it as
    ``NAME.new.ipynb`` (``NAME.new-2.ipynb``, ...).

    Args:
        folder: the working copy; it is made if need be.
        root: the nbgrader course root; the course's own if left out.
        assignments: False leaves their folders to nbgrader's exchange, which fetches no assignment
            whose folder is there. Once fetched, they count for the student's progress all the same.

    Raises:
        WorkingCopyError: ``folder`` cannot be used.
        ContentError: the course's own files are damaged.
    """
    files = _course_files(root or content_root(), assignments)
    copied = Copied(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        handed_out = _read_manifest(folder)
        for name, content in files.items():
            digests = handed_out.setdefault(str(name), [])
            if assignments or len(name.parts) == 1:
                _hand_out(copied, name, content, digests)
        _write_manifest(folder, handed_out)
        welcome.refresh_progress(folder)
    except OSError as error:
        raise WorkingCopyError(
            f"The working copy {folder} cannot be written ({error.strerror or error}): name a "
            "folder of your own with room in it, for example `course lab ~/ros2-course`. No file "
            "of yours was changed."
        ) from error
    return copied


def open_lab(folder: Path, arguments: Sequence[str] = ()) -> NoReturn:
    """Become JupyterLab in ``folder``; ``arguments`` are passed on to it.

    Raises:
        WorkingCopyError: the folder cannot be entered, or JupyterLab cannot be started.
    """
    try:
        os.chdir(folder)
        inherited = os.environ.get("JUPYTER_CONFIG_PATH")
        places = [str(_SETTINGS), *([inherited] if inherited else [])]
        os.environ["JUPYTER_CONFIG_PATH"] = os.pathsep.join(places)
        # -m, and not the script: it starts the JupyterLab of this very Python.
        command = [sys.executable, "-m", "jupyterlab", *_first_view(arguments), *arguments]
        os.execv(sys.executable, command)
    except OSError as error:
        raise WorkingCopyError(
            f"JupyterLab cannot be started in {folder} ({error.strerror or error}): choose "
            "another folder, or run `course doctor`."
        ) from error


def _first_view(arguments: Sequence[str]) -> list[str]:
    """Return the option by which JupyterLab opens the student's progress first."""
    chosen = any("default_url" in argument for argument in arguments)
    return [] if chosen or not WELCOME.is_file() else [f"--LabApp.default_url=/lab/tree/{WELCOME}"]


def _course_files(root: Path, assignments: bool) -> dict[Path, bytes]:
    """Return {path in a working copy: content}: chapters at its top, assignments in folders.

    Without ``assignments`` their contents are not made, which takes the longest.
    """
    from course.workspace.student_version import student_versions

    chapters = sorted((root / "chapters").glob("*.ipynb"))
    files = {Path(path.name): path.read_bytes() for path in chapters}
    if assignments:
        files |= {path: text.encode() for path, text in student_versions(root).items()}
    else:
        files |= {p.relative_to(root / "source"): b"" for p in (root / "source").glob("*/*.ipynb")}
    beside = [(root / "source" / path).with_suffix(".svg") for path in files]
    beside += sorted((root / "source").glob("*/exercises/*/*"))
    files |= {p.relative_to(root / "source"): p.read_bytes() for p in beside if p.is_file()}
    for sheet in sorted((root / "source").glob("*/quiz-*.questions.yaml")):
        pictures = sorted((sheet.parent / "assets").glob("*"))
        files |= {path.relative_to(root / "source"): path.read_bytes()
                  for path in (sheet, *pictures)}  # fmt: skip
    if not files:
        raise WorkingCopyError(f"There are no notebooks in {root}: run `autograder build` first.")
    return files


def _hand_out(copied: Copied, name: Path, content: bytes, digests: list[str]) -> None:
    digest = hashlib.sha256(content).hexdigest()
    target = copied.folder / name
    target.parent.mkdir(parents=True, exist_ok=True)
    if not target.exists():
        _create_file(target, content)
        copied.new.append(name)
    elif digest not in digests and target.read_bytes() != content:
        beside = _free_name(target)
        _create_file(beside, content)
        copied.beside[name] = beside.relative_to(copied.folder)
    if digest not in digests:
        digests.append(digest)


def _create_file(path: Path, content: bytes) -> None:
    """Write a file that is not there; a full disk leaves none rather than half of one."""
    file = path.open("xb")  # x: not even a file that appeared this very moment is overwritten
    try:
        with file:
            file.write(content)
    except OSError:
        path.unlink(missing_ok=True)
        raise


def _free_name(path: Path) -> Path:
    number = 1
    while True:
        mark = "new" if number == 1 else f"new-{number}"
        beside = path.with_name(f"{path.stem}.{mark}{path.suffix}")
        if not beside.exists():
            return beside
        number += 1


def _read_manifest(folder: Path) -> dict[str, list[str]]:
    """Return {path: digests of the versions handed out}; a damaged record costs a copy beside."""
    try:
        data = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))
        return {str(name): [str(digest) for digest in digests] for name, digests in data.items()}
    except (FileNotFoundError, ValueError, AttributeError, TypeError):
        return {}


def _write_manifest(folder: Path, handed_out: dict[str, list[str]]) -> None:
    temporary = folder / f"{MANIFEST}.{os.getpid()}"
    try:
        temporary.write_text(json.dumps(handed_out, indent=1, sort_keys=True), encoding="utf-8")
        temporary.replace(folder / MANIFEST)
    finally:
        temporary.unlink(missing_ok=True)
