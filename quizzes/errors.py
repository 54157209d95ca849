"""Errors that people read: one sentence that says what, where, and what to do next."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class QuizError(Exception):
    """Base of every error of a quiz that a person reads; a notebook shows it without traceback."""

    exit_code = 1

    def _render_traceback_(self) -> list[str]:
        """Return what IPython shows: the sentence alone. The cell still fails."""
        return [f"{type(self).__name__}: {self}"]


class BankError(QuizError):
    """A bank that is not there or not sound; the message names file, line, item and field.

    ``faults`` are all that is wrong with it, a sentence each; the message has the first.
    """

    def __init__(self, message: str, faults: Iterable[str] = ()) -> None:
        """Say ``message``; without ``faults`` it is the one fault."""
        super().__init__(message)
        self.faults = tuple(faults) or (message,)


class AnswerError(QuizError):
    """An answer that does not fit its question; the message says which ones do."""


class AttemptsError(QuizError):
    """An attempt that cannot be recorded; the message says why and what still works."""


class UnwritableError(AttemptsError):
    """Nothing can be saved in the folder; the quiz itself goes on."""


def suggest_name(name: object, known: Iterable[str]) -> str:
    """Return a question that names what was meant, with a blank before it; or nothing."""
    by_lower = {one.lower(): one for one in known}
    close = difflib.get_close_matches(str(name).lower(), by_lower, n=1)
    return f" Did you mean '{by_lower[close[0]]}'?" if close else ""
