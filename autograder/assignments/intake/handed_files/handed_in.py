"""What lies in a submission's folder, those in folders within it and in zip files included."""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from autograder.assignments.intake.handed_files import archives
from autograder.assignments.intake.handed_files.archives import Archive, ArchiveError
from autograder.assignments.intake.handed_files.file_names import normalise_name, printable_name
from autograder.util.work_files import walk_files
from quizzes.attempts.record import read_plain

NBGRADERS = ("timestamp.txt", "submission_secret.txt")
"""Files that nbgrader's exchange adds to what a student hands in."""

MAX_ARCHIVES = 10
"""Zip files of one submission that are looked into."""

_JUNK = ("__MACOSX", ".", "__pycache__", "~$", "Thumbs.db", "desktop.ini")
"""How names of what computers add by themselves begin."""

NOTEBOOK = ".ipynb"


@dataclass(frozen=True)
class HandedInItem:
    """A file that was handed in.

    Attributes:
        place: its path in the submission's folder; that of a zip file's member goes on behind the
            zip file's own, as in ``hand-in.zip/ch05/qos-design.ipynb``.
        path: the file on disk: itself, or the zip file.
        archive: the zip file that it is in.
        member: its name in there.
    """

    place: str
    path: Path
    archive: Archive | None = field(default=None, repr=False)
    member: str = ""

    @property
    def name(self) -> str:
        """The last part of its place."""
        return self.place.rpartition("/")[2]

    @property
    def folder(self) -> str:
        """What is in front of that, with the slash."""
        return self.place[: len(self.place) - len(self.name)]

    def read(self, most: int) -> bytes:
        """Return at most its first ``most`` bytes.

        Raises:
            OSError: it cannot be read, or is no plain file.
            ArchiveError: its zip file is damaged.
        """
        if self.archive is not None:
            return self.archive.read(self.member, most)
        return read_plain(self.path, most)

    def digest(self, most: int) -> str:
        """Return a digest of what `read` returns, or of why it does not."""
        try:
            return hashlib.sha256(self.read(most)).hexdigest()
        except (OSError, ArchiveError) as error:
            return f"unreadable: {error}"


@dataclass(frozen=True)
class HandedIn:
    """All files of a submission, and {zip file: why it was not looked into}."""

    items: tuple[HandedInItem, ...]
    closed: dict[str, str]

    def find_item(self, place: str) -> HandedInItem | None:
        """Return the file that lies at ``place``, written or shown in whichever way."""
        exact = (item for item in self.items if item.place == place)
        alike = (item for item in self.items if printable_name(item.place) == normalise_name(place))
        return next(exact, None) or next(alike, None)

    def unclaimed_items(self, given: Collection[str]) -> list[HandedInItem]:
        """Return the files that may hold work: all but those ``given``, wherever they lie now.

        What lies in a zip file stands for it, if it could be opened.
        """
        opened = {item.path for item in self.items if item.archive is not None}
        return [
            item for item in self.items
            if not (item.archive is None and item.path in opened)
            and not any(f"/{normalise_name(item.place)}".endswith(f"/{place}") for place in given)
        ]  # fmt: skip

    def items_beside(self, item: HandedInItem) -> Iterator[tuple[str, HandedInItem]]:
        """Yield (path as seen from there, file) of what lies in the folder of ``item``."""
        for other in self.items:
            together = other.path == item.path if item.archive else other.archive is None
            if together and other.place.startswith(item.folder):
                yield other.place[len(item.folder) :], other


def look_through(folder: Path) -> HandedIn:
    """Return what lies in a submission's folder; what computers add by themselves is left out."""
    items: list[HandedInItem] = []
    closed: dict[str, str] = {}
    opened = 0
    for path in walk_files(folder):
        place = path.relative_to(folder).as_posix()
        if is_junk(place):
            continue
        items.append(HandedInItem(place, path))
        if path.suffix.lower() != ".zip":
            continue
        opened += 1
        try:
            if opened > MAX_ARCHIVES:
                raise ArchiveError(f"there are more than {MAX_ARCHIVES} zip files")
            archive = archives.look_into(path)
        except ArchiveError as error:
            closed[place] = str(error)
        else:
            members = (name for name in archive.members if not is_junk(name))
            items += [HandedInItem(f"{place}/{name}", path, archive, name) for name in members]
    return HandedIn(tuple(items), closed)


def handed_out(release: Path) -> frozenset[str]:
    """Return the places of the files that an assignment gives to students beside its notebooks."""
    places = (normalise_name(path.relative_to(release).as_posix()) for path in walk_files(release))
    return frozenset(place for place in places if not place.endswith(NOTEBOOK))


def is_junk(place: str) -> bool:
    """Whether computers add a file of this place by themselves, or nbgrader's exchange does."""
    path = PurePosixPath(place.replace("\\", "/"))
    return path.name in NBGRADERS or any(
        part.startswith(_JUNK) and part != ".." for part in path.parts
    )
