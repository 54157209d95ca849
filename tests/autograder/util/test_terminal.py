"""What comes from a submission is shown on a terminal and does nothing there."""

from __future__ import annotations

import io
import json

import pytest
from rich.table import Table

from autograder.gradebook.course_gradebook import Grade
from autograder.grading import grades_table
from autograder.grading.run_progress import Lines
from autograder.util.terminal import Terminal, visible_json

ACTING = (
    "[/zap] [bold]x[/bold] :boom: \x1b]0;owned\x07 \x1b[2J \x9b2J \u202egnp.exe \r\x08 \ud800 "
    "\\[/zap]"
)


def shown(*things: object, terminal: bool = False) -> str:
    out = Terminal(file=io.StringIO(), force_terminal=terminal, width=400)
    out.print(*things)
    assert isinstance(out.file, io.StringIO)
    return out.file.getvalue()


@pytest.mark.parametrize("terminal", [True, False])
def test_every_string_is_shown_as_it_is_read(terminal: bool) -> None:
    table = Table("Student", ACTING, title=ACTING, caption=ACTING)
    table.add_row("ada", ACTING)
    problems = grades_table.make_table(
        [Grade("ada", 1.0, 2.0, True, {})], {"ada": ACTING, ACTING: "x"}
    )
    for text in (shown(ACTING, terminal=terminal), shown(table, problems, terminal=terminal)):
        assert "[/zap] [bold]x[/bold] :boom: \\x1b]0;owned\\x07" in text
        for letter in ("\x07", "\x08", "\x9b", "\u202e", "\r", "\x1b]", "\x1b[2J"):
            assert letter not in text
        assert r"\u202egnp.exe" in text
        text.encode()  # half of a surrogate pair would not go


def test_what_a_run_says_of_a_submission_does_nothing() -> None:
    out = Terminal(file=io.StringIO(), width=400)
    Lines(out).say(ACTING)
    assert isinstance(out.file, io.StringIO)
    assert "\x1b" not in out.file.getvalue()


def test_json_means_the_same_and_does_nothing() -> None:
    text = visible_json(json.dumps({ACTING: ACTING}, ensure_ascii=False))
    assert json.loads(text) == {ACTING: ACTING}
    assert all(letter.isprintable() for letter in text)
