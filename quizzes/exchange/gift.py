"""Moodle's GIFT format: write questions, and read them back.

The rules are those of Moodle's own reader (https://docs.moodle.org/en/GIFT_format): blank lines
part questions, ``\\`` escapes ``~ = # { } :`` and itself, ``\\n`` is a line break. All texts are
Markdown, and say so.
"""

from __future__ import annotations

from collections.abc import Iterable
from decimal import Decimal

from quizzes.exchange.gift_reader import MAX_SIZE_CHARS as MAX_SIZE_CHARS
from quizzes.exchange.gift_reader import read_gift as read_gift
from quizzes.exchange.platform_questions import (
    ChoiceQuestion,
    MatchQuestion,
    NumberQuestion,
    Question,
)

_SPECIAL = "~=#{}:"


def format_gift(questions: Iterable[Question], title: str = "") -> str:
    """Return questions as a GIFT file, in their order, grouped by category."""
    blocks = [f"// {' '.join(title.split())}"] if title else []
    category = ""
    for question in questions:
        if question.category != category:
            category = question.category
            blocks.append(f"$CATEGORY: {category}")
        blocks.append(_format_question(question))
    return "\n\n".join(blocks) + "\n"


def escape_text(text: str) -> str:
    """Return a text with all that GIFT gives a meaning escaped, on one line."""
    text = text.replace("\r\n", "\n").replace("\r", "\n").replace("\\", "\\\\")
    for character in _SPECIAL:
        text = text.replace(character, f"\\{character}")
    return text.replace("\n", "\\n")


def _format_text(text: str) -> str:
    # What begins like the name of a text format, or like a weight, is text all the same.
    return ("[markdown]" if text.startswith(("[", "%")) else "") + escape_text(text)


def _format_question(question: Question) -> str:
    lines = [f"::{escape_text(question.name)}::[markdown]{escape_text(question.text)}{{"]
    if isinstance(question, NumberQuestion):
        lines[0] += "#"
        lines += _format_numbers(question)
    elif isinstance(question, MatchQuestion):
        lines += [
            f"={_format_text(left)} -> {escape_text(right)}" for left, right in question.pairs
        ]
        lines += [f"= -> {escape_text(extra)}" for extra in question.extras]
    else:
        lines += _format_choices(question)
    if question.feedback:
        lines.append(f"####{_format_text(question.feedback)}")
    return "\n\t".join(lines) + "\n}"


def _format_choices(question: ChoiceQuestion) -> list[str]:
    lines = []
    for choice in question.choices:
        if question.one and choice.share == 100:
            mark = "="
        elif choice.share:
            mark = f"~%{_short_decimal(choice.share)}%"
        else:
            mark = "~"
        lines.append(mark + _format_text(choice.text) + _format_feedback(choice.feedback))
    return lines


def _format_numbers(question: NumberQuestion) -> list[str]:
    lines = [
        f"=%{_short_decimal(number.share)}%{_exact_decimal(number.value)}:{_exact_decimal(number.tolerance)}"
        + _format_feedback(number.feedback)
        for number in question.numbers
    ]
    return lines + (
        [f"~#{_format_text(question.wrong_feedback)}"] if question.wrong_feedback else []
    )


def _format_feedback(text: str) -> str:
    return f"#{_format_text(text)}" if text else ""


def _exact_decimal(number: float) -> str:
    """Return all digits of a number, and no exponent: not every reader of GIFT knows those."""
    return format(Decimal(repr(number)), "f")


def _short_decimal(number: float) -> str:
    return f"{number:.5f}".rstrip("0").rstrip(".")
