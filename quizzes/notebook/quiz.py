"""A learner's quiz as a notebook shows it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from quizzes.taking.quiz_core import QuizCore

if TYPE_CHECKING:
    from quizzes.widget import QuizWidget


class Quiz(QuizCore):
    """One learner's quiz, with a widget. Make it with `quizzes.load`."""

    def show(self) -> QuizWidget:
        """Return the quiz as a widget, for the end of a notebook's cell."""
        from quizzes.widget import QuizWidget

        return QuizWidget(self)
