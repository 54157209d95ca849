"""Read a student's notebooks: which kind each is, its sections, and what is written in it."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from course.workspace.journal.time_needed import estimate_minutes, find_minutes

MAX_FILE_BYTES = 64 * 1024 * 1024  # bytes; outputs and pictures are in the file, too
STUB = "Your answer goes here"
"""Words of the text that stands where an answer is to be written."""

BEGINNING = "The beginning"
"""Title of the cells before a chapter's first section."""

_OURS = re.compile(r"[0-9a-f]{12}(-\d+)?")
"""Id of a cell of a chapter, as `autograder build` gives it. A cell that a student has made has
another one: JupyterLab's has more digits, other editors' fewer."""

_HEADING = re.compile(r"(#{1,3}) (.+)")
_CHECK = re.compile(r"^check\(\s*[\"']([\w-]+)[\"']\s*\)", re.MULTILINE)
_QUIZ = re.compile(r"quizzes\.load\(\s*[\"']([\w-]+)[\"']")


@dataclass(frozen=True)
class Section:
    """A part of a chapter under a heading: its title and the ids of its code cells."""

    title: str
    cells: tuple[str, ...]


@dataclass(frozen=True)
class StudentNotebook:
    """What matters of one notebook.

    Attributes:
        path: its file, relative to the working copy.
        title: its first heading.
        sections: those with cells of the course to run, in order; a student's own cells and empty
            ones are none.
        exam: name of the exam whose check cell it has; empty if none.
        quiz: name of the quiz that it shows; empty if none.
        written: how many of its answers in words have been written.
        to_write: how many answers in words it asks for.
        minutes: how long it takes to work through, as its first text says or as an estimate.
        problem: why it cannot be read; empty if it can.
    """

    path: Path
    title: str
    sections: tuple[Section, ...] = ()
    exam: str = ""
    quiz: str = ""
    written: int = 0
    to_write: int = 0
    minutes: int = 0
    problem: str = ""


def read_notebook(folder: Path, path: Path) -> StudentNotebook:
    """Read the notebook ``folder / path``; one that cannot be read says why."""
    try:
        file = folder / path
        if not file.is_file():
            return StudentNotebook(path, path.stem, problem="it is not there")
        if file.stat().st_size > MAX_FILE_BYTES:
            return StudentNotebook(path, path.stem, problem="it is larger than 64 MB")
        cells = [_Cell(cell) for cell in json.loads(file.read_text(encoding="utf-8"))["cells"]]
    except OSError as error:
        return StudentNotebook(path, path.stem, problem=error.strerror or str(error))
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return StudentNotebook(path, path.stem, problem="it is damaged")
    code = "\n".join(cell.source for cell in cells if cell.code)
    titles = [title for cell in cells for _, title in cell.headings]
    answers = [cell.source for cell in cells if cell.by_hand and not cell.code]
    quiz = _first_match(_QUIZ, code)
    return StudentNotebook(
        path, titles[0] if titles else path.stem, _find_sections(cells),
        _first_match(_CHECK, code), quiz,
        sum(bool(answer.strip()) and STUB not in answer for answer in answers), len(answers),
        _count_minutes(cells, len(answers), quiz=bool(quiz)),
    )  # fmt: skip


def _count_minutes(cells: list[_Cell], answers: int, *, quiz: bool) -> int:
    first = next((cell.source for cell in cells if not cell.code), "")
    if said := find_minutes(first):
        return said
    words = sum(len(cell.source.split()) for cell in cells if not cell.code and not cell.by_hand)
    run = sum(cell.code for cell in cells if cell.source.strip())
    tasks = sum(cell.code and cell.is_task for cell in cells)
    return estimate_minutes(words, run, tasks, answers, quiz=quiz)


class _Cell:
    def __init__(self, cell: dict[str, Any]) -> None:
        source = cell["source"]
        self.source: str = source if isinstance(source, str) else "".join(source)
        self.code = cell["cell_type"] == "code"
        self.id = str(cell.get("id", ""))
        settings = cell.get("metadata", {}).get("nbgrader") or {}
        self.is_task = bool(settings.get("solution"))
        self.by_hand = bool(settings.get("grade") and settings.get("solution"))
        self.headings: list[tuple[int, str]] = []
        if not self.code:
            found = (_HEADING.fullmatch(line.rstrip()) for line in self.source.splitlines())
            self.headings = [(len(match[1]), match[2]) for match in found if match]


def _find_sections(cells: list[_Cell]) -> tuple[Section, ...]:
    sections: list[tuple[str, list[str]]] = []
    path = {1: "", 2: "", 3: ""}
    for cell in cells:
        for level, title in cell.headings:
            path = {n: title if n == level else (path[n] if n < level else "") for n in path}
            name = ": ".join(path[n] for n in (2, 3) if path[n])
            sections.append((name or BEGINNING, []))
        if cell.code and cell.source.strip() and _OURS.fullmatch(cell.id):
            if not sections:
                sections.append((BEGINNING, []))
            sections[-1][1].append(cell.id)
    return tuple(Section(title, tuple(ids)) for title, ids in sections if ids)


def _first_match(pattern: re.Pattern[str], text: str) -> str:
    match = pattern.search(text)
    return match[1] if match else ""
