"""What a learning platform's format cannot hold of a bank: a sentence each, for the author."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

from quizzes.bank.bank_fields import QuestionPart
from quizzes.bank.contents import Bank, Matching, Multiple, Numeric, Ordering, Predict, Variant

PICTURE = re.compile(r"!\[([^\]]*)\]\([^)]*\)")
LATEX = re.compile(r"(?<![\\$])\$(?![\s$])([^$\n]+?)(?<!\s)\$(?![\d$])")
CODE = re.compile(r"(```.*?```|`[^`\n]*`)", re.DOTALL)

MOODLE_MOST = 10
"""Attempts that Moodle's quiz can be limited to (`QUIZ_MAX_ATTEMPT_OPTION`); more is no limit."""
DECIMALS = 4
"""Decimals of a number's bounds that text2qti writes."""

_NO_MARKDOWN = ("id", "kind", "code", "unit", "proof", "show", "misconception")

Having = Callable[[Callable[[Variant], bool]], str]


def of_gift(bank: Bank) -> list[str]:
    """Return what is lost in GIFT, or changes its form, as Moodle reads it."""
    having = _question_filter(bank)
    attempts = str(bank.attempt_limit) if bank.attempt_limit <= MOODLE_MOST else "Unlimited"
    notes = [
        f"A GIFT file has questions alone. In Moodle's quiz add one random question from each "
        f"category, with one point each: {len(bank.concepts)} points in all. The title, the "
        f"chapter and the pass mark ({bank.pass_text}, where a platform counts points) are "
        "settings of that quiz.",
        f"Attempt rules are settings, too: the best of {bank.attempt_limit} counts, so choose "
        f"'Attempts allowed: {attempts}' and 'Grading method: Highest grade'."
        + (
            f" Moodle has no limit between {MOODLE_MOST} and none, so every attempt counts there."
            if bank.attempt_limit > MOODLE_MOST
            else ""
        ),
    ]
    if bank.closed:
        notes.append(
            "The quiz is closed, but the file has its keys and its feedback: set in Moodle's "
            "'Review options' when students see them."
        )
    notes += _of_both(bank)
    several = {
        "There is no ordering: {} became a matching of positions and items.":
            having(lambda v: isinstance(v, Ordering)),
        "A matching has one feedback, shown to everybody: in {} it holds both, that for a right "
        "and that for a wrong answer.":
            having(lambda v: isinstance(v, Ordering | Matching) and bool(v.feedback)),
        "There are no pictures: in {} the picture's description stands in its place.":
            having(
                lambda v: any(PICTURE.search(CODE.sub("", text)) for text in _markdown_texts(v))
            ),
        "Formulas are in double dollars, which Moodle shows with its MathJax filter: {}.":
            having(lambda v: any(LATEX.search(CODE.sub("", text)) for text in _markdown_texts(v))),
        "GIFT's arrow -> cannot stand on a left side: in {} it became →.":
            having(lambda v: isinstance(v, Matching) and any("->" in p.left for p in v.pairs)),
    }  # fmt: skip
    return notes + [sentence.format(ids) for sentence, ids in several.items() if ids]


def of_qti(bank: Bank) -> list[str]:
    """Return what is lost in text2qti's packages, or changes its form, as Canvas reads them."""
    having = _question_filter(bank)
    notes = [
        f"The pass mark ({bank.pass_text}) stands in the description alone: Canvas counts points, "
        "and passes nobody.",
        f"The package asks for {bank.attempt_limit} "
        + ("attempt" if bank.attempt_limit == 1 else "attempts, of which the best counts")
        + ", and then Canvas closes the quiz"
        + ("." if bank.closed else ": there is no practice after them."),
    ]
    if bank.closed:
        notes.append(
            "The quiz is closed, but the package has its keys and its feedback: Canvas is told to "
            "show neither to students."
        )
    notes += _of_both(bank)
    several = {
        "Canvas gives its own partial credit where several options are right: {}.":
            having(lambda v: isinstance(v, Multiple)),
        "text2qti has neither ordering nor matching: {} became choices between whole arrangements, "
        "without partial credit.":
            having(lambda v: isinstance(v, Ordering | Matching)),
        "A number has one feedback for all wrong answers: {} lost the feedback for particular "
        "wrong numbers.":
            having(lambda v: isinstance(v, Numeric) and bool(v.traps)),
        f"text2qti rounds the bounds of a number to {DECIMALS} decimals: {{}}.":
            having(lambda v: isinstance(v, Numeric) and _is_rounded(v)),
    }  # fmt: skip
    return notes + [sentence.format(ids) for sentence, ids in several.items() if ids]


def _of_both(bank: Bank) -> Iterator[str]:
    having = _question_filter(bank)
    behind = {
        "misconceptions": bool(bank.misconceptions),
        "the cells that show what really happens": bool(having(_has_demonstration)),
        "the names of the proofs": bool(having(lambda v: bool(v.proof))),
        "the concepts' objectives": True,
    }
    *most, last = [name for name, there in behind.items() if there]
    listed = f"{', '.join(most)} and {last}" if most else last
    yield f"There is no place for {listed}: they stay in the bank."
    if predictions := having(lambda v: isinstance(v, Predict)):
        yield (
            f"There is no cell to run: {predictions} became choices that show the cell, without "
            "the button that runs it."
        )
    if any(len(concept.variants) > 1 for concept in bank.concepts):
        yield (
            "Variants are drawn by chance at each attempt, so one may come back before all were "
            "seen; a notebook deals each before one comes back."
        )
    yield (
        "What students do there stays there: it is not in the gradebook here, nor in `autograder "
        "report`."
    )


def _question_filter(bank: Bank) -> Having:
    """Return a function that names the questions for which something holds."""
    variants = [variant for concept in bank.concepts for variant in concept.variants]
    return lambda holds: ", ".join(variant.id for variant in variants if holds(variant))


def _has_demonstration(variant: Variant) -> bool:
    if isinstance(variant, Ordering | Matching):
        return bool(variant.show)
    if isinstance(variant, Numeric):
        return bool(variant.show or any(trap.show for trap in variant.traps))
    return any(option.show for option in variant.options)


def _is_rounded(variant: Numeric) -> bool:
    bounds = (variant.answer - variant.tolerance, variant.answer + variant.tolerance)
    return any(abs(round(bound, DECIMALS) - bound) > 1e-9 for bound in bounds)


def _markdown_texts(part: QuestionPart) -> Iterator[str]:
    """Yield every text of a question that is Markdown."""
    for name, value in part:
        if name not in _NO_MARKDOWN:
            for one in value if isinstance(value, list) else [value]:
                if isinstance(one, QuestionPart):
                    yield from _markdown_texts(one)
                elif isinstance(one, str):
                    yield one
