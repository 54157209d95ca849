"""Quizzes in a notebook: ``quizzes.load("ch05").show()``.

The package imports nothing of the course or the autograder. Everything but the widget works
without a notebook: `load` gives a `Quiz` to answer and submit.
"""

from __future__ import annotations

from quizzes.bank.loader import names as names
from quizzes.errors import AnswerError as AnswerError
from quizzes.errors import AttemptsError as AttemptsError
from quizzes.errors import BankError as BankError
from quizzes.errors import QuizError as QuizError
from quizzes.notebook.opening import load as load
from quizzes.notebook.quiz import Quiz as Quiz
