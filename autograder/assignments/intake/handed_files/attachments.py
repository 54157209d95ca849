"""The other files of a submission: what a student's code finds in the folder that it runs in."""

from __future__ import annotations

import stat
from dataclasses import dataclass, field
from pathlib import Path

from autograder.assignments.intake.handed_files.file_names import normalise_name, printable_name
from autograder.util.work_files import MAX_FILES, walk_files

MAX_BYTES = 10 * 1024 * 1024
"""Bytes of other files that are given to a submission's code."""

_MOST_NAMED = 5


@dataclass(frozen=True)
class Attachments:
    """The files beside a submission's notebooks.

    Attributes:
        files: {relative path: content} of those that its code is given, a helper module perhaps.
        notes: for the student, what was handed in and is not among them, and why.
    """

    files: dict[str, bytes] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def files_beside(folder: Path) -> Attachments:
    """Return the files of a submission other than its notebooks.

    Hidden files belong to nobody's work and are passed over. Links, what is over `MAX_BYTES` in
    all, and files beyond the first `MAX_FILES` are left out with a note.
    """
    paths = walk_files(folder)
    beside, too_large, links, room = Attachments(), [], [], MAX_BYTES
    for path in sorted(paths):
        name = path.relative_to(folder)
        if _is_passed_over(name):
            continue
        status = path.lstat()
        if stat.S_ISLNK(status.st_mode):
            links.append(str(name))
        elif stat.S_ISREG(status.st_mode):
            if status.st_size > room:
                too_large.append(str(name))
            else:
                # What macOS writes decomposed, code names as it is typed.
                beside.files[normalise_name(str(name))] = path.read_bytes()
                room -= status.st_size
    if too_large:
        beside.notes.append(
            f"Your code was run without {summarise_names(too_large)}: the files beside the "
            f"notebooks may have {MAX_BYTES // 2**20} MB together. Hand in smaller ones."
        )
    if links:
        beside.notes.append(
            f"Your code was run without {summarise_names(links)}: a link leads out of the "
            "submission. Hand in the file itself."
        )
    if len(paths) >= MAX_FILES:
        beside.notes.append(
            f"Your submission has more than {MAX_FILES} files: your code was run without the "
            "others. Hand in those that it needs."
        )
    return beside


def _is_passed_over(name: Path) -> bool:
    hidden = any(part.startswith((".", "__")) for part in name.parts)
    return hidden or name.suffix == ".ipynb" or name == Path("timestamp.txt")


def summarise_names(names: list[str]) -> str:
    """Return the first few ``names`` of a stranger's files, and how many more there are."""
    quoted = [f"'{printable_name(name)[:100]}'" for name in names]
    more = len(quoted) - _MOST_NAMED
    return ", ".join(quoted[:_MOST_NAMED]) + (f" and {more} more" if more > 0 else "")
