"""Times of submission have the meaning that they were written with, or are asked about."""

from __future__ import annotations

from datetime import UTC, datetime

import pytest
from nbgrader.utils import parse_utc

from autograder.assignments.intake import times
from autograder.assignments.intake.times import UnclearTimeError


@pytest.mark.parametrize(
    ("text", "utc"),
    [
        ("2026-11-27 20:15:05.123456 UTC", "2026-11-27 20:15:05.123456"),
        ("2026-11-27 20:15:05", "2026-11-27 20:15:05"),
        ("2026-07-27 20:15:05 CEST", "2026-07-27 18:15:05"),
        ("2026-11-27 20:15:05 CET", "2026-11-27 19:15:05"),
        ("27.11.2026, 20:15 MEZ", "2026-11-27 19:15"),
        ("2026-11-27 20:15 PST", "2026-11-28 04:15"),
        ("2026-11-27 8:15:05 pm EST", "2026-11-28 01:15:05"),
        ("2026-11-27 20:15:05 +0100", "2026-11-27 19:15:05"),
        ("2026-11-27 20:15:05 +01", "2026-11-27 19:15:05"),
        ("2026-11-27 20:15:05 UTC+5:30", "2026-11-27 14:45:05"),
        ("2026-11-27 20:15:05 -0800 (PST)", "2026-11-28 04:15:05"),
        ("2026-11-27 20:15 (CEST)", "2026-11-27 18:15"),
        ("2026-11-27 20:15 (PST)", "2026-11-28 04:15"),
        ("2026-11-27T20:15:05Z", "2026-11-27 20:15:05"),
        ("2026-11-27T20:15:05.5-03:30", "2026-11-27 23:45:05.5"),
        ("20261127T201505Z", "2026-11-27 20:15:05"),
        ("2026-11-27 20:15:05 Europe/Berlin", "2026-11-27 19:15:05"),
        ("2026-11-27 20:15:05 America/Los_Angeles", "2026-11-28 04:15:05"),
        ("Fri Nov 27 20:15:05 CET 2026", "2026-11-27 19:15:05"),
        ("Fri, 27 Nov 2026 20:15:05 +0100", "2026-11-27 19:15:05"),
        ("05.06.2026 20:15", "2026-06-05 20:15"),
        ("27/11/2026 20:15", "2026-11-27 20:15"),
        ("11/27/2026 20:15", "2026-11-27 20:15"),
        ("05/05/2026 20:15", "2026-05-05 20:15"),
        ("2026/11/27 20:15", "2026-11-27 20:15"),
    ],
)
def test_a_time_is_read_as_it_was_meant(text: str, utc: str) -> None:
    moment = times.parse_time(text)
    assert moment == datetime.fromisoformat(utc).replace(tzinfo=UTC)
    assert parse_utc(times.for_nbgrader(moment)) == moment.replace(tzinfo=None)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("05/06/2026 20:15", "can be 5 June or 6 May"),
        ("05-06-2026 20:15", "can be 5 June or 6 May"),
        ("2026-11-27 20:15 IST", "'IST' is not known, or there are several"),
        ("2026-11-27 20:15 CST", "'CST'"),
        ("2026-11-27 20:15 BST", "'BST'"),
        ("2026-11-27 20:15 XYZ", "'XYZ'"),
        ("2026-11-27 20:15 America/Nowhere", "'America/Nowhere' is not known"),
        ("2026-11-27 20:15 +9900", "is no time zone"),
        ("2026-11-27", "no full date and time"),
        ("20:15", "no full date and time"),
        ("26-11-27 20:15", "which of its numbers is the year"),
    ],
)
def test_a_time_that_can_be_several_is_asked_about(text: str, why: str) -> None:
    with pytest.raises(UnclearTimeError, match=why):
        times.parse_time(text)


@pytest.mark.parametrize(
    ("text", "zone", "utc"),
    [
        ("2026-11-27 20:15 CST", "America/Chicago", "2026-11-28 02:15"),
        ("2026-11-27 20:15 CST", "Asia/Shanghai", "2026-11-27 12:15"),
        ("2026-11-27 20:15 IST", "Asia/Kolkata", "2026-11-27 14:45"),
        ("2026-10-25 02:30 CEST", "Europe/Berlin", "2026-10-25 00:30"),
        ("2026-10-25 02:30 CET", "Europe/Berlin", "2026-10-25 01:30"),
        ("2026-11-27 20:15 PST", "Europe/Berlin", "2026-11-28 04:15"),
        ("2026-11-27 20:15 CET", "No/Where", "2026-11-27 19:15"),
    ],
)
def test_the_courses_own_zone_settles_what_its_clocks_are_called(
    text: str, zone: str, utc: str
) -> None:
    assert times.parse_time(text, zone) == datetime.fromisoformat(utc).replace(tzinfo=UTC)


@pytest.mark.parametrize("text", ["", "yesterday", "2026-13-40 20:15", "9" * 150, "\x00", "1e999"])
def test_what_is_no_time_is_none(text: str) -> None:
    with pytest.raises(ValueError, match=r"date|year"):
        times.parse_time(text)
