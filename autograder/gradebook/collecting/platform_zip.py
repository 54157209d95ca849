"""What students handed in on Moodle or Canvas, in the zip file that a teacher downloads there.

Everything in it is data: it is opened only if its table of contents is of a size to be read, only
plain files count, and their names are taken apart here and put together again elsewhere.
"""

from __future__ import annotations

import os
import struct
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from autograder.assignments.intake.handed_files import archives, download_names
from autograder.assignments.intake.handed_files.handed_in import is_junk
from course.errors import CourseError

MAX_MEMBERS = 100_000
"""Files of a download: 5,000 students with 20 files each have so many."""

MAX_INDEX_BYTES = 50 * 1024 * 1024
"""Bytes of its table of contents, which is read as a whole."""

MAX_UNPACKED_BYTES = 20 * 1024**3
"""Bytes of all that is packed in it."""

_FILE_PLUGIN = "assignsubmission_file"
_END_BYTES, _END_MARK = 22, b"PK\x05\x06"
_FAR_END_BYTES, _FAR_END_MARK = 20, b"PK\x06\x07"
_MAX_COMMENT_BYTES = 65535
_ELSEWHERE = 0xFFFFFFFF


class DownloadError(CourseError):
    """A zip file that nothing can be collected from; the message says why and what to do."""


@dataclass
class HandIn:
    """What somebody handed in.

    Attributes:
        who: the name as the platform writes it; empty if it hides it.
        number: the platform's number.
        files: {path in it: place in the archive}.
        late: the platform says that it came late.
    """

    who: str
    number: str
    files: dict[str, zipfile.ZipInfo] = field(default_factory=dict)
    late: bool = False

    def __str__(self) -> str:
        """Return who it is, as in a sentence."""
        return f"'{self.who}' ({self.number})" if self.who else f"number {self.number}"


@dataclass(frozen=True)
class Download:
    """A zip file that is open.

    Attributes:
        archive: it.
        platform: whose names its files have.
        hand_ins: what is in it, one a participant.
        left_out: files that are nobody's work: a text typed into a form, a link, a stranger's.
    """

    archive: zipfile.ZipFile
    platform: str
    hand_ins: tuple[HandIn, ...]
    left_out: tuple[str, ...]


@contextmanager
def open_download(path: Path) -> Iterator[Download]:
    """Open what was downloaded, for the block.

    Raises:
        DownloadError: it is no zip file, is damaged or too large, or has other names in it.
    """
    try:
        _check_index(path)
        with zipfile.ZipFile(path) as archive:
            entries = archive.infolist()
            _check_size(path, entries)
            yield _sort_entries(path, archive, entries)
    except OSError as error:
        if error.filename != os.fspath(path):
            raise  # of what the block did
        raise DownloadError(
            f"{path} cannot be read ({error.strerror}): give the zip file as it was downloaded."
        ) from None
    except zipfile.BadZipFile as error:
        raise _no_zip(path, str(error)[:100]) from None


def _no_zip(path: Path, why: str) -> DownloadError:
    return DownloadError(f"{path} is no zip file, or a damaged one ({why}): download it again.")


def _check_index(path: Path) -> None:
    """Refuse a zip file whose table of contents is too large, before `zipfile` reads it."""
    with path.open("rb") as file:
        size = file.seek(0, os.SEEK_END)
        file.seek(max(0, size - _MAX_COMMENT_BYTES - _END_BYTES - _FAR_END_BYTES))
        tail = file.read()
        at = tail.rfind(_END_MARK)
        if at < 0 or at + _END_BYTES > len(tail):
            raise _no_zip(path, "its end is missing")
        members, index = struct.unpack_from("<HI", tail, at + 10)
        far = at - _FAR_END_BYTES
        if far >= 0 and tail[far : far + 4] == _FAR_END_MARK:  # Zip64, as Moodle writes it
            file.seek(struct.unpack_from("<Q", tail, far + 8)[0])
            record = file.read(56)
            if len(record) < 56:
                raise _no_zip(path, "its end is damaged")
            members, index = struct.unpack_from("<QQ", record, 32)
    if members > MAX_MEMBERS or index > MAX_INDEX_BYTES:
        raise DownloadError(
            f"{path} has more than {MAX_MEMBERS} files: no download of an assignment has so many, "
            "so nothing of it is collected."
        )


def _check_size(path: Path, entries: list[zipfile.ZipInfo]) -> None:
    unpacked = sum(entry.file_size for entry in entries)
    if unpacked > MAX_UNPACKED_BYTES or len(entries) > MAX_MEMBERS:
        raise DownloadError(
            f"{path} would unpack to {unpacked / 2**30:.0f} GB, more than the "
            f"{MAX_UNPACKED_BYTES // 2**30} GB that are taken: nothing of it is collected."
        )


def _sort_entries(path: Path, archive: zipfile.ZipFile, entries: list[zipfile.ZipInfo]) -> Download:
    names = [(archives.member_name(entry), entry) for entry in entries if not entry.is_dir()]
    names = [(name, entry) for name, entry in names if not is_junk(name)]
    moodle = {name: download_names.parse_moodle(name) for name, _ in names}
    canvas = {} if any(moodle.values()) else {n: download_names.parse_canvas(n) for n, _ in names}
    parsed = canvas or moodle
    hand_ins: dict[str, HandIn] = {}
    left_out: list[str] = []
    for name, entry in names:
        said = parsed[name]
        if said is None or said.plugin not in ("", _FILE_PLUGIN):
            left_out.append(name)
            continue
        found = hand_ins.setdefault(said.number, HandIn(said.who, said.number, late=said.late))
        if is_junk(said.place):
            continue
        if said.place in found.files or not archives.is_plain_file(entry):
            left_out.append(name)
        else:
            found.files[said.place] = entry
    if not hand_ins:
        raise DownloadError(
            f"{path} has no names of Moodle's (FULL NAME_NUMBER_assignsubmission_file) and none of "
            "Canvas's (name_NUMBER_NUMBER_file): give the zip file that “Download all submissions” "
            "(Moodle) or “Download Submissions” (Canvas) makes, as it is."
        )
    return Download(
        archive, "Canvas" if canvas else "Moodle", tuple(hand_ins.values()), tuple(left_out)
    )
