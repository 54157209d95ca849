"""Answers as learners give them, brought into the one form in which they are saved and marked.

An answer is a number (numeric) or a string of letters: ``"b"`` (single, predict), ``"ac"``
(multiple, sorted), ``"cabd"`` (ordering: first to last; matching: for each left side the letter of
its right one, ``-`` where none is chosen yet). ``""`` is no answer yet.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from collections.abc import Set as AnySet
from numbers import Real
from typing import Any

from quizzes.bank.contents import Matching, Multiple, Numeric, Ordering
from quizzes.bank.selection import PaperItem
from quizzes.errors import AnswerError

Answer = str | float

NOTHING = ""
OPEN = "-"
"""Stands in a matching for a left side that has no right one yet."""

MAX_NUMBER = 1e300
"""Numbers beyond this are no answers, neither when given nor when read from a file."""


def normalize_answer(item: PaperItem, given: Any) -> Answer:
    """Return an answer in its saved form; None and "" take an answer back.

    Args:
        item: the question.
        given: a letter, letters as a string or a list, a number, or for a matching also
            ``{1: "b", 2: "a"}`` with the number of the left side.

    Raises:
        AnswerError: it does not fit the question; the message says what does.
    """
    if given is None or (isinstance(given, str) and not given.strip()):
        return NOTHING
    if isinstance(item.variant, Numeric):
        try:
            return parse_number(given)
        except ValueError:
            raise _answer_error(item, given) from None
    letters = _parse_letters(item, given)
    unknown = sorted(set(letters) - set(item.letters) - {OPEN})
    if unknown:
        raise AnswerError(f"Question {item.number} has no {unknown[0]!r}: {describe_format(item)}.")
    if isinstance(item.variant, Matching):
        if len(letters) != len(item.variant.pairs):
            raise _answer_error(item, given)
        return NOTHING if set(letters) == {OPEN} else letters
    if OPEN in letters or len(set(letters)) < len(letters):
        raise _answer_error(item, given)
    if isinstance(item.variant, Multiple):
        return "".join(sorted(letters))
    wanted = len(item.letters) if isinstance(item.variant, Ordering) else 1
    if len(letters) != wanted:
        raise _answer_error(item, given)
    return letters


def parse_number(given: Any) -> float:
    """Return a numeric answer: any real number (also numpy's) or its text, up to `MAX_NUMBER`.

    Raises:
        ValueError: it is none.
    """
    text = isinstance(given, str) and "_" not in given  # Python reads "1_000", people do not
    if not text and (isinstance(given, bool | str) or not isinstance(given, Real)):
        raise ValueError("no number")
    try:
        found = float(given)
    except OverflowError:
        raise ValueError("too large") from None
    if not abs(found) <= MAX_NUMBER:  # nor is nan
        raise ValueError("too large")
    return found


def is_complete(item: PaperItem, answer: Answer) -> bool:
    """Whether a saved answer answers the question (rightly or not)."""
    if isinstance(item.variant, Matching):
        return answer != NOTHING and OPEN not in str(answer)
    return answer != NOTHING


def describe_format(item: PaperItem) -> str:
    """Return a phrase that says what an answer to this question looks like."""
    first, last = item.letters[:1], item.letters[-1:]
    if isinstance(item.variant, Numeric):
        return "answer with a number" + (f" in {item.variant.unit}" if item.variant.unit else "")
    if isinstance(item.variant, Ordering):
        return f"answer with all letters from a to {last} in order, such as '{item.letters}'"
    if isinstance(item.variant, Matching):
        count = len(item.variant.pairs)
        return f"answer with one letter (a to {last}) for each of the {count} left sides, in order"
    if isinstance(item.variant, Multiple):
        return f"answer with one or more letters from {first} to {last}, such as 'ab'"
    return f"answer with one letter from {first} to {last}"


def _parse_letters(item: PaperItem, given: Any) -> str:
    if isinstance(given, Mapping) and isinstance(item.variant, Matching):
        lefts = range(1, len(item.variant.pairs) + 1)
        if not set(given) <= set(lefts):
            raise AnswerError(
                f"Question {item.number} has the left sides 1 to {len(lefts)}, not "
                f"{sorted(set(given) - set(lefts), key=str)[0]!r}."
            )
        given = [given.get(left, OPEN) for left in lefts]
    elif isinstance(given, AnySet):
        if isinstance(item.variant, Ordering | Matching):
            raise _answer_error(item, given)  # a set has no order
        given = sorted(given, key=str)
    if not isinstance(given, str):
        if not isinstance(given, Iterable) or isinstance(given, bytes | Mapping):
            raise _answer_error(item, given)
        given = list(given)
        if not all(isinstance(letter, str) and len(letter.strip()) == 1 for letter in given):
            raise _answer_error(item, given)
        given = "".join(given)
    return re.sub(r"[\s,;]", "", given).lower()


def _answer_error(item: PaperItem, given: Any) -> AnswerError:
    try:
        shown = repr(given)
    except ValueError:  # an integer of too many digits
        shown = "That"
    shown = shown if len(shown) <= 40 else f"{shown[:37]}..."
    return AnswerError(f"{shown} does not fit question {item.number}: {describe_format(item)}.")
