"""What a course's chapters are divided into: where a check says to read on must be there."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from pathlib import Path

from autograder.assignments.cells import AssignmentBuildError
from course.util.close_matches import did_you_mean

_TITLE = re.compile(r"^# # Chapter (\d+)\b", re.MULTILINE)
_HEADING = r"#{2,} (?P<heading>.+?)(?: \([^()]*\))?"
_PART = r"\*\*(?P<part>[^*]+?)\.\*\*.*"
_SECTION = re.compile(f"^# (?:{_HEADING}|{_PART})$")
_CHAPTER = re.compile(r"Chapter (\d+), ")
_NAME = re.compile("“([^”]+)”")


def find_sections(root: Path) -> dict[str, list[str]]:
    """Return what the chapters of the course at ``root`` are divided into, by their numbers.

    These are their headings, without what stands in parentheses at the end, and the parts of a
    section that begin with a name in bold letters and a full stop.
    """
    sections: dict[str, list[str]] = {}
    for path in sorted((root / "authoring" / "chapters").glob("*.py")):
        text = path.read_text(encoding="utf-8")
        if title := _TITLE.search(text):
            found = (_SECTION.match(line) for line in text.splitlines())
            sections[title[1]] = [match["heading"] or match["part"] for match in found if match]
    return sections


def require_sections(
    sections: Mapping[str, Iterable[str]], exercise: str, read: Mapping[str, str]
) -> None:
    """Require that what checks name in a chapter is in it.

    Args:
        sections: the chapters' sections, see `find_sections`. What is said of another chapter, or
            of something else, is not looked at.
        exercise: the name of the exercise.
        read: {check: where to read on}, as in ``Chapter 5, “Nodes: the processing units”``.

    Raises:
        AssignmentBuildError: a section is not there; it names the check, and one that may be meant.
    """
    for check, text in read.items():
        chapter = _CHAPTER.match(text)
        if chapter is None or chapter[1] not in sections:
            continue
        known = list(sections[chapter[1]])
        for name in _NAME.findall(text):
            if name not in known:
                raise AssignmentBuildError(
                    f"The check '{check}' of the exercise '{exercise}' says to read “{name}” in "
                    f"chapter {chapter[1]}, which has no such section.{did_you_mean(name, known)}"
                )
