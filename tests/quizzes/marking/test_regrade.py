"""What counts of an attempts file that anyone may have written: its answers, and nothing else."""

from __future__ import annotations

import json
import random
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest

from quizzes.attempts import record
from quizzes.attempts.quiz_answers import Answer
from quizzes.attempts.record import Attempt, Given
from quizzes.bank import selection
from quizzes.bank.contents import COUNTED, Bank
from quizzes.bank.loader import read_bank
from quizzes.marking import regrade
from quizzes.marking.regrade import MarkedAgain
from tests.quizzes import sample
from tests.quizzes.conftest import MakeQuiz, answer_all

Line = dict[str, Any]


@pytest.fixture
def honest(make_quiz: MakeQuiz) -> list[Line]:
    """Give three honest attempts: 1, 4 and 2 right."""
    quiz = make_quiz()
    for right in (1, 4, 2):
        answer_all(quiz, right=right)
        quiz.submit()
        quiz.retry()
    return [json.loads(line) for line in Path(quiz._file.path).read_text().splitlines()]


def marked(bank: Bank, lines: list[Line]) -> MarkedAgain:
    return regrade.mark_file(bank, "\n".join(map(json.dumps, lines)).encode())


def test_the_best_and_the_first_attempt_are_found(bank: Bank, honest: list[Line]) -> None:
    found = marked(bank, honest)
    assert found.best_result is not None
    assert found.first_result is not None
    assert (found.best_result.paper.attempt, found.best_result.score) == (2, 4.0)
    assert (found.first_result.paper.attempt, found.first_result.score) == (1, 1.0)
    assert (found.students, found.problems, found.damaged) == (("ada",), (), 0)


def test_a_forged_score_changes_nothing(bank: Bank, honest: list[Line]) -> None:
    before = marked(bank, honest)
    for line in honest:
        line.update(score=5.0, right=5, passed=True)
    assert marked(bank, honest) == before


def other_variant(line: Line) -> None:
    given = line["answers"]["predict"]
    given["variant"] = "predict-1" if given["variant"] != "predict-1" else "predict-2"


def no_such_variant(line: Line) -> None:
    line["answers"]["predict"]["variant"] = "predict-99"


def no_answer(line: Line) -> None:
    del line["answers"]["predict"]


def impossible_answer(line: Line) -> None:
    line["answers"]["predict"]["answer"] = "z"


def number_for_letters(line: Line) -> None:
    line["answers"]["predict"]["answer"] = 1.0


def other_number(line: Line) -> None:
    line["attempt"] = 3


@pytest.mark.parametrize(
    "forge",
    [
        other_variant, no_such_variant, no_answer, impossible_answer, number_for_letters,
        other_number,
    ],
)  # fmt: skip
def test_an_attempt_that_was_never_dealt_does_not_count(
    bank: Bank, honest: list[Line], forge: Callable[[Line], None]
) -> None:
    forge(honest[1])
    found = marked(bank, honest[:2])
    assert found.best_result is not None
    assert found.best_result.score == 1.0
    assert "answers questions that were not asked in it" in found.problems[0]


def test_another_name_on_a_copied_attempt_makes_guesses_of_its_letters(
    bank: Bank, honest: list[Line]
) -> None:
    counted = []
    for number in range(200):
        found = marked(bank, [{**honest[1], "student": f"forger-{number}"}])
        counted += [result.score for result in found.results]
    # Four variants of five concepts: one deal in 1024 asks the same questions, even then the
    # letters stand for other options.
    assert len(counted) <= 3
    assert all(score < 5 for score in counted)


def test_of_two_attempts_with_one_number_the_first_counts(bank: Bank, honest: list[Line]) -> None:
    better = json.loads(json.dumps(honest[1]))
    honest[1]["answers"]["predict"]["answer"] = "abcd".replace(
        honest[1]["answers"]["predict"]["answer"], ""
    )[0]
    found = marked(bank, [honest[1], better])
    assert found.best_result is not None
    assert found.best_result.score == 3.0
    assert "is there more than once" in found.problems[0]


