"""Choices: what is a word and what is not, and what a wrong one is told."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from autograder.examination.check_context import StudentError
from autograder.examination.exam import Exam, Failed
from autograder.observe.choices import Choices, Question

MEANINGS = {"dog": "It brings the ball back.", "cat": "It watches the ball fly."}
FETCHES = Question("The pet fits.", "Balls are expensive.", ("Whistle.",), MEANINGS)
PETS = Choices("pets", ("dog", "cat"), {"fetches": FETCHES, "sleeps": FETCHES})


def bench(value: Any, key: dict[str, list[str]] | None = None) -> Any:
    def read(_: str) -> Any:
        if isinstance(value, Exception):
            raise value
        return value

    return SimpleNamespace(subject=SimpleNamespace(value=read), memory={}, key=key or {})


@pytest.mark.parametrize(
    ("value", "told"),
    [
        (["dog"], "pets is not a dictionary but \\['dog'\\]"),
        ({"fetches": None}, "fetches is still open; sleeps is missing"),
        ({"fetches": "bird", "sleeps": 3}, "fetches is 'bird'; sleeps is 3"),
        (StudentError("ValueError: no JSON."), "It could not be read: no JSON."),
        (StudentError("There is no `pets`.", missing=True), "There is no `pets`."),
    ],
)
def test_what_is_no_word_is_told(value: Any, told: str) -> None:
    with pytest.raises(Failed, match=told):
        PETS.read(bench(value))


def test_each_question_has_a_check_that_compares_with_the_key() -> None:
    exam: Exam[Any] = Exam("pets", lambda bench: bench)
    exam.check()(lambda rig: None)
    PETS.add_checks(exam, needs=(), read="Chapter 1")
    check = exam.checks["fetches_choice"]
    assert (check.title, check.rationale, check.hints, check.read) == (
        FETCHES.title, FETCHES.why, FETCHES.hints, "Chapter 1",
    )  # fmt: skip
    given = bench({"fetches": "Dog", "sleeps": "cat"}, {"fetches": ["dog"], "sleeps": ["dog"]})
    PETS.read(given)
    rig = SimpleNamespace(bench=given)
    assert check.run(rig) == MEANINGS["dog"]
    with pytest.raises(Failed, match=r'You chose "cat"\. It watches'):
        exam.checks["sleeps_choice"].run(rig)


def test_where_several_are_right_that_is_said() -> None:
    said = PETS.require_right("fetches", "dog", {"fetches": ["dog", "cat"]})
    assert said == "More than one answer is right here. It brings the ball back."


def test_a_part_without_its_key_is_the_graders_fault() -> None:
    with pytest.raises(LookupError, match="no answer key came along"):
        PETS.require_right("fetches", "dog", {})
