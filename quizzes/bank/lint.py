"""Lint for a bank: what makes a question easy to guess, unfair, or useless as a lesson.

The schema (`quizzes.bank.contents`) refuses what cannot work. This finds what works and is still
bad: keys that give themselves away by length or place, options that teach nothing, stems that ask
two things. The rules follow Haladyna, Downing and Rodriguez, "A Review of Multiple-Choice
Item-Writing Guidelines", Applied Measurement in Education 15 (2002).
"""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass

from quizzes.bank import selection
from quizzes.bank.contents import (
    Bank,
    Matching,
    Multiple,
    Numeric,
    Ordering,
    Predict,
    Single,
    Variant,
)

LENGTH_RATIO = 2.0
"""How many times as long as the shortest option the longest may be."""
FEW_CHARS = 25
"""Options that differ by less give nothing away, whatever their ratio (`yes`, a line of output)."""
HABIT = 0.4
"""Share of questions in which the key may be the longest option, or the shortest; by chance it is
one in four."""
LEARNERS = 400
"""How many quizzes are dealt to see where the keys come to stand."""
BALANCE = 0.35
"""How far a place may be from its fair share of the keys, as a part of that share."""
FEWEST_KEYS = 8
"""Questions below which nothing can be said of habits: two of three are soon alike."""
MIN_FEEDBACK_CHARS = 25
"""Letters and digits below which a feedback cannot say why."""

_REFERS = re.compile(
    r"""\b(?:all|any|some|most|none|both|neither|either|each|every(?:\s+one)?)\s+(?:
            (?:of\s+)?(?:the\s+)?above\b
          | of\s+(?:the\s+)?(?:these|those|them|others?)\b
          | (?:of\s+)?(?:the\s+|these\s+|other\s+)*
            (?:answers|options|choices|alternatives|statements)
            \s+(?:above|below|are|is|hold|apply|fit)\b
        )
      | \b(?:answers?|options?|choices?)\s+\(?[a-f]\)?(?![\w'])
      | \b[a-f]\)?\s*(?:,|&|\+|/|\band\b|\bor\b)\s*\(?[a-f]\b(?!['\w])
    """,
    re.IGNORECASE | re.VERBOSE,
)
"""An option that speaks of others: by what stands above it, or by letter."""
_CODE = re.compile(r"```.*?```|`[^`]*`", re.DOTALL)
_TASK = re.compile(r"(?:^|[.!?]\s+)(Match|Put)\b")


@dataclass(frozen=True)
class LintFinding:
    """One thing to mend: the item's id, the field, and what is wrong with it."""

    item: str
    field: str
    problem: str

    def __str__(self) -> str:
        """Return it as one sentence."""
        return f"item '{self.item}', field {self.field}: {self.problem}."


@dataclass(frozen=True)
class WrongAnswer:
    """One way of being wrong that a variant knows about."""

    variant: Variant
    where: str
    misconception: str | None
    feedback: str | None
    show: str | None


def wrong_answers(bank: Bank) -> Iterator[WrongAnswer]:
    """Yield every wrong answer that a bank has feedback for, whatever the kind of question."""
    for concept in bank.concepts:
        for variant in concept.variants:
            yield from _wrong_answers(variant)


def list_findings(bank: Bank) -> list[LintFinding]:
    """Return all that should be mended in a bank; an empty list is a clean one.

    A closed quiz does not teach, so what is there to teach is not looked for in it.
    """
    found: list[LintFinding] = []
    for concept in bank.concepts:
        for variant in concept.variants:
            found += _of_question(variant)
            found += () if bank.closed else _of_lesson(variant)
    found += () if bank.closed else _of_misconceptions(bank)
    found += _of_repeated_texts(bank)
    found += _of_key_lengths(bank)
    found += _of_key_places(bank)
    return found


def _wrong_answers(variant: Variant) -> Iterator[WrongAnswer]:
    if isinstance(variant, Numeric):
        for number, trap in enumerate(variant.traps, start=1):
            where = f"{variant.id} trap {number}"
            yield WrongAnswer(variant, where, trap.misconception, trap.feedback, trap.show)
    elif isinstance(variant, Ordering | Matching):
        where = f"{variant.id} wrong_feedback"
        yield WrongAnswer(
            variant, where, variant.misconception, variant.wrong_feedback, variant.show
        )
    else:
        for number, option in enumerate(variant.options, start=1):
            if not option.correct:
                where = f"{variant.id} option {number}"
                yield WrongAnswer(
                    variant, where, option.misconception, option.feedback, option.show
                )


def _of_question(variant: Variant) -> Iterator[LintFinding]:
    """Find what makes a question unclear, or easy to guess."""

    def finding(field: str, problem: str) -> LintFinding:
        return LintFinding(variant.id, field, problem)

    prose = _CODE.sub("", variant.stem)
    asked = prose.count("?")
    if asked > 1:
        yield finding("stem", f"it asks {asked} questions; one question asks one thing")
    elif not asked and not _TASK.search(prose):
        yield finding("stem", "it asks nothing: end it with a question, or say what to do")
    for text in variant.lettered_texts:
        if _REFERS.search(_CODE.sub("", text)):
            yield finding("options", f"{text!r} refers to other options, which are shuffled")
    if isinstance(variant, Single | Predict | Multiple):
        yield from (finding("options", problem) for problem in _option_lengths(variant))