def test_attempts_on_another_edition_are_counted_but_not_marked(
    bank: Bank, honest: list[Line]
) -> None:
    found = marked(bank, [{**line, "edition": "another"} for line in honest])
    assert (found.results, found.other_edition) == ((), 3)


def test_attempts_on_another_quiz_do_not_count(bank: Bank, honest: list[Line]) -> None:
    found = marked(bank, [{**line, "quiz": "ch06"} for line in honest])
    assert found.best_result is None
    assert "belongs to the quiz 'ch06'" in found.problems[0]


def guesses(bank: Bank, count: int, *, seconds: int, logins: int = 1, first: int = 1) -> bytes:
    """Return a file of random guesses, so many seconds apart, under one login or in turns."""
    dice = random.Random(5)
    lines = []
    for number in range(count):
        student, turn = f"guesser-{number % logins}", first + number // logins
        given = {}
        for item in selection.draw(bank, student, turn).items:
            answer: Answer = dice.choice([2.5, 5.0, 7.5, 10.0])
            if item.letters:
                length = {"multiple": dice.randint(1, 4), "ordering": 4, "matching": 3}
                letters = dice.sample(item.letters, length.get(item.variant.kind, 1))
                answer = "".join(sorted(letters) if item.variant.kind == "multiple" else letters)
            given[item.concept.id] = Given(item.variant.id, answer)
        moment = datetime(2026, 1, 1, tzinfo=UTC) + timedelta(seconds=seconds * number)
        lines.append(Attempt(bank.quiz, student, turn, bank.edition, moment.isoformat(), given,
                             5.0, 5, True).to_json())  # fmt: skip
    return "\n".join(lines).encode()


@pytest.mark.parametrize(("logins", "first"), [(1, 1), (4, 1), (300, 1), (1, 21)])
def test_thousands_of_guesses_earn_no_full_marks_and_are_for_a_person(
    tmp_path: Path, logins: int, first: int
) -> None:
    bank = read_bank(sample.write(tmp_path, sample.data(("single", "predict", "multiple"))))
    content = guesses(bank, 1000, seconds=600, logins=logins, first=first)
    attempts, damaged = record.parse_attempts(content)
    everything = [regrade.mark_again(bank, attempt) for attempt in attempts]
    assert damaged == 0
    assert max(result.score for result in everything if result) == 3.0, "guesses do come true"
    found = regrade.mark_file(bank, content)
    assert len(found.results) == (0 if first > COUNTED else COUNTED)
    assert all(result.score < 3.0 for result in found.results)
    beyond = 1000 - len(found.results)
    assert found.doubt == (
        f"A person should look at the attempts: of 1000 attempts {beyond} are beyond the first 20, "
        "which alone count."
    )


@pytest.mark.parametrize("seconds", [0, 1, 11])
def test_attempts_that_follow_one_another_too_fast_are_for_a_person(
    bank: Bank, seconds: int
) -> None:
    found = regrade.mark_file(bank, guesses(bank, 6, seconds=seconds))
    assert len(found.results) == 6
    assert found.doubt == (
        "A person should look at the attempts: more than 5 attempts were submitted within 60 "
        "seconds."
    )
    assert regrade.mark_file(bank, guesses(bank, 5, seconds=seconds)).doubt == ""


def test_stamps_that_are_none_are_no_way_around(bank: Bank) -> None:
    lines = [json.loads(line) for line in guesses(bank, 6, seconds=600).splitlines()]
    for line in lines:
        line["submitted"] = "some day"
    assert "more than 5 attempts" in marked(bank, lines).doubt


def test_a_learner_who_tries_often_is_not_doubted(bank: Bank) -> None:
    found = regrade.mark_file(bank, guesses(bank, COUNTED, seconds=13))
    assert (len(found.results), found.doubt) == (COUNTED, "")


@pytest.mark.parametrize("content", [b"", b"\n\n", b"\x00" * 1000, b"null\n3\n", b"{}" * 9])
def test_rubbish_is_no_attempt(bank: Bank, content: bytes) -> None:
    found = regrade.mark_file(bank, content)
    assert (found.best_result, found.first_result, found.students) == (None, None, ())
