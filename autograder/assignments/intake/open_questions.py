"""Which submissions a person is asked about, because it is not clear what was handed in.

While a question is open, the student's score is no number that could be passed on: it may be zero
only because a file has another name. A question is open as long as nbgrader's gradebook says that
one of its cells waits for a person, so marks given by hand close it, and so does a claim.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from autograder.util.state_table import StateTable

KIND = "question"


@dataclass(frozen=True)
class OpenQuestion:
    """What is not clear about one notebook of a student, and the ``cells`` that it is about."""

    why: str
    cells: tuple[str, ...]


def keep_question(
    work: Path, assignment: str, student: str, notebook: str, question: OpenQuestion | None
) -> None:
    """Keep the question about a notebook, or that there is none; raises OSError if it cannot."""
    table = StateTable(work, KIND, assignment)
    if question is None:
        table.remove(student, notebook)
    else:
        table.put(json.dumps(asdict(question)), student, notebook)


def of_assignment(work: Path, assignment: str) -> dict[str, dict[str, OpenQuestion]]:
    """Return {student: {notebook: question}}."""
    found: dict[str, dict[str, OpenQuestion]] = {}
    for (student, notebook), text in StateTable(work, KIND, assignment).rows().items():
        data = json.loads(text)
        question = OpenQuestion(str(data["why"]), tuple(map(str, data["cells"])))
        found.setdefault(student, {})[notebook] = question
    return found


def open_ones(
    questions: Mapping[str, OpenQuestion], waiting: Mapping[str, Collection[str]]
) -> dict[str, str]:
    """Return {notebook: why} of the questions of which a cell is among those ``waiting``."""
    return {
        notebook: question.why
        for notebook, question in questions.items()
        if set(question.cells) & set(waiting.get(notebook, ()))
    }
