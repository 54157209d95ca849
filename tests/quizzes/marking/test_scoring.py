"""What answers earn: nothing, all, or the share that the kind of question gives."""

from __future__ import annotations

import pytest

from quizzes.attempts.quiz_answers import Answer
from quizzes.bank import selection
from quizzes.bank.contents import Bank, Multiple
from quizzes.bank.selection import PaperItem
from quizzes.marking import scoring
from quizzes.marking.marks import Mark
from tests.quizzes import sample
from tests.quizzes.conftest import MakeQuiz, answer_all, wrong


@pytest.fixture
def items(bank: Bank) -> dict[str, PaperItem]:
    return {item.concept.id: item for item in selection.draw(bank, "ada", 1).items}


def swapped(item: PaperItem) -> str:
    """Return the key with its first two letters in each other's place."""
    key = str(selection.right_answer(item))
    return key[1] + key[0] + key[2:]


def multiple(items: dict[str, PaperItem], right: int, wrong: int) -> Mark:
    item = items["multiple"]
    assert isinstance(item.variant, Multiple)
    key = str(selection.right_answer(item))
    others = [letter for letter in item.letters if letter not in key]
    return scoring.mark_answer(item, "".join(sorted([*key[:right], *others[:wrong]])))


@pytest.mark.parametrize("kind", sample.KINDS)
def test_the_key_earns_everything_and_a_wrong_answer_nothing(
    items: dict[str, PaperItem], kind: str
) -> None:
    item = items[kind]
    right = scoring.mark_answer(item, selection.right_answer(item))
    assert (right.credit, right.is_right, right.misconceptions) == (1.0, True, ())
    assert all(remark.right for remark in right.remarks)
    failed = scoring.mark_answer(item, wrong(item))
    assert (failed.credit, failed.is_right) == (0.0, False)
    assert all(remark.feedback for remark in failed.remarks)


@pytest.mark.parametrize("kind", sample.KINDS)
def test_no_answer_earns_nothing_and_shows_no_belief(
    items: dict[str, PaperItem], kind: str
) -> None:
    mark = scoring.mark_answer(items[kind], "")
    assert mark.credit == 0.0
    assert kind == "matching" or mark.misconceptions == ()


@pytest.mark.parametrize(
    ("right", "wrong_", "credit"),
    [(2, 0, 1.0), (1, 0, 0.5), (2, 1, 0.5), (1, 1, 0.0), (0, 2, 0.0), (2, 2, 0.0)],
)
def test_several_choices(
    items: dict[str, PaperItem], right: int, wrong_: int, credit: float
) -> None:
    mark = multiple(items, right, wrong_)
    assert mark.credit == credit
    assert mark.misconceptions == ((sample.BELIEF,) if wrong_ else ())


def test_a_choice_shows_the_belief_behind_it(items: dict[str, PaperItem]) -> None:
    mark = scoring.mark_answer(items["predict"], wrong(items["predict"]))
    assert mark.misconceptions == (sample.BELIEF,)
    assert mark.remarks[0].show


def test_a_number_is_right_within_the_tolerance_and_traps_are_known(bank: Bank) -> None:
    (item,) = (i for i in selection.draw(bank, "ada", 1).items if i.concept.id == "numeric")
    key = float(selection.right_answer(item))
    for number, credit in ((key + 0.1, 1.0), (key - 0.1, 1.0), (key + 0.11, 0.0)):
        assert scoring.mark_answer(item, number).credit == credit
    trap = scoring.mark_answer(item, 100.3)
    assert trap.misconceptions == (sample.BELIEF,)
    assert "rate" in trap.remarks[0].feedback
    assert scoring.mark_answer(item, 77.0).misconceptions == ()


@pytest.mark.parametrize(("kind", "credit"), [("ordering", 0.5), ("matching", 1 / 3)])
def test_a_built_answer_earns_its_share(
    items: dict[str, PaperItem], kind: str, credit: float
) -> None:
    mark = scoring.mark_answer(items[kind], swapped(items[kind]))
    assert mark.credit == pytest.approx(credit)
    assert mark.misconceptions == (sample.BELIEF,)


@pytest.mark.parametrize(
    ("right", "passed", "headline"),
    [
        (5, True, "Passed: 5 of 5 right, 4 of 5 needed."),
        (4, True, "Passed: 4 of 5 right, 4 of 5 needed."),
        (3, False, "Not passed yet: 3 of 5 right, 4 of 5 needed."),
        (0, False, "Not passed yet: 0 of 5 right, 4 of 5 needed."),
    ],
)
def test_four_of_five_pass(make_quiz: MakeQuiz, right: int, passed: bool, headline: str) -> None:
    quiz = make_quiz()
    answer_all(quiz, right=right)
    result = quiz.submit()
    assert (result.right, result.score, result.passed) == (right, right, passed)
    assert result.headline == headline


def test_part_of_a_point_counts_as_points_but_not_towards_passing(make_quiz: MakeQuiz) -> None:
    quiz = make_quiz()
    answer_all(quiz, right=3)
    ordering: Answer = swapped(quiz.item("ordering"))
    quiz.answer("ordering", ordering)
    result = quiz.submit()
    assert (result.score, result.right, result.passed) == (3.5, 3, False)
    assert "3 of 5 right (3.5 points with partial credit), 4 of 5 needed" in result.headline


def test_a_result_reads_as_text_with_the_feedback(make_quiz: MakeQuiz) -> None:
    quiz = make_quiz()
    answer_all(quiz, right=4)
    text = repr(quiz.submit())
    assert "Question 1: right" in text
    assert "Question 5: not right" in text
    assert f"{sample.SECRET} not so." in text
    assert "See it happen" in text
