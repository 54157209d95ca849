"""A closed quiz: learners get questions without a key, and what they answer is marked elsewhere."""

from __future__ import annotations

import json
import re
import shutil
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
import yaml

import quizzes
from quizzes.attempts import record
from quizzes.bank import lint, loader, selection
from quizzes.bank.contents import Bank, Matching
from quizzes.bank.loader import load_bank, read_bank
from quizzes.errors import BankError, QuizError
from quizzes.exchange import bank_files
from quizzes.marking import closed_quizzes, regrade
from quizzes.notebook.quiz import Quiz
from quizzes.widget import QuizWidget, widget_state
from tests.quizzes import sample
from tests.quizzes.conftest import wrong
from tests.quizzes.widget.test_widget_state import other_keys

KINDS = ("single", "predict", "multiple", "numeric", "ordering", "matching")
FILE = closed_quizzes.sheet_filename(sample.NAME)


def closed(**changes: Any) -> dict[str, Any]:
    return {**sample.data(KINDS), "closed": True, **changes}


@pytest.fixture
def bank(tmp_path: Path) -> Bank:
    """Return the instructor's bank, with keys."""
    return read_bank(sample.write(tmp_path / "instructor", closed()))


@pytest.fixture
def work(bank: Bank, tmp_path: Path) -> Path:
    """Return a learner's folder, which holds what is handed out."""
    return handed_out(bank, tmp_path / "work")


def handed_out(bank: Bank, folder: Path) -> Path:
    (folder / "assets").mkdir(parents=True)
    (folder / FILE).write_text(closed_quizzes.make_sheet(bank), encoding="utf-8")
    for name in closed_quizzes.picture_files(bank):
        (folder / name).write_bytes((bank.folder / name).read_bytes())
    return folder


def answer(quiz: Quiz, bank: Bank, *, right: int) -> None:
    """Answer with the instructor's keys: the first ``right`` rightly, the others wrongly."""
    for item in selection.draw(bank, quiz.student, quiz.attempt).items:
        quiz.answer(
            item.number, selection.right_answer(item) if item.number <= right else wrong(item)
        )


def marked(bank: Bank, folder: Path) -> regrade.MarkedAgain:
    return regrade.mark_file(bank, (folder / record.attempts_filename(bank.quiz)).read_bytes())


def test_nothing_of_the_key_is_in_the_questions(bank: Bank) -> None:
    text = closed_quizzes.make_sheet(bank)
    assert not re.search(sample.SECRET, text, re.IGNORECASE)
    assert re.search(sample.SECRET, yaml.safe_dump(closed())), "the mark is one that is found"


def test_the_questions_are_the_same_whatever_the_key_is(tmp_path: Path) -> None:
    one, other = (
        closed_quizzes.make_sheet(read_bank(sample.write(tmp_path / name, content)))
        for name, content in (("these", closed()), ("others", other_keys(closed())))
    )
    assert one == other


def test_the_order_in_a_bank_is_not_handed_out(tmp_path: Path) -> None:
    turned = closed()
    for concept in turned["concepts"]:
        for variant in concept["variants"]:
            if "options" in variant:
                variant["options"].reverse()
    one, other = (
        closed_quizzes.make_sheet(read_bank(sample.write(tmp_path / name, content)))
        for name, content in (("these", closed()), ("turned", turned))
    )
    assert one == other


@pytest.mark.parametrize("attempt", [1, 2, 5])
def test_letters_stand_for_the_same_in_the_questions_and_in_the_bank(
    bank: Bank, work: Path, attempt: int
) -> None:
    sheet = closed_quizzes.read_sheet(work / FILE, sample.NAME)
    assert sheet.edition == bank.edition
    for student in (f"student-{n}" for n in range(20)):
        dealt, known = (selection.draw(one, student, attempt).items for one in (sheet, bank))
        for mine, theirs in zip(dealt, known, strict=True):
            assert mine.variant.id == theirs.variant.id
            assert mine.letters == theirs.letters
            assert [mine.text_of(c) for c in mine.letters] == [
                theirs.text_of(c) for c in theirs.letters
            ]
            if isinstance(mine.variant, Matching) and isinstance(theirs.variant, Matching):
                lefts = [[pair.left for pair in v.pairs] for v in (mine.variant, theirs.variant)]
                assert lefts[0] == lefts[1]


