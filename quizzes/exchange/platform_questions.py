"""Questions as learning platforms know them: what GIFT can hold of a bank, and what it cannot.

A platform has choices with a share of the points, numbers with a tolerance, and pairs. Everything
else of a bank (misconceptions, cells that show what happens, proofs) has no place there;
`quizzes.exchange.format_limits` says so, and `quizzes.exchange.merge` finds it again in the bank.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

from quizzes.bank.contents import Bank, Concept, Matching, Multiple, Numeric, Ordering, Variant
from quizzes.errors import QuizError
from quizzes.exchange.format_limits import CODE, LATEX, PICTURE

POSITION = "Position {number}"
"""The left side of an ordering's n-th item, when it is written as a matching."""
BOTH = "\n\n---\n\n"
"""Stands between the feedback for a right and for a wrong answer, where there is place for one."""

_DOUBLE_LATEX = re.compile(r"(?<![\\$])\$\$(?![\s$])([^$\n]+?)(?<!\s)\$\$(?!\$)")


class ExchangeError(QuizError):
    """A file of another format cannot be read or written; it names file, item and field."""


@dataclass(frozen=True)
class Choice:
    """One option; ``share`` is what it earns, in percent of the points, and may be negative."""

    text: str
    share: float
    feedback: str = ""


@dataclass(frozen=True)
class ChoiceQuestion:
    """Choose one (``one``) or several options."""

    name: str
    category: str
    text: str
    choices: tuple[Choice, ...]
    one: bool = True
    feedback: str = ""


@dataclass(frozen=True)
class Number:
    """A number that is expected, right (``share`` 100) or wrong (0), within its tolerance."""

    value: float
    tolerance: float
    share: float
    feedback: str = ""


@dataclass(frozen=True)
class NumberQuestion:
    """Give a number; ``wrong_feedback`` is for all that is not among ``numbers``."""

    name: str
    category: str
    text: str
    numbers: tuple[Number, ...]
    wrong_feedback: str = ""
    feedback: str = ""


@dataclass(frozen=True)
class MatchQuestion:
    """Find the right side of each left one; ``extras`` are right sides without a left one."""

    name: str
    category: str
    text: str
    pairs: tuple[tuple[str, str], ...]
    extras: tuple[str, ...] = ()
    feedback: str = ""


Question = ChoiceQuestion | NumberQuestion | MatchQuestion


def of_bank(bank: Bank) -> list[Question]:
    """Return a bank's questions."""
    return [of_variant(bank.quiz, c, v) for c in bank.concepts for v in c.variants]


def of_variant(quiz: str, concept: Concept, variant: Variant) -> Question:
    """Return a variant as a platform can hold it; its category is the concept."""
    name, category, text = variant.id, f"{quiz}/{concept.id}", _question_text(variant)
    if isinstance(variant, Numeric):
        numbers = (
            Number(variant.answer, variant.tolerance, 100.0, to_plain(variant.feedback)),
            *(Number(t.value, t.tolerance, 0.0, to_plain(t.feedback)) for t in variant.traps),
        )
        return NumberQuestion(name, category, text, numbers, to_plain(variant.wrong_feedback))
    if isinstance(variant, Ordering | Matching):
        feedback = to_plain(variant.feedback)
        if variant.wrong_feedback:
            feedback += BOTH + to_plain(variant.wrong_feedback)
        if isinstance(variant, Ordering):
            pairs = tuple(
                (POSITION.format(number=number), to_plain(item))
                for number, item in enumerate(variant.items, start=1)
            )
            return MatchQuestion(name, category, text, pairs, (), feedback)
        pairs = tuple((_left_side(pair.left), to_plain(pair.right)) for pair in variant.pairs)
        extras = tuple(to_plain(extra) for extra in variant.extras)
        return MatchQuestion(name, category, text, pairs, extras, feedback)
    share = round(100 / len(variant.right_positions), 5)
    wrong = -share if isinstance(variant, Multiple) else 0.0
    choices = tuple(
        Choice(to_plain(o.text), share if o.correct else wrong, to_plain(o.feedback))
        for o in variant.options
    )
    return ChoiceQuestion(name, category, text, choices, not isinstance(variant, Multiple))


def to_plain(text: str | None) -> str:
    """Return a bank's Markdown as a platform takes it: no pictures, LaTeX in double dollars.

    What a bank does not have is an empty text.
    """

    def convert(prose: str) -> str:
        described = PICTURE.sub(lambda found: f"*Picture: {found[1]}*", prose)
        return LATEX.sub(lambda found: f"$${found[1]}$$", described)

    return _outside_code((text or "").strip(), convert)


def from_plain(text: str) -> str:
    """Return a platform's Markdown as a bank has it; reverses `to_plain` but for pictures."""
    return _outside_code(text, lambda prose: _DOUBLE_LATEX.sub(r"$\1$", prose))


def code_block(source: str) -> str:
    """Return Python as it stands behind a question's text."""
    return f"\n\n```python\n{source.strip()}\n```"


def unit_line(unit: str) -> str:
    """Return what says in which unit a number is asked for, behind a question's text."""
    return f"\n\n*(Answer in {unit}.)*" if unit else ""


def _question_text(variant: Variant) -> str:
    text = to_plain(variant.stem)
    if variant.code:
        text += code_block(variant.code)
    if isinstance(variant, Numeric):
        text += unit_line(variant.unit)
    return text


def _left_side(text: str) -> str:
    return to_plain(text).replace("->", "→")  # GIFT has no escape for its arrow


def _outside_code(text: str, convert: Callable[[str], str]) -> str:
    parts = CODE.split(text)
    return "".join(part if index % 2 else convert(part) for index, part in enumerate(parts))