def _of_lesson(variant: Variant) -> Iterator[LintFinding]:
    """Find what a wrong answer teaches nothing by."""

    def finding(field: str, problem: str) -> LintFinding:
        return LintFinding(variant.id, field, problem)

    if isinstance(variant, Numeric) and variant.wrong_feedback is None:
        yield finding("wrong_feedback", "a number that no trap expects gets no hint")
    for answer in _wrong_answers(variant):
        name = answer.where.removeprefix(f"{variant.id} ")
        if answer.show is None:
            yield finding(name, "it has no cell that shows what really happens")
    for name, feedback in _feedback_texts(variant):
        if sum(character.isalnum() for character in feedback) < MIN_FEEDBACK_CHARS:
            yield finding(name, "its feedback is too short to say why")


def _feedback_texts(variant: Variant) -> Iterator[tuple[str, str]]:
    """Yield (where, text) for every feedback that a learner may get."""
    if isinstance(variant, Single | Predict | Multiple):
        for number, option in enumerate(variant.options, start=1):
            yield f"option {number}", option.feedback or ""
        return
    yield "feedback", variant.feedback or ""
    if variant.wrong_feedback is not None:
        yield "wrong_feedback", variant.wrong_feedback
    if isinstance(variant, Numeric):
        for number, trap in enumerate(variant.traps, start=1):
            yield f"trap {number}", trap.feedback or ""


def _option_lengths(variant: Single | Predict | Multiple) -> Iterator[str]:
    lengths = sorted(len(option.text) for option in variant.options)
    shortest, longest = lengths[0], lengths[-1]
    if longest - shortest > FEW_CHARS and longest > LENGTH_RATIO * shortest:
        yield f"the longest option has {longest} characters, the shortest {shortest}"


def _of_misconceptions(bank: Bank) -> Iterator[LintFinding]:
    used = {answer.misconception for answer in wrong_answers(bank)}
    for name in sorted(set(bank.misconceptions) - used):
        yield LintFinding(bank.quiz, "misconceptions", f"no wrong answer shows '{name}'")


def _of_repeated_texts(bank: Bank) -> Iterator[LintFinding]:
    """Find stems, options and feedback that are the same in two variants, but for typography.

    Outcomes of a cell, the pairs of a matching and short options (`yes`) may recur.
    """
    places: defaultdict[str, list[tuple[str, str]]] = defaultdict(list)
    for concept in bank.concepts:
        for variant in concept.variants:
            places[_normalize_text(variant.stem)].append((variant.id, "stem"))
            if isinstance(variant, Single | Multiple):
                for option in variant.options:
                    if len(option.text) < FEW_CHARS:
                        continue
                    places[_normalize_text(option.text)].append((variant.id, "options"))
    for answer in wrong_answers(bank):
        places[_normalize_text(answer.feedback or "")].append((answer.variant.id, "feedback"))
    for text, ((item, field), *others) in places.items():
        if text and others:
            elsewhere = ", ".join(sorted({name for name, _ in others}))
            yield LintFinding(item, field, f"the same text stands in {elsewhere}")


def _of_key_lengths(bank: Bank) -> Iterator[LintFinding]:
    """Find out whether the key can be guessed from its length over the whole bank."""
    extremes: Counter[str] = Counter()
    count = 0
    for concept in bank.concepts:
        for variant in concept.variants:
            if isinstance(variant, Single | Predict):
                [key] = variant.right_positions
                lengths = [len(option.text) for option in variant.options]
                others = lengths[:key] + lengths[key + 1 :]
                count += 1
                extremes["longest"] += lengths[key] > max(others)
                extremes["shortest"] += lengths[key] < min(others)
    for name, times in extremes.items():
        if count >= FEWEST_KEYS and times > HABIT * count:
            problem = f"the key is the {name} option in {times} of {count} questions"
            yield LintFinding(bank.quiz, "options", problem)


def _of_key_places(bank: Bank) -> Iterator[LintFinding]:
    """Find out whether keys stand in some places more often: in the bank, and as they are dealt.

    What a learner sees is the deal, from which no place may be read. The bank's own order shows
    through in exports that are not shuffled, and to anyone who looks over an author's shoulder.
    """
    written: defaultdict[int, Counter[int]] = defaultdict(Counter)
    for variant in (variant for concept in bank.concepts for variant in concept.variants):
        if isinstance(variant, Single | Predict):
            written[len(variant.options)][variant.right_positions[0]] += 1
    for count, seen in sorted(written.items()):
        for place, times in sorted(seen.items()):
            if seen.total() >= FEWEST_KEYS and times > HABIT * seen.total():
                problem = (
                    f"the key is option {place + 1} of {count} in {times} of {seen.total()} "
                    "questions, as they stand in the bank"
                )
                yield LintFinding(bank.quiz, "options", problem)
    dealt: defaultdict[int, Counter[int]] = defaultdict(Counter)
    for learner in range(LEARNERS):
        for item in selection.draw(bank, f"learner {learner}", 1 + learner % 3).items:
            if isinstance(item.variant, Single | Predict):
                [key] = item.variant.right_positions
                dealt[len(item.order)][item.order.index(key)] += 1
    for count, seen in sorted(dealt.items()):
        fair = seen.total() / count
        for place in range(count):
            if fair >= 50 and abs(seen[place] - fair) > BALANCE * fair:
                problem = (
                    f"of {seen.total()} keys among {count} options {seen[place]} stand in "
                    f"place {place + 1}"
                )
                yield LintFinding(bank.quiz, "options", problem)


def _normalize_text(text: str) -> str:
    return re.sub(r"\W+", " ", text).strip().casefold()
