"""Questions, answers and results as Markdown: for the headless quiz, and for reports."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from quizzes.attempts import quiz_answers
from quizzes.attempts.quiz_answers import Answer
from quizzes.bank.contents import Matching, Multiple, Numeric, Ordering
from quizzes.bank.selection import LETTERS, Paper, PaperItem
from quizzes.marking.marks import Mark

INSTRUCTIONS = {
    "single": "Choose one.",
    "predict": "What will this cell show? Choose one.",
    "multiple": "Choose all that are right.",
    "numeric": "Give a number.",
    "ordering": "Put these in order.",
    "matching": "Choose for each what belongs to it.",
}


class MarkedText(Protocol):
    """What is read of a marked quiz: see `quizzes.marking.scoring.QuestionResult`."""

    @property
    def paper(self) -> Paper:
        """Its questions."""

    @property
    def marks(self) -> tuple[Mark, ...]:
        """A mark a question."""

    @property
    def headline(self) -> str:
        """The outcome in one sentence."""


@dataclass(frozen=True, repr=False)
class QuestionText:
    """A question to read in a cell or a terminal."""

    item: PaperItem

    def __repr__(self) -> str:
        """Return it as Markdown, which reads well as plain text, too."""
        return of_question(self.item)

    def _repr_markdown_(self) -> str:
        return of_question(self.item)


def of_question(item: PaperItem) -> str:
    """Return a question as Markdown: what is asked, what there is to choose from, how to answer."""
    variant = item.variant
    parts = [f"**Question {item.number}.** {INSTRUCTIONS[variant.kind]}", variant.stem]
    if variant.code:
        parts.append(f"```python\n{variant.code.strip()}\n```")
    if isinstance(variant, Matching):
        lefts = (f"{number}. {pair.left}" for number, pair in enumerate(variant.pairs, start=1))
        parts.append("\n".join(lefts))
    parts += [f"{letter}) {item.text_of(letter)}" for letter in item.letters]
    how = quiz_answers.describe_format(item)
    parts.append(f"*{how[0].upper()}{how[1:]}.*")
    return "\n\n".join(parts)


def of_answer(item: PaperItem, answer: Answer) -> str:
    """Return an answer in words, as Markdown."""
    variant = item.variant
    if answer == quiz_answers.NOTHING:
        return "no answer"
    if isinstance(variant, Numeric):
        return f"{answer:g} {variant.unit}".strip()
    letters = str(answer)
    if isinstance(variant, Ordering):
        return " → ".join(item.text_of(letter) for letter in letters)
    if isinstance(variant, Matching):
        rights = [item.text_of(c) if c in LETTERS else "nothing" for c in letters]
        pairs = zip(variant.pairs, rights, strict=True)
        return "; ".join(f"{pair.left}: {right}" for pair, right in pairs)
    return "; ".join(f"{c}) {item.text_of(c)}" for c in letters)


def of_result(result: MarkedText) -> str:
    """Return a marked quiz as Markdown; of one that is marked elsewhere, that it is handed in."""
    if result.paper.bank.keyless:
        return f"**{result.headline}**"
    return "\n\n".join([f"**{result.headline}**", *(of_mark(mark) for mark in result.marks)])


def of_mark(mark: Mark) -> str:
    """Return a marked answer as Markdown: what it earned, and the feedback to it."""
    lines = [f"**Question {mark.item.number}: {describe_mark(mark)}**"]
    several = isinstance(mark.item.variant, Multiple)
    for remark in mark.remarks:
        label = f"{remark.letter}) " if several and remark.letter else ""
        if remark.feedback:
            lines.append(f"{label}{remark.feedback}")
        if remark.show and not remark.right:
            lines.append(f"See it happen:\n\n```python\n{remark.show.strip()}\n```")
    return "\n\n".join(lines)


def describe_mark(mark: Mark) -> str:
    """Return what an answer earned, in words."""
    if mark.is_right:
        return "right"
    return f"partly right, {mark.credit:.2g} of 1" if mark.credit else "not right"
