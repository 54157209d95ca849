"""Attacks on anyone who looks at a hand-in, and on the one process that makes its pages.

They are whole notebooks, handed in beside an honest one and graded as a class is. Each has a right
solution, whose points it must keep: what stands beside a solution takes nothing from it.
`tests/browser/test_hostile_pages.py` opens such pages in a browser.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from html.parser import HTMLParser
from pathlib import Path

import pytest
from nbformat import NotebookNode
from nbformat.v4 import new_code_cell, new_markdown_cell

from autograder.examination import points
from autograder.gradebook.course_gradebook import CourseGradebook
from autograder.grading import engine
from autograder.grading.graded import Graded
from tests.machine import needs_isolation

from .test_hostile import FULL, Class, class_in

pytestmark = needs_isolation

HONEST = "honest"
WRITES_A_MARK = "fetch('/formgrader/api/grade/1', {method: 'PUT', body: '{}'})"


@dataclass(frozen=True)
class HandIn:
    """What somebody has put beside a right solution, and what their feedback says of it.

    ``refused`` is why it cannot be graded as it is, if so: a person is told, and it has no points.
    """

    title: str
    cells: tuple[NotebookNode, ...]
    said: str = ""
    refused: str = ""


HAND_INS = {
    "brackets": HandIn(
        "A text of 400 kB of opening brackets", (new_markdown_cell("[" * 400_000),), "[" * 50
    ),
    "quotes": HandIn(
        "Quotes in quotes, lists in lists, stars in stars, and a table without end",
        tuple(
            new_markdown_cell(text)
            for text in (
                "> " * 20_000 + "a",
                "- " * 20_000 + "a",
                "*a _a " * 30_000,
                "|" * 50_000 + "\n" + "|-" * 50_000,
                "<" * 100_000,
                "`" * 100_001 + "a",
            )
        ),
    ),
    "lexers": HandIn(
        "Code that no lexer comes to the end of, and that never runs",
        (
            new_code_cell("if False:\n    x = " + "(" * 90 + "1" + ")" * 90 + " " * 200_000 + "\\"),
            new_markdown_cell("```python\n" + "f'{" * 30_000 + "\n```"),
        ),
    ),
    "outputs": HandIn(
        "Outputs of escape sequences, and of tags that nobody closes",
        (
            new_code_cell("print('\\x1b[31m\\x1b[1m' * 100_000)"),
            new_code_cell(
                "from IPython.display import HTML, Markdown, display\n"
                "display(HTML('<b>' * 100_000), Markdown('[' * 400_000))"
            ),
        ),
    ),
    "scripts": HandIn(
        "An answer and an output that want to write a mark when they are looked at",
        (
            new_markdown_cell(
                f'<script>{WRITES_A_MARK}</script><img src=x onerror="{WRITES_A_MARK}">'
            ),
            new_code_cell(
                "from IPython.display import HTML, Javascript, display\n"
                f'display(HTML("""<b onmouseover="{WRITES_A_MARK}">x</b>"""))\n'
                f'display(Javascript("""{WRITES_A_MARK}"""))'
            ),
        ),
    ),
    "markup": HandIn(
        "A cell of type [/zap], and escape sequences in a file's name",
        (NotebookNode(cell_type="[/zap]", source="[bold]x[/zap]", metadata={}),),
        refused="save it, and hand it in again",
    ),
}


@dataclass(frozen=True)
class Day:
    """A class that has been graded: its folder, what became of whom, and what it took."""

    root: Path
    graded: dict[str, Graded]
    scores: dict[str, float]
    seconds: float


@pytest.fixture(scope="module")
def day(tmp_path_factory: pytest.TempPathFactory) -> Day:
    class_ = class_in(tmp_path_factory.mktemp("course"))
    for student, cells in {HONEST: (), **{name: h.cells for name, h in HAND_INS.items()}}.items():
        hand_in(class_, student, cells)
    odd = class_.root / "submitted" / "markup" / "ch05" / "\x1b[2J\x1b]0;zap\x07[bold].txt"
    odd.write_text("x")
    began = time.monotonic()
    graded = {g.student: g for g in engine.grade(class_.root, "ch05")}
    seconds = time.monotonic() - began
    scores = {g.student: g.score for g in CourseGradebook(class_.root).read_grades("ch05")}
    return Day(class_.root, graded, scores, seconds)


def hand_in(class_: Class, student: str, cells: Iterable[NotebookNode]) -> None:
    notebook = class_.cases["qos", "right-chapter"].make_submission(*class_.notebooks["qos"])
    notebook.cells[1:1] = cells
    folder = class_.root / "submitted" / student / "ch05"
    folder.mkdir(parents=True)
    file = folder / f"{points.table()['qos'].notebook}.ipynb"
    file.write_text(json.dumps(notebook), encoding="utf-8")  # nbformat refuses some


class Runs(HTMLParser):
    """Collects what a browser would run of a page, if it asks for a mark."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []
        self._script = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._script = tag in ("script", "iframe", "object", "embed", "svg")
        self.found += [f"{n}={v}" for n, v in attrs if n[:2] == "on" and "api/grade" in (v or "")]

    def handle_data(self, data: str) -> None:
        if self._script and "api/grade" in data:
            self.found.append(data)


@pytest.mark.parametrize("student", HAND_INS)
def test_a_hand_in_does_nothing_to_its_readers_and_keeps_its_points(
    student: str, day: Day, record_property: Callable[[str, object], None]
) -> None:
    handed_in, graded = HAND_INS[student], day.graded[student]
    deserved = 0.0 if handed_in.refused else FULL
    for name, value in {
        "attack": f"page of {student}: {handed_in.title}",
        "what the grade says": graded.problem.split(". ")[0] or "every check passed",
        "points got / deserved": f"{day.scores[student]:g} / {deserved:g}",
        "neighbour's points": f"{day.scores[HONEST]:g} of {FULL:g}",
        "neighbour's time": f"the class of {len(day.graded)}: {day.seconds:.1f} s",
    }.items():
        record_property(name, value)
    assert day.scores[HONEST] == FULL
    assert day.scores[student] == deserved, graded
    assert handed_in.refused in graded.problem
    for step in ("autograded", "feedback"):
        assert (day.root / step / student / "ch05").is_dir()
    (page,) = (day.root / "feedback" / student / "ch05").glob("*design.html")
    shown = page.read_text(encoding="utf-8")
    assert handed_in.said in shown
    runs = Runs()
    runs.feed(shown)
    assert not runs.found
