"""A sample bank, and quizzes on it in folders of their own."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from quizzes.attempts.quiz_answers import Answer
from quizzes.bank import selection
from quizzes.bank.contents import Bank
from quizzes.bank.loader import read_bank
from quizzes.bank.selection import PaperItem
from quizzes.notebook.quiz import Quiz

from . import sample

MakeQuiz = Callable[..., Quiz]


@pytest.fixture
def bank(tmp_path: Path) -> Bank:
    return read_bank(sample.write(tmp_path / "banks"))


@pytest.fixture
def make_quiz(bank: Bank, tmp_path: Path) -> MakeQuiz:
    """Return a function that opens the sample quiz anew, as running its cell again does."""
    folder = tmp_path / "work"
    folder.mkdir()

    def make(student: str = "ada", where: Path = folder) -> Quiz:
        return Quiz(bank, student=student, folder=where)

    return make


def wrong(item: PaperItem) -> Answer:
    """Return an answer that is complete and earns nothing."""
    kind, key = item.variant.kind, selection.right_answer(item)
    if kind == "numeric":
        return float(key) + 50
    letters = str(key)
    if kind in ("single", "predict", "multiple"):
        return next(letter for letter in item.letters if letter not in letters)
    return letters[1:] + letters[0]  # each thing in another's place


def answer_all(quiz: Quiz, *, right: int) -> None:
    """Answer the first ``right`` questions rightly and the others wrongly."""
    for item in quiz.items:
        quiz.answer(
            item.number, selection.right_answer(item) if item.number <= right else wrong(item)
        )
