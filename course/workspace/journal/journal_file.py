"""The journal of a working copy: which cells have run, and what the checks found, in one file.

The file is replaced whole, under a lock, so that neither a crash nor a second notebook can spoil
it; it is bounded, because an entry replaces the one before. What cannot be read is kept aside.
"""

from __future__ import annotations

import datetime
import json
import os
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from course.errors import CourseError
from course.util.files import write_text

FILE = "progress.json"
MANIFEST = ".ros2-course.json"
"""File by which a working copy is known; `course.workspace.working_copy` writes it."""

VERSION = 1
MAX_FILE_BYTES = 4 * 1024 * 1024
MAX_CELLS = 5_000
"""Cells that are remembered: of more, those that ran last. A chapter has about 30."""

MAX_EXAMS, MAX_TITLES, MAX_TEXT = 200, 100, 300
LOCK_TIMEOUT_S = 5.0
"""Seconds to wait for another notebook that is writing; it needs milliseconds."""


class JournalError(CourseError):
    """A journal that is not there or cannot be written."""


@dataclass(frozen=True)
class Checked:
    """What the visible checks of an exam found when they ran last, and when they found the best.

    ``when`` and ``score`` are of the last run, in UTC as ISO 8601 and of ``max_score`` points;
    ``best`` is the most so far, with the titles of the checks that ``passed`` and were ``open``
    then: a check that runs before the cells with the work has run takes nothing away.
    """

    when: str
    score: float
    max_score: float
    best: float
    passed: tuple[str, ...]
    open: tuple[str, ...]


@dataclass
class Entries:
    """All that a journal remembers.

    ``cells`` is {cell id: when it last ran without an error, UTC in ISO 8601}, ``checks`` is by
    exam, ``notice`` a sentence about the file that should be known.
    """

    cells: dict[str, str] = field(default_factory=dict)
    checks: dict[str, Checked] = field(default_factory=dict)
    notice: str = ""


class Journal:
    """The journal of the working copy ``folder``."""

    def __init__(self, folder: Path) -> None:
        """Use ``folder``; nothing is written before there is something to remember."""
        self.folder = folder
        self.path = folder / FILE

    def read(self) -> Entries:
        """Return what is remembered; a damaged file is kept aside, and a new journal begins."""
        try:
            return _parse_entries(self._read_content())
        except FileNotFoundError:
            return Entries()
        except OSError as error:
            return Entries(notice=f"{self.path} cannot be read ({error.strerror or error}).")
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
            return Entries(notice=self._put_aside())

    def record_run(self, cell: str) -> None:
        """Remember that a cell ran without an error.

        Raises:
            JournalError: the journal cannot be written.
        """

        def add(entries: Entries) -> None:
            entries.cells.pop(cell, None)  # to the end: the dictionary is in the order of time
            entries.cells[cell[:MAX_TEXT]] = _utc_now()
            for oldest in list(entries.cells)[:-MAX_CELLS]:
                del entries.cells[oldest]

        self._change_entries(add)

    def record_checks(
        self, exam: str, score: float, max_score: float, passed: Iterable[str], left: Iterable[str]
    ) -> None:
        """Remember what an exam's visible checks found: points, and the titles of the checks.

        Raises:
            JournalError: the journal cannot be written.
        """

        def add(entries: Entries) -> None:
            before = entries.checks.pop(exam, None)
            found = Checked(
                _utc_now(), score, max_score, score, _limit_titles(passed), _limit_titles(left)
            )
            if before and before.max_score == max_score and before.best > score:
                found = replace(before, when=found.when, score=score)
            entries.checks[exam] = found
            for oldest in list(entries.checks)[:-MAX_EXAMS]:
                del entries.checks[oldest]

        self._change_entries(add)

    def _change_entries(self, change: Callable[[Entries], None]) -> None:
        lock = self.path.with_name(f".{FILE}.lock")
        try:
            # Where no file can be made, say so at once: the library would wait or make folders.
            os.close(os.open(lock, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644))
            with FileLock(lock, timeout=LOCK_TIMEOUT_S):
                entries = self.read()
                change(entries)
                write_text(self.path, _format_entries(entries))
        except Timeout:
            raise JournalError(
                f"Your progress was not noted: another program has held {self.path} for "
                f"{LOCK_TIMEOUT_S:.0f} s. Your work itself is not affected."
            ) from None
        except (OSError, NotImplementedError) as error:
            reason = getattr(error, "strerror", None) or error
            raise JournalError(
                f"Your progress cannot be noted in {self.path} ({reason}): make room there, or "
                "make the folder writable. Your work itself is not affected."
            ) from None

    def _read_content(self) -> str:
        if self.path.exists() and not self.path.is_file():
            raise OSError(0, "it is not a file")
        with self.path.open("rb") as file:
            content = file.read(MAX_FILE_BYTES + 1)
        if len(content) > MAX_FILE_BYTES:
            raise ValueError("too long")
        return content.decode("utf-8")

    def _put_aside(self) -> str:
        number = 1
        while (aside := self.path.with_name(f"{FILE}.corrupt-{number}")).exists():
            number += 1
        try:
            self.path.rename(aside)
        except OSError as error:
            return f"{self.path} is damaged and cannot be put aside ({error.strerror or error})."
        return (
            f"{FILE} was damaged: it is kept as {aside.name}, and what you ran and checked before "
            "is not counted. Your notebooks are as they were."
        )


def journal_here(folder: Path | None = None) -> Journal | None:
    """Return the journal of the working copy around ``folder``; None outside of any."""
    try:
        here = (folder or Path.cwd()).absolute()
    except OSError:  # the current folder has been removed
        return None
    for place in (here, *here.parents):
        if (place / MANIFEST).is_file():
            return Journal(place)
    return None


def _parse_entries(text: str) -> Entries:
    data = json.loads(text)
    if data["version"] != VERSION:
        raise ValueError("another version")
    cells = {_check_word(cell): _check_moment(when) for cell, when in data["cells"].items()}
    checks = {_check_word(exam): _parse_checked(found) for exam, found in data["checks"].items()}
    return Entries(cells, checks)


def _parse_checked(found: dict[str, Any]) -> Checked:
    score, most, best = (float(found[name]) for name in ("score", "max_score", "best"))
    if not (0 <= score <= best <= most < 1e6):
        raise ValueError("impossible points")
    return Checked(
        _check_moment(found["when"]),
        score,
        most,
        best,
        _limit_titles(found["passed"]),
        _limit_titles(found["open"]),
    )


def _limit_titles(titles: Iterable[str]) -> tuple[str, ...]:
    return tuple(_check_word(title[:MAX_TEXT]) for title in list(titles)[:MAX_TITLES])


def _check_word(value: Any) -> str:
    if not isinstance(value, str) or not 0 < len(value) <= MAX_TEXT:
        raise ValueError("a text of the wrong kind")
    return value


def _check_moment(value: Any) -> str:
    if datetime.datetime.fromisoformat(_check_word(value)).tzinfo is None:
        raise ValueError("a time without a zone")
    return str(value)


def _utc_now() -> str:
    return datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")


def _format_entries(entries: Entries) -> str:
    checks = {exam: asdict(found) for exam, found in entries.checks.items()}
    data = {"version": VERSION, "cells": entries.cells, "checks": checks}
    return json.dumps(data, ensure_ascii=False, indent=1) + "\n"
