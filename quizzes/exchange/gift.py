"""Moodle's GIFT format: write questions, and read them back.

The rules are those of Moodle's own reader (https://docs.moodle.org/en/GIFT_format): blank lines
part questions, ``\\`` escapes ``~ = # { } :`` and itself, ``\\n`` is a line break. All texts are
Markdown, and say so.
"""

from __future__ import annotations

from collections.abc import Iterable
from decimal import Decimal

from quizzes.exchange.gift_reader import MAX_SIZE as MAX_SIZE
from quizzes.exchange.gift_reader import read as read
from quizzes.exchange.questions import ChoiceQuestion, MatchQuestion, NumberQuestion, Question

_SPECIAL = "~=#{}:"


def write(questions: Iterable[Question], title: str = "") -> str:
    """Return questions as a GIFT file, in their order, grouped by category."""
    blocks = [f"// {' '.join(title.split())}"] if title else []
    category = ""
    for question in questions:
        if question.category != category:
            category = question.category
            blocks.append(f"$CATEGORY: {category}")
        blocks.append(_question(question))
    return "\n\n".join(blocks) + "\n"


def escape(text: str) -> str:
    """Return a text with all that GIFT gives a meaning escaped, on one line."""
    text = text.replace("\r\n", "\n").replace("\r", "\n").replace("\\", "\\\\")
    for character in _SPECIAL:
        text = text.replace(character, f"\\{character}")
    return text.replace("\n", "\\n")


def _text(text: str) -> str:
    # What begins like the name of a text format, or like a weight, is text all the same.
    return ("[markdown]" if text.startswith(("[", "%")) else "") + escape(text)


def _question(question: Question) -> str:
    lines = [f"::{escape(question.name)}::[markdown]{escape(question.text)}{{"]
    if isinstance(question, NumberQuestion):
        lines[0] += "#"
        lines += _numbers(question)
    elif isinstance(question, MatchQuestion):
        lines += [f"={_text(left)} -> {escape(right)}" for left, right in question.pairs]
        lines += [f"= -> {escape(extra)}" for extra in question.extras]
    else:
        lines += _choices(question)
    if question.feedback:
        lines.append(f"####{_text(question.feedback)}")
    return "\n\t".join(lines) + "\n}"


def _choices(question: ChoiceQuestion) -> list[str]:
    lines = []
    for choice in question.choices:
        if question.one and choice.share == 100:
            mark = "="
        elif choice.share:
            mark = f"~%{_decimal(choice.share)}%"
        else:
            mark = "~"
        lines.append(mark + _text(choice.text) + _feedback(choice.feedback))
    return lines


def _numbers(question: NumberQuestion) -> list[str]:
    lines = [
        f"=%{_decimal(number.share)}%{_exact(number.value)}:{_exact(number.tolerance)}"
        + _feedback(number.feedback)
        for number in question.numbers
    ]
    return lines + ([f"~#{_text(question.wrong_feedback)}"] if question.wrong_feedback else [])


def _feedback(text: str) -> str:
    return f"#{_text(text)}" if text else ""


def _exact(number: float) -> str:
    """Return all digits of a number, and no exponent: not every reader of GIFT knows those."""
    return format(Decimal(repr(number)), "f")


def _decimal(number: float) -> str:
    return f"{number:.5f}".rstrip("0").rstrip(".")
