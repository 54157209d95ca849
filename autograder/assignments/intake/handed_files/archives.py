"""Zip files that students hand in: looked into, never unpacked to disk.

Everything in one is data: how many members there are and how many bytes of each are read is
bounded before it is read, whatever the archive claims of itself; links and folders are passed
over; a member's name is only ever shown and compared, never used as a path.
"""

from __future__ import annotations

import io
import stat
import struct
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path

from course.errors import CourseError
from quizzes.attempts.record import read_plain

MAX_ARCHIVE_BYTES = 50 * 1024 * 1024
"""Bytes of a zip file that is looked into."""

MAX_MEMBERS = 1000
MAX_INDEX_BYTES = 1024 * 1024
"""Members of one, and bytes of its table of contents, which is read as a whole."""

_ENDS = 22, b"PK\x05\x06"
_MAX_COMMENT_BYTES = 65535
_UTF8_FLAG, ENCRYPTED_FLAG = 0x800, 0x1
METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
"""Ways of packing that are read."""
DAMAGE = (zipfile.BadZipFile, zlib.error, OSError, EOFError, NotImplementedError, RuntimeError,
           ValueError, struct.error)  # fmt: skip
"""What `zipfile` raises for archives that are damaged or use what it does not know."""


class ArchiveError(CourseError):
    """A zip file that is not looked into; the message says why."""


@dataclass(frozen=True)
class Archive:
    """The members of a zip file that are plain files: {name: place in the archive}."""

    content: bytes
    members: dict[str, zipfile.ZipInfo]

    def read(self, name: str, most: int) -> bytes:
        """Return at most the first ``most`` bytes of a member.

        Raises:
            ArchiveError: it is damaged, encrypted, or packed in a way that is not read.
        """
        entry = self.members[name]
        if entry.flag_bits & ENCRYPTED_FLAG:
            raise ArchiveError("it is encrypted")
        if entry.compress_type not in METHODS:
            raise ArchiveError("it is packed in a way that is not read")
        try:
            with (
                zipfile.ZipFile(io.BytesIO(self.content)) as archive,
                archive.open(entry) as member,
            ):
                return member.read(most)
        except DAMAGE as error:
            raise ArchiveError(f"it is damaged ({str(error)[:100]})") from None


def look_into(path: Path) -> Archive:
    """Return what is in the zip file at ``path``.

    Raises:
        ArchiveError: it is too large, has too many members, or is no zip file.
    """
    try:
        content = read_plain(path, MAX_ARCHIVE_BYTES + 1)
    except OSError as error:
        raise ArchiveError(f"it cannot be read ({error.strerror or error})") from None
    if len(content) > MAX_ARCHIVE_BYTES:
        raise ArchiveError(f"it has more than {MAX_ARCHIVE_BYTES // 2**20} MB")
    _check_index(content)
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            entries = archive.infolist()
    except DAMAGE as error:
        raise ArchiveError(f"it is damaged ({str(error)[:100]})") from None
    if len(entries) > MAX_MEMBERS:
        raise ArchiveError(f"it has more than {MAX_MEMBERS} members")
    return Archive(
        content, {member_name(entry): entry for entry in entries if is_plain_file(entry)}
    )


def _check_index(content: bytes) -> None:
    """Refuse an archive whose table of contents is too large, before it is read."""
    size, mark = _ENDS
    at = content.rfind(mark, -(_MAX_COMMENT_BYTES + size))
    if at < 0 or at + size > len(content):
        raise ArchiveError("it is no zip file, or cut off")
    members, index = struct.unpack_from("<HI", content, at + 10)
    # The largest numbers say that larger ones stand elsewhere (Zip64).
    if members > MAX_MEMBERS or index > MAX_INDEX_BYTES:
        raise ArchiveError(f"it has more than {MAX_MEMBERS} members")


def is_plain_file(entry: zipfile.ZipInfo) -> bool:
    """Whether a member is a plain file: no folder, no link, no device."""
    mode = entry.external_attr >> 16
    return stat.S_IFMT(mode) in (0, stat.S_IFREG) and not entry.is_dir()


def member_name(entry: zipfile.ZipInfo) -> str:
    """Return a member's name; many programs write UTF-8 without saying so (`zipfile`: CP437)."""
    if entry.flag_bits & _UTF8_FLAG:
        return entry.filename
    try:
        return entry.filename.encode("cp437").decode("utf-8")
    except UnicodeError:
        return entry.filename
