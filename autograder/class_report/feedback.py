"""The most common feedback: what was observed, grouped with numbers and names taken out."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from autograder.class_report import figures
from autograder.class_report.class_data import ClassData

MAX_GROUPS = 20
"""Most groups on the page."""
MAX_CHARS = 240
"""Characters of an observation that count; a student's error message can be of any length."""

# Quotes around something short: a name, a value. An apostrophe inside a word is none.
_QUOTED = re.compile(r"""(?<!\w)(?:'[^'\n]{0,200}'|"[^"\n]{0,200}"|`[^`\n]{0,200}`)(?!\w)""")
_CURLY = re.compile(r"\u2018[^\u2019\n]{0,200}\u2019")
_ANGLE = re.compile(r"<[^<>\n]{1,200}>")
_TOPIC = re.compile(r"(?<![\w/])(?:/\w+)+")
_NUMBER = re.compile(r"(?<![A-Za-z_])[-+]?(?:0x[0-9a-fA-F]+|\d+(?:[.,]\d+)*(?:[eE][-+]?\d+)?)")
_LIST = re.compile(r"#(?:(?:, | and |, and |; )#)+")


@dataclass(frozen=True)
class FeedbackGroup:
    """One observation that several submissions share.

    Attributes:
        about: the title of the check, or "the notebook" for what its own cells raised.
        text: what was observed, with ``#`` for numbers and ``…`` for names.
        students: who, sorted.
    """

    about: str
    text: str
    students: tuple[str, ...]


def common_groups(data: ClassData) -> list[FeedbackGroup]:
    """Return the groups of what was observed, the most common first."""
    groups: dict[tuple[str, str], set[str]] = {}
    for student, about, text in _collect_observations(data):
        groups.setdefault((about, strip_details(text, [student])), set()).add(student)
    found = (
        FeedbackGroup(about, text, tuple(sorted(who))) for (about, text), who in groups.items()
    )
    return sorted(found, key=lambda group: (-len(group.students), group.about, group.text))


def strip_details(text: str, names: Iterable[str] = ()) -> str:
    """Return ``text`` with what differs from one submission to the next taken out.

    Quoted words, what stands in angle brackets, topics and ``names`` become ``…``; numbers, and
    enumerations of numbers, ``#``.
    """
    text = " ".join(text[: 4 * MAX_CHARS].split())
    for name in names:
        if len(name) > 2:  # a shorter one stands inside too many ordinary words
            text = re.sub(rf"(?<!\w){re.escape(name)}(?!\w)", "…", text)
    text = _ANGLE.sub("…", _CURLY.sub("…", _QUOTED.sub("…", text)))
    text = _NUMBER.sub("#", _TOPIC.sub("…", text))
    text = _LIST.sub("#", text)
    return text if len(text) <= MAX_CHARS else text[: MAX_CHARS - 1] + "…"


def _collect_observations(data: ClassData) -> Iterator[tuple[str, str, str]]:
    """Yield (student, about, text) for what failed, and for what a notebook's own cells raised."""
    for student, _, result in figures.check_results(data):
        if result.status == "failed" and result.actual:
            yield student, result.title, result.actual
    for student, notebooks in data.records.items():
        for record in notebooks.values():
            for note in record.notes:
                yield student, "the notebook", note
