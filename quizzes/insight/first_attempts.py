"""Collects a class: the first attempt of each learner, its answers marked again.

First attempts only: a later one has seen the feedback of an earlier one, and would make every
question look easier than it is.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from quizzes.attempts import record
from quizzes.bank.contents import Bank
from quizzes.marking import regrade
from quizzes.marking.scoring import QuestionResult


@dataclass(frozen=True)
class ClassResults:
    """The first result of each learner who has one, and a sentence for each who has none."""

    bank: Bank
    results: dict[str, QuestionResult]
    notes: tuple[str, ...]


def collect_class(bank: Bank, contents: Mapping[str, bytes | None]) -> ClassResults:
    """Mark the attempts of a class.

    Args:
        bank: the quiz.
        contents: {learner: content of the attempts file, or None if there is none}.
    """
    results: dict[str, QuestionResult] = {}
    notes = []
    name = record.attempts_filename(bank.quiz)
    for learner, content in sorted(contents.items()):
        if content is None:
            notes.append(f"{learner} has handed in no {name}.")
            continue
        marked = regrade.mark_file(bank, content)
        if marked.first_result is not None:
            results[learner] = marked.first_result
        elif marked.other_edition:
            notes.append(f"{learner} answered another edition of the quiz, which is left out.")
        else:
            notes.append(f"{name} of {learner} holds no attempt that counts.")
    return ClassResults(bank, results, tuple(notes))
