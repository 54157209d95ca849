"""Closed quizzes: questions go out without keys, answers come back, the instructor marks them.

A question sheet is a bank in which nothing but questions stands: what every learner may see. It
deals the same letters as the bank that it was made of and has the same edition, so answers given to
the one are marked with the other. The schema wants keys; those of a sheet are alike in every sheet,
and `Bank.keyless` keeps anything from being marked by them. What only teaching needs is not in it.
"""

from __future__ import annotations

from itertools import cycle
from pathlib import Path
from typing import Any

import yaml

from quizzes.bank import loader
from quizzes.bank.contents import Bank, Matching, Numeric, Ordering, Variant
from quizzes.errors import BankError
from quizzes.text import rendering

SAYS = "Your instructor marks this."
PREFIX, SUFFIX = "quiz-", ".questions.yaml"

_HEAD = """\
# The questions of a quiz that your instructor marks. There are no keys in here: what stands in the
# place of one is the same in every such file.
"""


def sheet_filename(quiz: str) -> str:
    """Return the name of the file with the questions of a closed quiz."""
    return f"{PREFIX}{quiz}{SUFFIX}"


def make_sheet(bank: Bank) -> str:
    """Return the question sheet of a closed quiz, as YAML.

    Raises:
        BankError: the bank is not of a closed quiz.
    """
    if not bank.closed:
        raise BankError(
            f"The quiz '{bank.quiz}' is not closed, so it marks itself: write 'closed: true' into "
            "its bank if you want to mark it."
        )
    data: dict[str, Any] = {
        "quiz": bank.quiz, "title": bank.title, "chapter": bank.chapter,
        "pass_mark": bank.pass_mark, "attempts": bank.attempt_limit,
        "closed": True, "keyless": True,
        "concepts": [
            {"id": concept.id, "objective": SAYS,
             "variants": [_question_data(variant) for variant in concept.variants]}
            for concept in bank.concepts
        ],
    }  # fmt: skip
    return _HEAD + yaml.safe_dump(data, allow_unicode=True, sort_keys=False, width=100)


def picture_files(bank: Bank) -> list[str]:
    """Return the files in the bank's folder that its questions show, each once."""
    found: dict[str, None] = {}
    for concept in bank.concepts:
        for variant in concept.variants:
            lefts = [pair.left for pair in variant.pairs] if isinstance(variant, Matching) else []
            for text in (variant.stem, *lefts, *variant.lettered_texts):
                found |= dict.fromkeys(rendering.picture_sources(text))
    return list(found)


def find_sheets(folder: Path) -> dict[str, Path]:
    """Return the question sheets in a folder by the name of their quiz."""
    return {quiz_of(path): path for path in sorted(folder.glob(f"{PREFIX}*{SUFFIX}"))}


def quiz_of(path: Path) -> str:
    """Return the quiz whose question sheet is called so; empty if that is no sheet's name."""
    quiz = path.name.removeprefix(PREFIX).removesuffix(SUFFIX)
    return quiz if path.name == sheet_filename(quiz) else ""


def read_sheet(path: Path, quiz: str) -> Bank:
    """Return the questions in a sheet.

    Raises:
        BankError: it cannot be read, does not hold together, or is no sheet of this quiz.
    """
    bank = loader.read_bank(path, quiz)
    if not (bank.closed and bank.keyless):
        raise BankError(f"{path.name} is not a question sheet: get the assignment's file again.")
    return bank


def _question_data(variant: Variant) -> dict[str, Any]:
    data: dict[str, Any] = {"id": variant.id, "kind": variant.kind, "stem": variant.stem}
    if variant.code:
        data["code"] = variant.code
    if isinstance(variant, Numeric):
        return {**data, "answer": 0.0, "unit": variant.unit}
    texts = sorted(variant.lettered_texts)
    if isinstance(variant, Ordering):
        return {**data, "items": texts}
    if isinstance(variant, Matching):
        lefts = [pair.left for pair in variant.pairs]
        pairs = zip(lefts, cycle(texts), strict=False)
        return {
            **data, "pairs": [{"left": left, "right": right} for left, right in pairs],
            "extras": texts[len(lefts) :],
        }  # fmt: skip
    first, *others = texts
    return {**data, "options": [{"text": first, "correct": True}, *({"text": o} for o in others)]}
