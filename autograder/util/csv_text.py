"""Tables as CSV that a spreadsheet opens without running a cell of them."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence

# The full-width forms are taken for their ASCII ones by spreadsheets in some languages.
FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n", "\0", "＝", "＋", "－", "＠")  # noqa: RUF001


def guard_text(text: str) -> str:
    """Return ``text`` with an apostrophe in front if a spreadsheet would run it as a formula.

    See OWASP, "CSV Injection" (CWE-1236).
    """
    return f"'{text}" if is_formula(text) else text


def is_formula(text: str) -> bool:
    """Whether a spreadsheet could take a cell for a formula, blanks in front of it or not."""
    return text.startswith(FORMULA) or text.lstrip().startswith(FORMULA)


def as_csv(rows: Iterable[Sequence[str]]) -> str:
    """Return rows as CSV (RFC 4180)."""
    buffer = io.StringIO()
    csv.writer(buffer, lineterminator="\r\n").writerows(rows)
    return buffer.getvalue()
