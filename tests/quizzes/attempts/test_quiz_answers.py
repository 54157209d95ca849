"""Every sensible way to write an answer is understood; any other is refused in a sentence."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from quizzes.attempts import quiz_answers
from quizzes.attempts.quiz_answers import Answer
from quizzes.bank import selection
from quizzes.bank.contents import Bank
from quizzes.bank.selection import PaperItem
from quizzes.errors import AnswerError


@pytest.fixture
def items(bank: Bank) -> dict[str, PaperItem]:
    return {item.concept.id: item for item in selection.draw(bank, "ada", 1).items}


@pytest.mark.parametrize(
    ("kind", "given", "answer"),
    [
        ("predict", "b", "b"), ("predict", " B ", "b"), ("predict", ["b"], "b"),
        ("predict", None, ""), ("predict", "", ""),
        ("multiple", "ca", "ac"), ("multiple", ["c", "a"], "ac"), ("multiple", {"c", "a"}, "ac"),
        ("multiple", "c, a", "ac"), ("multiple", ("d",), "d"),
        ("numeric", np.int64(2), 2.0), ("numeric", np.float32(0.5), 0.5), ("numeric", 1e300, 1e300),
        ("numeric", 3, 3.0), ("numeric", 3.5, 3.5), ("numeric", "-3.5e1", -35.0),
        ("ordering", "dcba", "dcba"), ("ordering", ["d", "c", "b", "a"], "dcba"),
        ("matching", "bca", "bca"), ("matching", "b-a", "b-a"), ("matching", "---", ""),
        ("matching", {1: "b", 3: "a"}, "b-a"), ("matching", "aaa", "aaa"),
    ],
)  # fmt: skip
def test_an_answer_gets_its_saved_form(
    items: dict[str, PaperItem], kind: str, given: Any, answer: Answer
) -> None:
    assert quiz_answers.normalize_answer(items[kind], given) == answer


@pytest.mark.parametrize(
    ("kind", "given"),
    [
        ("predict", "e"), ("predict", "ab"), ("predict", 1), ("predict", True), ("predict", "-"),
        ("predict", b"a"), ("predict", object()), ("predict", [["a"]]), ("predict", {"a": 1}),
        ("multiple", "aa"), ("multiple", "ae"), ("multiple", [1, 2]),
        ("numeric", "three"), ("numeric", float("nan")), ("numeric", "inf"), ("numeric", True),
        ("numeric", [1.0]), ("numeric", "3,5"), ("numeric", "1_000"), ("numeric", np.bool_(True)),
        ("numeric", 1e305), ("numeric", "-1e305"), ("numeric", 3j), ("numeric", np.float64("nan")),
        ("ordering", {"d", "c", "b", "a"}), ("matching", frozenset("bca")), ("predict", "\udcff"),
        ("ordering", "abc"), ("ordering", "abca"), ("ordering", "abcde"),
        ("matching", "ab"), ("matching", "abcd"), ("matching", {4: "a"}), ("matching", {1: "z"}),
        ("matching", {"1": "a"}), ("predict", "a" * 10_000),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_refused_and_says_what_does(
    items: dict[str, PaperItem], kind: str, given: Any
) -> None:
    with pytest.raises(AnswerError) as caught:
        quiz_answers.normalize_answer(items[kind], given)
    assert f"uestion {items[kind].number}" in str(caught.value)
    assert len(str(caught.value)) < 250


def test_a_number_beyond_all_bounds_is_refused(items: dict[str, PaperItem]) -> None:
    for given in (10**400, 10**5000):
        with pytest.raises(AnswerError, match="answer with a number in s"):
            quiz_answers.normalize_answer(items["numeric"], given)


def test_an_answer_is_complete_when_nothing_is_left_open(items: dict[str, PaperItem]) -> None:
    assert not any(quiz_answers.is_complete(item, "") for item in items.values())
    assert not quiz_answers.is_complete(items["matching"], "a-b")
    assert quiz_answers.is_complete(items["matching"], "acb")
    assert quiz_answers.is_complete(items["numeric"], 0.0)
