"""Golden texts: what a student reads, word for word. WRITE_GOLDEN=1 writes them again."""

from __future__ import annotations

import os
import re
from pathlib import Path

GOLDEN = Path(__file__).parent / "golden"


def with_titles_of_pictures(text: str) -> str:
    """Return a report's text in which only the title is left of each picture's words.

    When exactly something came differs from run to run; `test_feedback_pictures` has the rest.
    """
    return re.sub(r"(?m)^(    picture: .*?\.) .*$", r"\1", text)


def golden(name: str, text: str) -> str:
    """Return the golden text ``name``, for which ``text`` was found now."""
    file = GOLDEN / f"{name}.txt"
    if "WRITE_GOLDEN" in os.environ:
        file.write_text(text, encoding="utf-8")
    return file.read_text(encoding="utf-8")
