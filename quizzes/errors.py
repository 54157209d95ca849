"""Errors that people read: one sentence that says what, where, and what to do next."""

from __future__ import annotations


class QuizError(Exception):
    """Base of every error of a quiz that a person reads; a notebook shows it without traceback."""

    exit_code = 1

    def _render_traceback_(self) -> list[str]:
        """Return what IPython shows: the sentence alone. The cell still fails."""
        return [f"{type(self).__name__}: {self}"]


class BankError(QuizError):
    """A bank that is not there or not sound; the message names file, item and field."""


class AnswerError(QuizError):
    """An answer that does not fit its question; the message says which ones do."""


class AttemptsError(QuizError):
    """An attempt that cannot be recorded; the message says why and what still works."""


class UnwritableError(AttemptsError):
    """Nothing can be saved in the folder; the quiz itself goes on."""
