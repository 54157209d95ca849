"""Match files to students by the names that Moodle and Canvas give to what can be downloaded there.

Both take feedback back by these names alone. They hold numbers that only the platform knows, so the
names have to come from there: from the archive of submissions as it was downloaded, or, for Moodle,
from its grading worksheet. Who is meant is found by the files themselves, which lie in
``submitted/`` byte for byte, or else by name, email address or the platform's number.

Moodle (``mod/assign/feedback/file/importziplib.php``): a folder FULL NAME_NUMBER_TYPE_PLUGIN; the
number is the participant's in this assignment. Canvas (``Assignment``,
``infer_comment_context_from_filename``): the first two parts of a file name, between underscores,
that are all digits are the user's number and that of the file that was handed in. How the downloads
are named stands in `download_names`.
"""

from __future__ import annotations

import csv
import hashlib
import io
import re
import unicodedata
import zipfile
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from autograder.assignments.intake.handed_files.download_names import parse_canvas, parse_moodle
from autograder.class_report.class_data import Person
from course.errors import CourseError

MAX_MEMBERS = 100_000
"""Most files in an archive that is read; 5,000 students with 20 files each have so many."""
MAX_FILE_BYTES = 50 * 1024 * 1024
"""Bytes of a file beyond which its content is not looked at."""

_PARTICIPANT = re.compile(r"(\d+)\s*$")


class NamesError(CourseError):
    """Names that cannot be read, or that are of another platform; the message says what is."""


@dataclass(frozen=True)
class File:
    """A file in a download: its name, and the digests of it and of what is packed in it."""

    name: str
    digests: frozenset[str]


@dataclass(frozen=True)
class Participant:
    """Somebody in a download.

    Attributes:
        number: the platform's.
        label: the folder of a Moodle download; empty for Canvas.
        names: what else may say who it is: name, email address, id number.
        files: what they handed in.
    """

    number: str
    label: str
    names: frozenset[str] = frozenset()
    files: tuple[File, ...] = ()


@dataclass(frozen=True)
class Matched:
    """Matches: {student: participant}, and the participants for whom no student could be found."""

    who: Mapping[str, Participant]
    unknown: tuple[str, ...]


def of_moodle(path: Path) -> list[Participant]:
    """Return the participants of a downloaded archive, its unpacked folder, or a worksheet.

    Raises:
        NamesError: it cannot be read, or is none of them.
    """
    if path.suffix.lower() == ".csv":
        found = list(_read_worksheet(path))
    else:
        by_label: defaultdict[str, list[File]] = defaultdict(list)
        for name, file in _read_files(path):
            if said := parse_moodle(name):
                by_label[f"{said.who}_{said.number}_{said.plugin}_"].append(file)
        found = [
            Participant(label.split("_")[1], label,
                        frozenset({_comparable_name(label.split("_")[0])}), tuple(files))
            for label, files in by_label.items()
        ]  # fmt: skip
    if not found:
        raise NamesError(
            f"{path.name} has no names of Moodle's (FULL NAME_NUMBER_assignsubmission_file): give "
            "the archive of “Download all submissions”, with its folders, or the grading worksheet "
            "(“Download grading worksheet”, CSV)."
        )
    return found


def of_canvas(path: Path) -> list[Participant]:
    """Return the participants of a downloaded archive or its unpacked folder; raises as above."""
    by_number: defaultdict[str, list[File]] = defaultdict(list)
    for name, file in _read_files(path):
        if (said := parse_canvas(name)) and said.number.isdecimal():
            by_number[said.number].append(file)
    if not by_number:
        raise NamesError(
            f"{path.name} has no names of Canvas's (name_NUMBER_NUMBER_file): give the archive of "
            "“Download Submissions” as it is."
        )
    return [
        Participant(number, "", frozenset({_comparable_name(number)}), tuple(files))
        for number, files in by_number.items()
    ]


