"""Marking: what each answer earns, which belief a wrong one shows, and what to tell the learner."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from quizzes.attempts.quiz_answers import NOTHING, OPEN, Answer, is_complete
from quizzes.bank import selection
from quizzes.bank.contents import Matching, Multiple, Numeric, Option, Ordering, Predict, Single
from quizzes.bank.selection import Paper, PaperItem
from quizzes.marking import wording
from quizzes.marking.marks import Mark, Remark


@dataclass(frozen=True, repr=False)
class QuestionResult:
    """A marked quiz: one point a concept, with partial credit."""

    paper: Paper
    marks: tuple[Mark, ...]

    @property
    def score(self) -> float:
        """Points earned, to the hundredth."""
        return round(sum(mark.credit for mark in self.marks), 2)

    @property
    def max_score(self) -> int:
        """Points there are: one for each concept."""
        return len(self.marks)

    @property
    def right(self) -> int:
        """How many concepts were fully right."""
        return sum(mark.is_right for mark in self.marks)

    @property
    def passed(self) -> bool:
        """Whether enough concepts were fully right."""
        return self.right >= self.paper.bank.pass_mark

    @property
    def headline(self) -> str:
        """The outcome in one sentence."""
        if self.paper.bank.keyless:
            return "Handed in: your instructor marks it."
        word = "Passed" if self.passed else "Not passed yet"
        of = f"{self.right} of {self.max_score} right"
        score = "" if self.score == self.right else f" ({self.score:g} points with partial credit)"
        return f"{word}: {of}{score}, {self.paper.bank.pass_text}."

    def __repr__(self) -> str:
        """Return the outcome and the feedback to each answer as text."""
        return wording.of_result(self)

    def _repr_markdown_(self) -> str:
        return wording.of_result(self)


def mark_paper(paper: Paper, answers: Mapping[str, Answer]) -> QuestionResult:
    """Mark answers, given by concept; a concept without one earns nothing.

    Without keys nothing can be said of an answer, and no point be given for it.
    """
    given = {item.concept.id: answers.get(item.concept.id, NOTHING) for item in paper.items}
    if paper.bank.keyless:
        return QuestionResult(
            paper, tuple(Mark(item, given[item.concept.id], 0.0, ()) for item in paper.items)
        )
    return QuestionResult(
        paper, tuple(mark_answer(item, given[item.concept.id]) for item in paper.items)
    )


def mark_answer(item: PaperItem, answer: Answer) -> Mark:
    """Mark one answer in its saved form (see `quizzes.attempts.quiz_answers`).

    One choice is right or wrong. Of several choices each right one earns its share and each wrong
    one loses as much, down to nothing. In an ordering each thing in its place earns its share, in
    a matching each pair.
    """
    variant = item.variant
    if not is_complete(item, answer) and not isinstance(variant, Matching):
        return Mark(item, answer, 0.0, (Remark(False, "There is no answer."),))
    if isinstance(variant, Numeric):
        return _mark_numeric(item, variant, float(answer))
    letters = str(answer)
    if isinstance(variant, Multiple):
        return _mark_multiple(item, variant, letters)
    if isinstance(variant, Single | Predict):
        option = variant.options[item.place_of(letters)]
        remark = _option_remark(option, letters, right=option.correct)
        return Mark(item, answer, float(option.correct), (remark,))
    return _mark_built(item, variant, letters)


def _option_remark(option: Option, letter: str, *, right: bool) -> Remark:
    return Remark(right, option.feedback or "", letter, option.misconception, option.show)


def _mark_numeric(item: PaperItem, variant: Numeric, number: float) -> Mark:
    if variant.is_right(number):
        return Mark(item, number, 1.0, (Remark(True, variant.feedback or ""),))
    for trap in variant.traps:
        if trap.is_hit(number):
            remark = Remark(False, trap.feedback or "", "", trap.misconception, trap.show)
            return Mark(item, number, 0.0, (remark,))
    general = variant.wrong_feedback or variant.feedback or ""
    remark = Remark(False, general, "", variant.misconception, variant.show)
    return Mark(item, number, 0.0, (remark,))


def _mark_multiple(item: PaperItem, variant: Multiple, letters: str) -> Mark:
    ticked = [variant.options[item.place_of(letter)].correct for letter in letters]
    share = (ticked.count(True) - ticked.count(False)) / len(variant.right_positions)
    remarks = []
    for letter in item.letters:
        option = variant.options[item.place_of(letter)]
        if option.correct or letter in letters:
            well = option.correct and letter in letters
            remarks.append(_option_remark(option, letter, right=well))
    return Mark(item, letters, max(0.0, share), tuple(remarks))


def _mark_built(item: PaperItem, variant: Ordering | Matching, letters: str) -> Mark:
    wanted = str(selection.right_answer(item))
    given = letters or OPEN * len(wanted)
    share = sum(a == b for a, b in zip(given, wanted, strict=True)) / len(wanted)
    if share == 1.0:
        return Mark(item, letters, 1.0, (Remark(True, variant.feedback or ""),))
    remark = Remark(False, variant.wrong_feedback or "", "", variant.misconception, variant.show)
    return Mark(item, letters, share, (remark,))
