"""The terminal that commands write to: what comes from a submission is shown on it, and no more.

All text goes through here, that of tables included. None of it is markup, and what would act on the
terminal (escape sequences, changes of direction) is shown as an escape.
"""

from __future__ import annotations

import re
from typing import Any

from rich.console import Console
from rich.text import Text

# Control characters but tab and line feed, marks of direction, and halves of surrogate pairs.
_ACTING = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]"
)


class Terminal(Console):
    """A console on which every string is shown as it is read."""

    def __init__(self, **options: Any) -> None:
        """Make a console; ``options`` are rich's."""
        super().__init__(markup=False, highlight=False, emoji=False, **options)

    def render_str(self, text: str, **options: Any) -> Text:
        """Return a string as it is shown: rich asks for this wherever it meets a string."""
        options |= {"markup": False, "emoji": False, "highlight": False}
        return super().render_str(visible_text(text), **options)


def visible_text(text: str) -> str:
    """Return a text in which nothing acts on a terminal."""
    return _ACTING.sub(lambda found: _escape_letter(found[0]), text)


def visible_json(text: str) -> str:
    """Return JSON that means the same, and in which nothing acts on a terminal."""
    return _ACTING.sub(lambda found: f"\\u{ord(found[0]):04x}", text)


def _escape_letter(letter: str) -> str:
    return letter.encode("unicode_escape", "surrogatepass").decode("ascii")