@pytest.mark.parametrize("right", [0, 4, 6])
def test_answers_to_the_questions_are_marked_with_the_keys_of_the_bank(
    bank: Bank, work: Path, right: int
) -> None:
    quiz = quizzes.load(sample.NAME, student="ada", folder=work)
    answer(quiz, bank, right=right)
    result = quiz.submit()
    assert repr(result) == "**Handed in: your instructor marks it.**"
    best = marked(bank, work).best_result
    assert best is not None
    assert best.right == right


def test_nothing_is_said_about_the_answers(bank: Bank, work: Path) -> None:
    states = []
    for student, right in (("ada", 6), ("ada", 0)):
        quiz = quizzes.load(sample.NAME, student=student, folder=work)
        answer(quiz, bank, right=right)
        quiz.submit()
        widget = QuizWidget(quiz)
        states.append(
            {"result": widget.result, "standing": widget_state.paper_data(quiz)["standing"]}
        )
        (work / record.attempts_filename(sample.NAME)).unlink()
    assert states[0] == states[1]
    assert states[0]["result"]["marks"] == []
    assert states[0]["standing"] == "Handed in: 1 of 1."
    saved = quiz.attempts[-1]
    assert (saved.score, saved.right, saved.passed) == (0.0, 0, False)
    with pytest.raises(QuizError, match="Your instructor marks this quiz"):
        quiz.points()


def test_there_are_as_many_attempts_as_the_bank_says(tmp_path: Path) -> None:
    bank = read_bank(sample.write(tmp_path / "instructor", closed(attempts=2)))
    work = handed_out(bank, tmp_path / "work")
    quiz = quizzes.load(sample.NAME, student="ada", folder=work)
    for right in (2, 5):
        answer(quiz, bank, right=right)
        quiz.submit()
        if right == 2:
            assert quiz.more
            quiz.retry()
    assert not quiz.more
    assert not widget_state.paper_data(quiz)["more"]
    with pytest.raises(QuizError, match="2 attempts, and you have handed in the last"):
        quiz.retry()
    again = quizzes.load(sample.NAME, student="ada", folder=work)
    assert again.result is not None
    assert again.given == quiz.given
    best = marked(bank, work).best_result
    assert best is not None
    assert best.right == 5


def test_an_attempt_too_many_does_not_count_and_is_for_a_person(bank: Bank, work: Path) -> None:
    quiz = quizzes.load(sample.NAME, student="ada", folder=work)
    answer(quiz, bank, right=1)
    quiz.submit()
    path = work / record.attempts_filename(sample.NAME)
    second = json.loads(path.read_text())
    for item in selection.draw(bank, "ada", 2).items:
        given = {"variant": item.variant.id, "answer": selection.right_answer(item)}
        second["answers"][item.concept.id] = given
    path.write_text(path.read_text() + json.dumps({**second, "attempt": 2}) + "\n")
    found = marked(bank, work)
    assert [result.right for result in found.results] == [1]
    assert "of 2 attempts 1 are beyond the first 1" in found.doubt


EXAM = loader.BANKS.parent / "examples" / "exam.yaml"


def test_three_questions_with_one_variant_each_are_a_closed_quiz(tmp_path: Path) -> None:
    bank = read_bank(EXAM)
    assert [len(concept.variants) for concept in bank.concepts] == [1, 1, 1]
    assert lint.list_findings(bank) == []
    folder = tmp_path / "work"
    folder.mkdir()
    (folder / closed_quizzes.sheet_filename("exam")).write_text(
        closed_quizzes.make_sheet(bank), encoding="utf-8"
    )
    quiz = quizzes.load("exam", student="ada", folder=folder)
    answer(quiz, bank, right=2)
    quiz.submit()
    best = marked(bank, folder).best_result
    assert best is not None
    assert best.right == 2
    assert "None" not in repr(best)


