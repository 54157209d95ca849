"""The names of files in what Moodle and Canvas let a teacher download: who handed in, and what.

Moodle ("Download all submissions"; ``mod/assign/classes/downloader.php``, before 4.1
``assign::download_submissions`` in ``mod/assign/locallib.php``): the full name, in which spaces
stand for underscores, the participant's number in this assignment, and the plugin, as a folder or
(without "Download submissions in folders") as the beginning of each name::

    Ada Lovelace_123456_assignsubmission_file/qos-design.ipynb      since 4.1
    Ada Lovelace_123456_assignsubmission_file_/qos-design.ipynb     3.1 to 4.0
    Ada Lovelace_123456_assignsubmission_file_qos-design.ipynb      flat

The full name may have a group's in front, with a hyphen; with blind marking it is "Participant",
and where groups hand in together name and number are the group's. ``clean_filename`` takes
``& < > " ` | ' : \\ /`` out of it.

Canvas ("Download Submissions"; ``lib/content_zipper.rb``): the sortable name in lower case with
letters and digits alone, ``LATE`` if it is, the user's number, that of the file, and its name::

    lovelaceada_12345_67890_qos-design.ipynb
    lovelaceada_LATE_12345_67890_qos-design-1.ipynb

With anonymous grading it begins with ``anon_`` and five letters or digits, behind ``LATE`` if that
is there. What a student hands in again under one name has ``-1``, ``-2`` and so on in front of its
ending (``Attachment.make_unique_filename``).
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Collection
from dataclasses import dataclass

_MOODLE = re.compile(
    r"(?P<who>[^_/]*)_(?P<number>\d+)_(?P<plugin>assign[a-z]*_[a-z]+)(?:_?/|_)(?P<place>.+)", re.S
)
_CANVAS = re.compile(
    r"(?:(?P<who>.+?)(?:_(?P<late>LATE))?_(?P<number>\d+)"
    r"|(?:(?P<anon_late>LATE)_)?anon_(?P<anon>[A-Za-z0-9]+))_(?P<file>\d+)_(?P<place>.+)",
    re.S,
)
_AGAIN = re.compile(r"-\d{1,2}(?=(?:\.[A-Za-z][A-Za-z0-9]*)+$)")


@dataclass(frozen=True)
class DownloadName:
    """What the name of a downloaded file says.

    Attributes:
        who: the student as the platform writes the name; empty if it hides it.
        number: the platform's number of the student; Moodle's is that of the participant in this
            assignment, Canvas's the user's.
        place: the path of the file in what was handed in.
        plugin: Moodle's, as in ``assignsubmission_file``; empty for Canvas.
        late: Canvas says that it came late.
    """

    who: str
    number: str
    place: str
    plugin: str = ""
    late: bool = False


def parse_moodle(name: str) -> DownloadName | None:
    """Return what a name of Moodle's says, with folders in front of it or not; None if it is none.

    >>> parse_moodle("Ada Lovelace_12_assignsubmission_file_/work/a.ipynb").place
    'work/a.ipynb'
    """
    parts = name.split("/")
    for first in range(len(parts)):
        if found := _MOODLE.fullmatch("/".join(parts[first:])):
            return DownloadName(found["who"], found["number"], found["place"], found["plugin"])
    return None


def parse_canvas(name: str) -> DownloadName | None:
    """Return what a name of Canvas's says, with folders in front of it or not; None if it is none.

    >>> parse_canvas("lovelaceada_LATE_12_345_a-1.ipynb").number
    '12'
    """
    found = _CANVAS.fullmatch(name.rpartition("/")[2])
    if found is None:
        return None
    late = bool(found["late"] or found["anon_late"])
    return DownloadName(
        found["who"] or "", found["number"] or found["anon"], found["place"], late=late
    )


def first_name(place: str, expected: Collection[str]) -> str:
    """Return a file's name without Canvas's ``-1``, if it then is one of those ``expected``.

    >>> first_name("qos-design-1.ipynb", {"qos-design.ipynb"})
    'qos-design.ipynb'
    >>> first_name("map-2.png", {"qos-design.ipynb"})
    'map-2.png'
    """
    plain = _AGAIN.sub("", place)
    return plain if plain in expected else place


def letters_of(name: str) -> str:
    """Return the letters and digits of a name, in the form in which both platforms' are equal.

    >>> letters_of("O'Hara, Ann")
    'oharaann'
    """
    text = unicodedata.normalize("NFC", name).casefold()
    return "".join(letter for letter in text if letter.isalnum() or unicodedata.combining(letter))
