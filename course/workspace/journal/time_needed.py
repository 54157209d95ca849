"""How long a notebook takes, as it says or as an estimate: nobody plans by a number of cells."""

from __future__ import annotations

import re

WORDS_A_MINUTE = 150
"""How fast one reads what one has not read before."""

CELL_MIN = 1.0
"""Minutes to run a cell, and to look at what it shows."""

TASK_MIN = 30.0
"""Minutes for a cell in which a solution is to be written."""

ANSWER_MIN = 5.0
"""Minutes for an answer in words."""

QUIZ_MIN = 10.0
"""Minutes for an attempt at a quiz."""

_STEP_MIN = 10

_SAID = re.compile(r"\btakes?\s+about\s+(\d{1,3})\s+(minutes|hours)\b")


def find_minutes(text: str) -> int | None:
    """Return the minutes of the first sentence in ``text`` that says how long something takes.

    >>> find_minutes("You build a node. This takes about 3 hours.")
    180
    """
    said = _SAID.search(text)
    return said and int(said[1]) * (60 if said[2] == "hours" else 1)


def estimate_minutes(words: int, cells: int, tasks: int, answers: int, *, quiz: bool) -> int:
    """Return minutes, a multiple of ten.

    Args:
        words: words of text to read.
        cells: code cells to run.
        tasks: those among them in which a solution is to be written.
        answers: answers in words that it asks for.
        quiz: whether it shows a quiz.
    """
    minutes = words / WORDS_A_MINUTE + cells * CELL_MIN + tasks * TASK_MIN + answers * ANSWER_MIN
    minutes += QUIZ_MIN if quiz else 0
    return max(1, round(minutes / _STEP_MIN)) * _STEP_MIN


def format_minutes(minutes: int) -> str:
    """Return minutes as people say them: "1 h 10 min"."""
    hours, rest = divmod(minutes, 60)
    parts = [f"{hours} h"] * bool(hours) + [f"{rest} min"] * bool(rest or not hours)
    return " ".join(parts)
