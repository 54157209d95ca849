"""Read when a submission was handed in, as the person or program that wrote the time meant it.

nbgrader's own reader takes a zone that it does not know for UTC (``CEST``, ``PST``) and ``+0100``
for a hundred seconds: an hour or two by which a student is late, or not. Here a time has one
meaning or is left to a person, and what nbgrader gets to read is always UTC.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta, timezone, tzinfo
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

from dateutil import parser

ZONES: dict[str, float] = {
    "UTC": 0, "GMT": 0, "Z": 0, "UT": 0, "WET": 0, "WEST": 1, "CET": 1, "CEST": 2, "MEZ": 1,
    "MESZ": 2, "EET": 2, "EEST": 3, "MSK": 3, "WAT": 1, "CAT": 2, "EAT": 3, "SAST": 2,
    "NST": -3.5, "NDT": -2.5, "ADT": -3, "EST": -5, "EDT": -4, "MDT": -6, "MST": -7,
    "PDT": -7, "PST": -8, "AKDT": -8, "AKST": -9, "HST": -10, "BRT": -3, "ART": -3,
    "PKT": 5, "WIB": 7, "HKT": 8, "SGT": 8, "AWST": 8, "JST": 9, "KST": 9, "ACST": 9.5,
    "ACDT": 10.5, "AEST": 10, "AEDT": 11, "NZST": 12, "NZDT": 13,
}  # fmt: skip
"""Hours ahead of UTC. Not among them are those of which there are several in use: IST (India,
Ireland, Israel), CST (Chicago, China, Cuba), BST (Britain, Bangladesh), AST, GST, CDT and so on."""

_NAMED = re.compile(r"(?P<zone>[A-Z][A-Za-z]+(?:/[A-Z][A-Za-z_+-]+)+)\s*$")
_OFFSET = re.compile(r"(?:UTC|GMT)?\s*(?P<sign>[+-])(?P<h>\d{1,2}):?(?P<m>\d\d)?\s*$")
_ORDERED = re.compile(r"(?<!\d)(\d{1,2})([./-])(\d{1,2})\2(\d{4})(?!\d)")
_COMMENT = re.compile(r"\s*\([A-Za-z ]*\)$")
_FULL_YEAR = re.compile(r"(?<!\d)\d{4}(?!\d)|^\s*\d{8}T?\d{4,6}\s*$")
_CLOCK = re.compile(r"\d{1,2}:\d\d")
_HALVES = ("AM", "PM")
_LONGEST_OFFSET = timedelta(hours=14)


class UnclearTimeError(ValueError):
    """A time that may be several, or is not whole; the message says why, for a person."""


def parse_time(text: str, zone: str = "") -> datetime:
    """Return the time that a text names, in UTC; one without a zone is UTC, as in nbgrader.

    Args:
        text: as in ``2026-11-27 20:15:05.123456 UTC``, ``2026-11-27T20:15+01:00``,
            ``27.11.2026 20:15 MEZ`` or ``Fri Nov 27 20:15:05 CET 2026``.
        zone: the name of the course's own zone, as in ``Europe/Berlin``; what its clocks call
            themselves is understood, too.

    Raises:
        UnclearTimeError: it could be several, or is not whole.
        ValueError: it is no time at all.
    """
    clear = _year_first(_without_comment(" ".join(text.split())))
    moment, where = _split_zone(clear, zone)
    if moment.tzinfo is None:
        moment = moment.replace(tzinfo=where)
    try:
        return moment.astimezone(UTC)
    except (OverflowError, ValueError):
        raise ValueError("it holds no date") from None


def _without_comment(text: str) -> str:
    """Return a text without the name in brackets that follows a zone; without one it is the zone.

    JavaScript writes ``GMT+0100 (Central European Standard Time)``, people ``20:15 (CEST)``.
    """
    bare = _COMMENT.sub("", text)
    words = re.findall(r"[A-Za-z]{1,5}", bare)
    if _split_offset(bare) is not None or _NAMED.search(bare) or any(map(_is_zone, words)):
        return bare
    return text.replace("(", " ").replace(")", " ")


def _year_first(text: str) -> str:
    """Return a text whose date, if it is all numbers, begins with the year."""
    if (found := _ORDERED.search(text)) is None:
        return text
    first, mark, second, year = int(found[1]), found[2], int(found[3]), found[4]
    if mark == "." or first > 12:
        day, month = first, second
    elif second > 12 or first == second:
        month, day = first, second
    else:
        raise UnclearTimeError(
            f"'{found[0]}' can be {_format_date(first, second)} or {_format_date(second, first)}"
        )
    return f"{text[: found.start()]}{year}-{month:02}-{day:02}{text[found.end() :]}"


def _format_date(day: int, month: int) -> str:
    return f"{day} {datetime(2000, month, 1):%B}"


def _split_zone(text: str, zone: str) -> tuple[datetime, tzinfo]:
    """Return the time in a text, and the zone that it names; UTC if it names none."""
    if (found := _split_offset(text)) is not None:
        rest, where = found
        return _parse_date(rest), where
    if named := _NAMED.search(text):
        try:
            return _parse_date(text[: named.start()]), ZoneInfo(named["zone"])
        except (ZoneInfoNotFoundError, ValueError, OSError):
            raise UnclearTimeError(f"the time zone '{named['zone']}' is not known") from None
    written = [word for word in re.findall(r"[A-Za-z]{1,5}", text) if _is_zone(word)]
    if not written:
        return _parse_date(text), UTC
    if len(set(written)) > 1:
        raise UnclearTimeError(f"it names several time zones: {', '.join(written)}")
    rest = re.sub(rf"(?<![A-Za-z]){written[0]}(?![A-Za-z])", " ", text)
    moment = _parse_date(rest)
    return moment, _find_zone(written[0], moment, zone)


def _split_offset(text: str) -> tuple[str, tzinfo] | None:
    found = _OFFSET.search(text)
    # In "2026-11-27" the last number is no offset: one follows a clock time or a word.
    if found is None or not _CLOCK.search(text[: found.start()]):
        return None
    ahead = timedelta(hours=int(found["h"]), minutes=int(found["m"] or 0))
    if ahead > _LONGEST_OFFSET or int(found["m"] or 0) > 59:
        raise UnclearTimeError(f"'{found[0].strip()}' is no time zone")
    return text[: found.start()], timezone(-ahead if found["sign"] == "-" else ahead)


def _is_zone(word: str) -> bool:
    """Whether a word in a time stands for a zone, rather than for a day, a month or a half."""
    if word in ("T", *_HALVES) or word.lower() in ("am", "pm"):
        return False
    info = parser.parserinfo()
    return info.weekday(word) is None and info.month(word) is None and word.isupper()


def _find_zone(word: str, moment: datetime, zone: str) -> tzinfo:
    for own in _course_zones(zone):
        local = moment.replace(tzinfo=own)
        for fold in (0, 1):  # the hour that is there twice when summer ends
            if local.replace(fold=fold).tzname() == word:
                offset = local.replace(fold=fold).utcoffset()
                assert offset is not None
                return timezone(offset)
    if word not in ZONES:
        raise UnclearTimeError(f"the time zone '{word}' is not known, or there are several")
    return timezone(timedelta(hours=ZONES[word]))


def _course_zones(zone: str) -> Iterator[ZoneInfo]:
    try:
        if zone:
            yield ZoneInfo(zone)
    except (ZoneInfoNotFoundError, ValueError, OSError):
        return


def _parse_date(text: str) -> datetime:
    """Return the date and time in a text without a zone; both have to be there."""
    # With two defaults that differ in all parts, what is not in the text differs, too.
    defaults = datetime(2001, 2, 3, 4, 5), datetime(2012, 11, 10, 9, 8)
    try:
        read: list[datetime] = [parser.parse(text, default=default) for default in defaults]
    except (ValueError, OverflowError, TypeError):
        raise ValueError("it holds no date") from None
    first, second = read
    if first.replace(second=0, microsecond=0) != second.replace(second=0, microsecond=0):
        raise UnclearTimeError("it holds no full date and time")
    if not re.search(r"(?<!\d)\d{4}(?!\d)", text) and not re.fullmatch(
        r"\d{8}T?\d{4,6}", text.strip()
    ):
        raise UnclearTimeError("it does not say which of its numbers is the year")
    return first


def for_nbgrader(moment: datetime) -> str:
    """Return a time as nbgrader writes and reads it."""
    return f"{moment.astimezone(UTC):%Y-%m-%d %H:%M:%S.%f} UTC"
