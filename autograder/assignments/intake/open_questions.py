"""Which submissions a person is asked about, because it is not clear what was handed in.

While a question is open, the student's score is no number that could be passed on: it may be zero
only because a file has another name. A question is open as long as nbgrader's gradebook says that
one of its cells waits for a person, so marks given by hand close it, and so does a claim.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path

from autograder.util.files import write_whole

FOLDER = "asked"


@dataclass(frozen=True)
class Question:
    """What is not clear about one notebook of a student, and the ``cells`` that it is about."""

    why: str
    cells: tuple[str, ...]


def keep_question(
    work: Path, assignment: str, student: str, notebook: str, question: Question | None
) -> None:
    """Keep the question about a notebook, or that there is none; raises OSError if it cannot."""
    path = work / FOLDER / assignment / student / f"{notebook}.json"
    if question is None:
        path.unlink(missing_ok=True)
    else:
        data = {"student": student, "why": question.why, "cells": question.cells}
        write_whole(path, json.dumps(data))


def of_assignment(work: Path, assignment: str) -> dict[str, dict[str, Question]]:
    """Return {student: {notebook: question}}; what cannot be read is left out."""
    found: dict[str, dict[str, Question]] = {}
    for path in sorted((work / FOLDER / assignment).glob("*/*.json")):
        try:
            data = json.loads(path.read_text(encoding="utf-8"))
            question = Question(str(data["why"]), tuple(map(str, data["cells"])))
            found.setdefault(str(data["student"]), {})[path.stem] = question
        except (OSError, ValueError, KeyError, TypeError):
            continue
    return found


def open_ones(
    questions: Mapping[str, Question], waiting: Mapping[str, Collection[str]]
) -> dict[str, str]:
    """Return {notebook: why} of the questions of which a cell is among those ``waiting``."""
    return {
        notebook: question.why
        for notebook, question in questions.items()
        if set(question.cells) & set(waiting.get(notebook, ()))
    }