def test_without_closed_it_would_have_to_teach(tmp_path: Path) -> None:
    path = tmp_path / "exam.yaml"
    path.write_text(EXAM.read_text().replace("closed: true\n", ""))
    with pytest.raises(BankError) as caught:
        read_bank(path)
    said = "\n".join(caught.value.faults)
    for missing in (
        "variants: it must have at least 4",
        "proof: it is required",
        "options 1 feedback: it is required",
        "misconception: a wrong option needs",
    ):
        assert missing in said  # fmt: skip


@pytest.mark.parametrize("count", [1, 2, 3])
def test_few_variants_are_dealt_by_turns(count: int) -> None:
    data = closed()
    for concept in data["concepts"]:
        del concept["variants"][count:]
    bank = Bank.model_validate(data)
    for student in (f"student-{n}" for n in range(30)):
        dealt = [[item.variant.id for item in selection.draw(bank, student, attempt).items]
                 for attempt in range(1, 4 * count + 1)]  # fmt: skip
        for place in range(len(bank.concepts)):
            ids = [items[place] for items in dealt]
            assert all(len(set(ids[n : n + count])) == count for n in range(0, len(ids), count))
            assert count == 1 or all(a != b for a, b in pairwise(ids))


def test_the_questions_hold_nothing_that_only_teaching_needs(bank: Bank) -> None:
    for field in ("proof", "misconception", "feedback", "show"):
        assert f"{field}:" not in closed_quizzes.make_sheet(bank)


def test_an_open_quiz_has_no_question_sheet() -> None:
    with pytest.raises(BankError, match=r"'ch05' is not closed.*write 'closed: true'"):
        closed_quizzes.make_sheet(load_bank("ch05"))


def test_a_bank_without_keys_must_be_of_a_closed_quiz(tmp_path: Path) -> None:
    path = sample.write(tmp_path, {**sample.data(), "keyless": True})
    with pytest.raises(BankError, match=r"sample.yaml, line \d+, field keyless: only the"):
        read_bank(path)


def test_a_sheet_that_is_none_is_refused_in_a_sentence(tmp_path: Path) -> None:
    bank = sample.write(tmp_path, closed())
    bank.rename(tmp_path / FILE)
    with pytest.raises(BankError, match=r"quiz-sample.questions.yaml is not a question sheet"):
        quizzes.load(sample.NAME, folder=tmp_path)
    (tmp_path / FILE).write_text("quiz: [")
    with pytest.raises(BankError, match=r"quiz-sample.questions.yaml is not valid YAML"):
        quizzes.load(sample.NAME, folder=tmp_path)


def test_an_unknown_quiz_names_the_sheets_that_are_there(work: Path) -> None:
    with pytest.raises(BankError, match=r"no quiz 'sampel': there are ch05, sample. Did you mean"):
        quizzes.load("sampel", folder=work)


def test_questions_are_not_exported_as_if_they_had_keys(bank: Bank, work: Path) -> None:
    with pytest.raises(BankError, match=r"quiz-sample.questions.yaml holds questions without keys"):
        bank_files.open_bank(str(work / FILE))
    path = work / f"{sample.NAME}.yaml"
    shutil.copy(work / FILE, path)
    with pytest.raises(BankError, match=r"sample.yaml holds questions without keys"):
        bank_files.open_bank(str(path))


def test_a_closed_bank_comes_back_from_gift_as_it_was(bank: Bank, tmp_path: Path) -> None:
    gift, _ = bank_files.export_bank(bank, "gift", tmp_path / "sample.gift")
    path, _ = bank_files.import_gift(gift, bank, tmp_path / f"{sample.NAME}.yaml")
    back = read_bank(sample.write(tmp_path / "pictures", yaml.safe_load(path.read_text())))
    assert back.model_dump() == bank.model_dump()
