"""The other files of a submission, put where nbgrader takes them up: none is missing afterwards.

nbgrader copies what lies beside a notebook into the graded copy and into the feedback: pictures
that a text shows, data, and the secret by which its exchange knows whose feedback is whose.
"""

from __future__ import annotations

import os
import shutil
import stat
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from fnmatch import fnmatch
from pathlib import Path
from secrets import token_hex

from autograder.assignments.intake import roster
from autograder.assignments.intake.handed_files.attachments import summarise_names
from autograder.gradebook.safe_html import allowed_html
from autograder.util.work_files import walk_files
from quizzes.attempts.record import read_plain

TIME = "timestamp.txt"
SECRET = "submission_secret.txt"
"""What ``nbgrader submit`` lays beside a hand-in: the exchange names a feedback file by it."""

MAX_SECRET_BYTES = 1024
"""Bytes of a secret; nbgrader's have 128."""

MAX_STAGED = 500
"""Files that are copied; for each of them nbgrader lists its folder again, several times."""


AS_TEXT = ".txt"
"""What is put after the name of a file that a browser would run."""


@dataclass(frozen=True)
class StagingLimits:
    """What nbgrader's configuration says of files (``CourseDirectory``).

    Attributes:
        ignored: patterns of names of files and folders that are nobody's work.
        max_file: bytes of one file.
        max_all: bytes of all files.
    """

    ignored: tuple[str, ...]
    max_file: int
    max_all: int


@dataclass
class _LeftOut:
    """Names of what is not copied."""

    links: list[str] = field(default_factory=list)
    too_large: list[str] = field(default_factory=list)
    unreadable: list[str] = field(default_factory=list)
    active: list[str] = field(default_factory=list)
    too_many: int = 0

    def as_sentences(self) -> list[str]:
        """Return what a person should know of it."""
        what = "in the graded copy and the feedback"
        found = []
        if self.links:
            found.append(
                f"{summarise_names(self.links)} is missing {what}: a link is not followed."
            )
        if self.too_large:
            found.append(f"{summarise_names(self.too_large)} is missing {what}: it is too large.")
        if self.unreadable:
            found.append(
                f"{summarise_names(self.unreadable)} is missing {what}: make it readable, then "
                "grade again."
            )
        if self.active:
            found.append(
                f"{summarise_names(self.active)} has {AS_TEXT} after its name {what}: a browser "
                "would run it."
            )
        if self.too_many:
            found.append(f"{self.too_many} files are missing {what}: {MAX_STAGED} are copied.")
        return found


def copy_marks(submitted: Path, staged: Path, zone: str = "") -> None:
    """Copy when a submission was handed in, and the exchange's secret.

    What came through the exchange has both, and nbgrader releases nobody's feedback if one student
    lacks either. So a time that is not clear is left empty, which nbgrader takes for unknown, and
    for a secret that is not sound there is one that nobody knows: nobody else's page is found by
    it. ``zone`` is the course's own time zone (see `roster.read_timestamp`).
    """
    if not any(os.path.lexists(submitted / name) for name in (TIME, SECRET)):
        return
    time = roster.read_timestamp(submitted / TIME, zone)
    (staged / TIME).write_text(time or "", encoding="utf-8")
    (staged / SECRET).write_bytes(_read_secret(submitted / SECRET) or token_hex().encode())


def _read_secret(path: Path) -> bytes:
    """Return the exchange's secret; nothing if there is none that is sound."""
    try:
        secret = read_plain(path, MAX_SECRET_BYTES + 1)
        secret.decode()
    except (OSError, UnicodeError):
        return b""
    return secret if len(secret) <= MAX_SECRET_BYTES else b""


def copy_files(
    submitted: Path, staged: Path, limits: StagingLimits, notebooks: Iterable[str]
) -> list[str]:
    """Copy the files beside a submission's notebooks; return what of them is missing, and why.

    Args:
        submitted: the submission's folder.
        staged: where nbgrader takes it up.
        limits: how much is copied.
        notebooks: the assignment's; what would stand in the way of their feedback is left out.

    Raises:
        OSError: there is no room for them.
    """
    pages = {f"{name}.html" for name in notebooks}
    left_out, room, count = _LeftOut(), limits.max_all, 0
    for path in sorted(walk_files(submitted)):
        name = path.relative_to(submitted)
        if _is_passed_over(name, limits.ignored, pages):
            continue
        status = path.lstat()
        if stat.S_ISLNK(status.st_mode):
            left_out.links.append(str(name))
        elif not stat.S_ISREG(status.st_mode):
            continue
        elif status.st_size > min(room, limits.max_file):
            left_out.too_large.append(str(name))
        elif count == MAX_STAGED:
            left_out.too_many += 1
        elif not os.access(path, os.R_OK):
            left_out.unreadable.append(str(name))
        else:
            if not allowed_html.may_lie_beside(name.name, path.read_bytes):
                left_out.active.append(str(name))
                name = name.with_name(name.name + AS_TEXT)
            (staged / name.parent).mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, staged / name, follow_symlinks=False)
            room -= status.st_size
            count += 1
    return left_out.as_sentences()


def copy_around(
    files: Mapping[str, bytes], staged: Path, limits: StagingLimits, notebooks: Iterable[str]
) -> None:
    """Put what lay around a notebook that was found elsewhere, in a folder say, beside it.

    ``files`` has it by the paths that the notebook knows it by; what is there already stays.
    """
    pages = {f"{name}.html" for name in notebooks}
    for path, content in files.items():
        name = Path(path)
        if name.is_absolute() or ".." in name.parts:
            continue
        if _is_passed_over(name, limits.ignored, pages):
            continue
        if not allowed_html.may_lie_beside(name.name, lambda content=content: content):  # type: ignore[misc]
            name = name.with_name(name.name + AS_TEXT)
        if not any((staged / part).is_file() for part in (name, *name.parents)):
            (staged / name.parent).mkdir(parents=True, exist_ok=True)
            with suppress(IsADirectoryError):
                (staged / name).write_bytes(content)


def let_feedback_replace(folder: Path, notebooks: Iterable[str]) -> None:
    """Let a page of the student's own give way to the feedback, whose name it has.

    nbgrader makes all files of a graded copy read-only, copies them, and could then not write.
    """
    for name in notebooks:
        page = folder / f"{name}.html"
        if page.is_file():
            page.chmod(0o644)


def _is_passed_over(name: Path, ignored: Iterable[str], pages: set[str]) -> bool:
    first = name.parts[0]
    if first in (TIME, SECRET) or (first in pages and len(name.parts) > 1):
        return True
    return any(_is_match(part, (*ignored, "*.ipynb")) for part in name.parts)


def _is_match(part: str, patterns: Iterable[str]) -> bool:
    """Whether a name is one of ``patterns``; only hidden patterns are for hidden names."""
    return any(fnmatch(part, p) and (part[0] != "." or p[0] == ".") for p in patterns)
