"""Marks saved attempts again: what counts is what was answered, whatever score the file claims.

An attempt counts if it is one that could have been dealt: to its student, for its number, the
questions that it names. The letters in it mean nothing without that deal: under another name they
are guesses. A file that was copied whole still says under which login it was made.

Nobody is kept from practising, but the best of thousands of guesses would be full marks. So the
first `Bank.attempt_limit` attempts of a file count, by their number and in the order of the file,
no matter who made them. Twenty, as in most banks, is four times through all variants of a concept
with five, and a student who guesses has one chance in some hundreds to get everything right in it.
A file that goes on from there, or in which attempts follow one another faster than anybody reads
(`HASTE`), is for a person to look at, with the reason: what it earns is what its first attempts
earn. Time stamps are easily forged, so they only ever add a reason to look.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from datetime import UTC, datetime

from quizzes.attempts import quiz_answers, record
from quizzes.attempts.quiz_answers import Answer
from quizzes.attempts.record import Attempt
from quizzes.bank import selection
from quizzes.bank.contents import Bank
from quizzes.errors import AnswerError
from quizzes.marking import scoring
from quizzes.marking.scoring import QuestionResult

HASTE, WITHIN = 5, 60.0
"""More attempts than `HASTE` within so many seconds are not made by hand."""


@dataclass(frozen=True)
class MarkedAgain:
    """The attempts of one file, marked again.

    ``results`` are those that count, in the order of the file; ``problems`` says of each other one
    why it does not count; ``other_edition`` is how many were made with another edition of the
    bank, which cannot be marked with this one; ``damaged`` is how many lines are no attempt;
    ``doubt`` says why a person should look at them, or is empty.
    """

    results: tuple[QuestionResult, ...]
    problems: tuple[str, ...]
    other_edition: int
    damaged: int
    doubt: str = ""

    @property
    def best_result(self) -> QuestionResult | None:
        """The result with the best score, the earliest of equal ones."""
        return max(self.results, key=lambda r: (r.score, -r.paper.attempt), default=None)

    @property
    def first_result(self) -> QuestionResult | None:
        """The result of the attempt with the lowest number."""
        return min(self.results, key=lambda r: r.paper.attempt, default=None)

    @property
    def students(self) -> tuple[str, ...]:
        """The logins under which the attempts that count were made."""
        return tuple(dict.fromkeys(result.paper.student for result in self.results))


def mark_file(bank: Bank, content: bytes) -> MarkedAgain:
    """Mark every attempt in the content of an attempts file."""
    found, damaged = record.parse_attempts(content)
    return mark_all(bank, found, damaged)


def mark_all(bank: Bank, found: Iterable[Attempt], damaged: int = 0) -> MarkedAgain:
    """Mark attempts; of several with one number of one student, the first counts."""
    results: list[QuestionResult] = []
    problems: list[str] = []
    seen: set[tuple[str, int]] = set()
    stamps: list[float] = []
    other_edition = surplus = 0
    for attempt in found:
        name = f"Attempt {attempt.attempt} of '{attempt.student}'"
        who = (attempt.student, attempt.attempt)
        stamps.append(_submission_time(attempt.submitted))
        if attempt.quiz != bank.quiz:
            problems.append(f"{name} belongs to the quiz '{attempt.quiz}'.")
        elif attempt.edition != bank.edition:
            other_edition += 1
        elif who in seen:
            problems.append(f"{name} is there more than once; the first one counts.")
        elif attempt.attempt > bank.attempt_limit or len(results) == bank.attempt_limit:
            surplus += 1
        elif (result := mark_again(bank, attempt)) is None:
            problems.append(f"{name} answers questions that were not asked in it.")
        else:
            seen.add(who)
            results.append(result)
    doubt = _describe_doubt(stamps, surplus, bank.attempt_limit)
    return MarkedAgain(tuple(results), tuple(problems), other_edition, damaged, doubt)


def _describe_doubt(stamps: list[float], surplus: int, counted: int) -> str:
    """Say why attempts may not have been made by a person; empty if nothing speaks for it."""
    reasons = []
    if surplus:
        reasons.append(
            f"of {len(stamps)} attempts {surplus} are beyond the first {counted}, which alone count"
        )
    ordered = sorted(stamps)
    spans = [last - first for first, last in zip(ordered, ordered[HASTE:], strict=False)]
    if spans and min(spans) < WITHIN:
        reasons.append(f"more than {HASTE} attempts were submitted within {WITHIN:.0f} seconds")
    return f"A person should look at the attempts: {', and '.join(reasons)}." if reasons else ""


def _submission_time(submitted: str) -> float:
    """Return when an attempt was submitted; all without a time that can be read are of one time."""
    try:
        moment = datetime.fromisoformat(submitted)
        return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()
    except (ValueError, OverflowError):
        return 0.0


def mark_again(bank: Bank, attempt: Attempt) -> QuestionResult | None:
    """Mark an attempt again; None if this edition of the bank could not have dealt it."""
    if (attempt.quiz, attempt.edition) != (bank.quiz, bank.edition):
        return None
    paper = selection.draw(bank, attempt.student, attempt.attempt)
    if not attempt.answers.keys() <= {item.concept.id for item in paper.items}:
        return None
    given: dict[str, Answer] = {}
    for item in paper.items:
        saved = attempt.answers.get(item.concept.id)
        if saved is None or saved.variant != item.variant.id:
            return None
        try:
            given[item.concept.id] = quiz_answers.normalize_answer(item, saved.answer)
        except AnswerError:
            return None
    return scoring.mark_paper(paper, given)


def refresh_score(bank: Bank, attempt: Attempt) -> Attempt:
    """Return an attempt with the score that its answers earn, if they can be marked again."""
    result = mark_again(bank, attempt)
    if result is None:
        return attempt
    return replace(attempt, score=result.score, right=result.right, passed=result.passed)