def match_participants(
    participants: Iterable[Participant],
    people: Mapping[str, Person],
    submitted: Mapping[str, Iterable[Path]],
) -> Matched:
    """Match participants to students.

    Args:
        participants: those of a download.
        people: {student: person} of the gradebook.
        submitted: {student: files of the submission}.
    """
    by_digest: defaultdict[str, set[str]] = defaultdict(set)
    for student, paths in submitted.items():
        for path in paths:
            by_digest[_digest_content(path.read_bytes())].add(student)
    by_name: defaultdict[str, set[str]] = defaultdict(set)
    for student, person in people.items():
        for name in (person.name, person.email, person.lms_user_id, student):
            by_name[_comparable_name(name)].add(student)
    by_name.pop("", None)
    who: dict[str, Participant] = {}
    unknown = []
    for participant in participants:
        digests = (digest for file in participant.files for digest in file.digests)
        meant = _only_student(by_digest, digests) or _only_student(by_name, participant.names)
        if meant and meant not in who:
            who[meant] = participant
        else:
            unknown.append(participant.label or participant.number)
    return Matched(who, tuple(unknown))


def _only_student(known: Mapping[str, set[str]], keys: Iterable[str]) -> str | None:
    """Return the one student whom keys name; None if they name nobody, or several."""
    found: set[str] = set()
    for key in keys:
        students = known.get(key, set())
        if len(students) == 1:  # what two have handed in alike says nothing
            found |= students
    return found.pop() if len(found) == 1 else None


def _read_worksheet(path: Path) -> Iterator[Participant]:
    try:
        rows = list(csv.reader(io.StringIO(path.read_text(encoding="utf-8-sig"), newline="")))
    except (OSError, UnicodeError, csv.Error) as error:
        raise NamesError(f"{path} cannot be read as CSV in UTF-8 ({error}).") from None
    for row in rows[1:]:
        # "Participant 1234", in whichever language; then the full name.
        if len(row) > 1 and (number := _PARTICIPANT.search(row[0])):
            name = row[1].replace("_", " ").replace("/", " ").strip()
            label = f"{name}_{number[1]}_assignsubmission_file_"
            yield Participant(number[1], label, frozenset(map(_comparable_name, row[1:])))


def _read_files(path: Path) -> Iterator[tuple[str, File]]:
    """Yield (name, file) of what is in an archive or a folder."""
    try:
        if path.is_dir():
            for file in sorted(p for p in path.rglob("*") if p.is_file() and not p.is_symlink()):
                content = file.read_bytes() if file.stat().st_size <= MAX_FILE_BYTES else b""
                name = file.relative_to(path).as_posix()
                yield name, File(name, _packed_digests(content))
            return
        with zipfile.ZipFile(path) as archive:
            members = [m for m in archive.infolist() if not m.is_dir()]
            if len(members) > MAX_MEMBERS:
                raise NamesError(f"{path.name} has more than {MAX_MEMBERS} files.")
            for member in members:
                content = archive.read(member) if member.file_size <= MAX_FILE_BYTES else b""
                yield member.filename, File(member.filename, _packed_digests(content))
    except (OSError, zipfile.BadZipFile, RuntimeError, NotImplementedError, EOFError) as error:
        raise NamesError(f"{path} cannot be read as a zip archive or folder ({error}).") from None


def _packed_digests(content: bytes) -> frozenset[str]:
    """Return the digest of a file, and those of what is packed in it."""
    found = {_digest_content(content)} if content else set()
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            for member in archive.infolist()[:1000]:
                if not member.is_dir() and member.file_size <= MAX_FILE_BYTES:
                    found.add(_digest_content(archive.read(member)))
    except Exception:  # noqa: BLE001 - a stranger's file, which need be no archive
        return frozenset(found)
    return frozenset(found)


def _digest_content(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _comparable_name(name: str) -> str:
    """Return a name in the form in which equal ones are equal."""
    return " ".join(unicodedata.normalize("NFC", name).casefold().split())
