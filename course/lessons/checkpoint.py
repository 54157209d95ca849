"""A checkpoint of a chapter: says in one sentence whether a cell did what the learner meant.

It is no examination and gives no points. A cell that nobody has changed yet is not wrong, so it
never raises an error: it says what has not happened yet, and where to go on.
"""

from __future__ import annotations

import contextlib
import html
from collections.abc import Callable
from dataclasses import dataclass

from course.errors import WaitTimeout
from course.runtime.core_session import CoreSession

PATIENCE_S = 3.0
"""Seconds that a check looks on before it says that something has not happened yet."""


@dataclass(frozen=True)
class Checkpoint:
    """What a check has found.

    Attributes:
        passed: whether it happened.
        sentence: what was seen, or what is missing, in plain words.
    """

    passed: bool
    sentence: str

    def __repr__(self) -> str:
        """Return it as one line of text."""
        return f"{'Yes' if self.passed else 'Not yet'}: {self.sentence}"

    def _repr_html_(self) -> str:
        colour, mark = ("#2a7d2a", "✔ Yes:") if self.passed else ("#b36b00", "… Not yet:")
        style = f"border-left:4px solid {colour};padding:.3em .8em"
        return f'<div style="{style}"><b>{mark}</b> {html.escape(self.sentence)}</div>'


def say_yes(sentence: str) -> Checkpoint:
    """Return that it happened."""
    return Checkpoint(True, sentence)


def say_not_yet(sentence: str) -> Checkpoint:
    """Return that it has not happened yet."""
    return Checkpoint(False, sentence)


def keep_looking(
    session: CoreSession, look: Callable[[], Checkpoint], timeout: float = PATIENCE_S
) -> Checkpoint:
    """Look again and again until a check passes; return what was seen last.

    Args:
        session: the session whose callbacks are looked at; it is asked after each of them.
        look: returns what there is to say at this moment.
        timeout: seconds to look on for.
    """
    seen = [say_not_yet("nothing was looked at.")]

    def passes() -> bool:
        seen[0] = look()
        return seen[0].passed

    with contextlib.suppress(WaitTimeout):
        session.until(passes, timeout, "what the cell should do")
    return seen[0]
