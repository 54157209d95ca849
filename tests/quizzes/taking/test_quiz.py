"""A quiz as a learner takes it: answered, submitted, tried again, left and taken up."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from IPython.testing.globalipapp import start_ipython

import quizzes
from quizzes.bank import selection
from quizzes.bank.contents import COUNTED, Bank
from quizzes.errors import AnswerError, AttemptsError, QuizError
from quizzes.taking.identity import current_login
from quizzes.widget import widget_state
from tests.quizzes import sample
from tests.quizzes.conftest import MakeQuiz, answer_all, wrong


def test_the_real_quiz_can_be_taken_without_a_widget(tmp_path: Path) -> None:
    quiz = quizzes.load("ch05", student="ada", folder=tmp_path)
    assert "attempt 1 is open" in repr(quiz)
    for item in quiz.items:
        assert f"Question {item.number}" in repr(quiz.question(item.number))
        quiz.answer(item.concept.id, selection.right_answer(item))
    result = quiz.submit()
    assert (result.right, result.passed) == (5, True)
    assert quiz.points() == 5.0


def test_reading_and_marking_a_quiz_needs_no_widget_library(tmp_path: Path) -> None:
    code = (
        "import sys, quizzes; from pathlib import Path\n"
        f"quiz = quizzes.load('ch05', folder=Path({str(tmp_path)!r})); repr(quiz.question(1))\n"
        "print({'anywidget', 'ipywidgets', 'IPython', 'course', 'rclpy'} & set(sys.modules))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True
    )
    assert (done.stdout, done.stderr) == ("set()\n", "")


def test_the_first_and_the_best_score_are_kept(make_quiz: MakeQuiz) -> None:
    quiz = make_quiz()
    assert (quiz.first, quiz.best, quiz.points()) == (None, None, 0.0)
    for right in (2, 5, 1, 5):
        answer_all(quiz, right=right)
        quiz.submit()
        quiz.retry()
    again = make_quiz()
    assert again.first is not None
    assert again.best is not None
    assert (again.first.score, again.best.score, again.best.attempt) == (2, 5, 2)
    assert again.points() == 5.0
    assert again.attempt == 5


def test_practice_goes_on_but_only_the_first_attempts_count(make_quiz: MakeQuiz) -> None:
    quiz = make_quiz()
    for number in range(1, COUNTED + 2):
        answer_all(quiz, right=3 if number == 7 else 1 if number <= COUNTED else 5)
        quiz.submit()
        quiz.retry()
    again = make_quiz()
    assert len(again.attempts) == COUNTED + 1
    assert again.best is not None
    assert (again.best.attempt, again.points()) == (7, 3.0)
    standing = widget_state.paper_data(again)["standing"]
    assert "So far: not passed yet. The first 20 attempts count: this one is practice." in standing


def test_a_retry_is_another_quiz(make_quiz: MakeQuiz) -> None:
    quiz = make_quiz()
    asked = {item.variant.id for item in quiz.items}
    answer_all(quiz, right=5)
    quiz.submit()
    quiz.retry()
    assert not asked & {item.variant.id for item in quiz.items}
    assert quiz.result is None
    assert quiz.given == {}


def test_two_students_are_asked_in_different_ways(make_quiz: MakeQuiz) -> None:
    ada, alan = make_quiz("ada"), make_quiz("alan")
    assert [i.order for i in ada.items] != [i.order for i in alan.items]
    answer_all(ada, right=5)
    ada.submit()
    assert make_quiz("alan").attempts == [], "a file holds the attempts of each under their name"


def test_answers_that_were_not_submitted_are_still_there(make_quiz: MakeQuiz) -> None:
    quiz = make_quiz()
    quiz.answer("numeric", 2.5)
    quiz.answer("matching", {2: "a"})
    quiz.answer("predict", "a")
    quiz.answer("predict", None)
    again = make_quiz()
    assert again.given == {"numeric": 2.5, "matching": "-a-", "predict": ""} | {
        "multiple": "", "ordering": "",
    }  # fmt: skip
    assert again.open_questions == [1, 2, 4, 5]


def test_a_submitted_quiz_comes_back_with_its_feedback(make_quiz: MakeQuiz) -> None:
    quiz = make_quiz()
    answer_all(quiz, right=3)
    result = quiz.submit()
    again = make_quiz()
    assert again.attempt == 1
    assert again.result == result
    again.retry()
    third = make_quiz()
    assert (third.attempt, third.result) == (2, None), "a retry that was begun goes on"


def test_submitting_twice_is_one_attempt(make_quiz: MakeQuiz) -> None:
    quiz = make_quiz()
    answer_all(quiz, right=4)
    assert quiz.submit() is quiz.submit()
    assert len(make_quiz().attempts) == 1


def test_of_two_windows_on_one_attempt_the_second_is_told(make_quiz: MakeQuiz) -> None:
    one, other = make_quiz(), make_quiz()
    answer_all(one, right=2)
    answer_all(other, right=5)
    one.submit()
    with pytest.raises(AttemptsError, match=r"Attempt 1 has been submitted already.*run this cell"):
        other.submit()
    assert other.result is None
    other.reload()
    assert other.result is not None
    assert other.result.score == 2


def test_two_windows_answer_different_questions_of_one_attempt(make_quiz: MakeQuiz) -> None:
    one, other = make_quiz(), make_quiz()
    one.answer("predict", "a")
    one.answer("numeric", 1.0)
    other.answer("multiple", "b")
    other.answer("numeric", 2.5)
    one.answer("ordering", "abcd")
    both = {"predict": "a", "multiple": "b", "numeric": 2.5, "ordering": "abcd"}
    assert {**make_quiz().given, "matching": ""} == {**both, "matching": ""}
    assert one.given == both, "a window shows what is saved, once it saves something itself"
    other.answer("predict", None)
    assert make_quiz().given["predict"] == ""


def test_a_window_on_an_attempt_that_is_over_spoils_no_newer_one(make_quiz: MakeQuiz) -> None:
    one, stale, mirror = make_quiz(), make_quiz(), make_quiz()
    answer_all(one, right=2)
    one.submit()
    mirror.reload()
    one.retry()
    one.answer("predict", "a")
    with pytest.raises(AttemptsError, match=r"Attempt 1 has been submitted already.*run this cell"):
        stale.answer("multiple", "b")
    mirror.retry()
    assert mirror.given["predict"] == "a", "a retry in two windows is one retry"
    again = make_quiz()
    assert (again.attempt, again.given["predict"], again.given["multiple"]) == (2, "a", "")


def test_a_number_that_can_be_submitted_can_be_read_again(make_quiz: MakeQuiz) -> None:
    quiz = make_quiz()
    answer_all(quiz, right=5)
    with pytest.raises(AnswerError, match=r"1e\+305 does not fit question 3: answer with a number"):
        quiz.answer("numeric", 1e305)
    assert quiz.given["numeric"] == selection.right_answer(quiz.item("numeric"))
    quiz.answer("numeric", -1e300)
    quiz.submit()
    again = make_quiz()
    assert (again.notice, again.points()) == ("", 4.0)


def test_folders_may_be_text_and_what_is_none_is_told(tmp_path: Path, bank: Bank) -> None:
    quiz = quizzes.load("sample", student="ada", folder=str(tmp_path), banks=str(bank.folder))
    quiz.answer("numeric", 2)
    assert (tmp_path / ".quiz-sample.draft.json").is_file()
    for name, value in (("folder", 5), ("banks", b"x"), ("folder", "a\0b"), ("banks", ["x"])):
        with pytest.raises(QuizError, match=rf"^{name}=.* is no folder: give its path") as caught:
            quizzes.load("ch05", **{name: value})  # type: ignore[arg-type]
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("student", [5, "\udcff", b"ada", ["ada"]])
def test_a_student_without_a_name_is_told(student: Any, tmp_path: Path) -> None:
    with pytest.raises(QuizError, match="is no name that can be saved: give it as plain text"):
        quizzes.load("ch05", student=student, folder=tmp_path)


def test_an_unanswered_question_is_not_submitted(make_quiz: MakeQuiz) -> None:
    quiz = make_quiz()
    for item in quiz.items[:3]:
        quiz.answer(item.number, selection.right_answer(item))
    with pytest.raises(AnswerError, match="question 4 and 5 has no complete answer"):
        quiz.submit()
    assert quiz.attempts == []


def test_misuse_is_told_in_a_sentence(make_quiz: MakeQuiz) -> None:
    quiz = make_quiz()
    for which in (0, 6, "qos", -1, True, None, 1.5):
        with pytest.raises(AnswerError, match=r"no question .*there are 1 to 5 \(predict, "):
            quiz.answer(which, "a")  # type: ignore[arg-type]
    with pytest.raises(QuizError, match="still open"):
        quiz.retry()
    with pytest.raises(QuizError, match="once you have submitted"):
        quiz.demo(1)
    answer_all(quiz, right=5)
    quiz.submit()
    with pytest.raises(AnswerError, match=r"submitted.*quiz\.retry\(\)"):
        quiz.answer(1, "a")
    with pytest.raises(QuizError, match="nothing to run"):
        quiz.demo("numeric")


def test_an_error_shows_no_traceback_in_a_notebook(make_quiz: MakeQuiz) -> None:
    with pytest.raises(AnswerError) as caught:
        make_quiz().answer(9, "a")
    assert caught.value._render_traceback_() == [f"AnswerError: {caught.value}"]


def test_a_demonstration_becomes_a_cell(make_quiz: MakeQuiz) -> None:
    quiz = make_quiz()
    answer_all(quiz, right=1)
    quiz.submit()
    shell = start_ipython() or __import__("IPython").get_ipython()
    quiz.demo("predict")
    assert shell.rl_next_input == "print(6 * 7)"
    quiz.demo("ordering")
    assert shell.rl_next_input == f"print('{sample.SECRET}')"


def test_a_folder_that_takes_no_files_leaves_the_quiz_usable(make_quiz: MakeQuiz) -> None:
    quiz = make_quiz(where=Path("/proc"))
    answer_all(quiz, right=5)
    assert quiz.notice.startswith("Nothing can be saved in /proc (")
    assert quiz.submit().passed
    assert "do not count until" in quiz.notice
    quiz.retry()
    assert quiz.attempt == 2


def test_a_damaged_file_is_told_and_what_is_sound_counts(make_quiz: MakeQuiz) -> None:
    quiz = make_quiz()
    answer_all(quiz, right=4)
    quiz.submit()
    path = Path(quiz._file.path)
    path.write_bytes(path.read_bytes() + b"{half a li")
    again = make_quiz()
    assert "was damaged: the original is kept as" in again.notice
    assert again.points() == 4.0


def test_a_score_in_the_file_is_not_believed(make_quiz: MakeQuiz) -> None:
    quiz = make_quiz()
    answer_all(quiz, right=1)
    quiz.submit()
    path = Path(quiz._file.path)
    path.write_text(path.read_text().replace('"score": 1.0', '"score": 5.0'))
    assert make_quiz().points() == 1.0


@pytest.mark.parametrize(
    "draft",
    [
        "", "[]", "null", "{", '{"answers": 3}', "[" * 100_000,
        {"attempt": 1, "answers": {"predict": "z", "numeric": "x", "matching": 7}},
        {"attempt": 7, "answers": {"predict": "a"}}, {"attempt": 1, "answers": ["a"]},
        {"attempt": 1, "answers": {"predict": "a"}, "student": "alan"},
        {"attempt": 1, "answers": {"predict": "a"}, "edition": "old"},
    ],
)  # fmt: skip
def test_a_strange_draft_does_no_harm(make_quiz: MakeQuiz, draft: str | dict[str, object]) -> None:
    quiz = make_quiz()
    if not isinstance(draft, str):
        mine = {"quiz": "sample", "student": "ada", "edition": quiz.bank.edition}
        draft = json.dumps({**mine, **draft})
    (Path(quiz._file.path).parent / ".quiz-sample.draft.json").write_text(draft)
    again = make_quiz()
    assert again.attempt == 1
    assert not any(again.given.values())
    answer_all(again, right=5)
    assert again.submit().passed


def test_the_student_is_the_user_of_the_hub_or_of_the_machine(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("JUPYTERHUB_USER", "ada.lovelace")
    assert current_login() == "ada.lovelace"
    monkeypatch.delenv("JUPYTERHUB_USER")
    monkeypatch.setenv("LOGNAME", "alan")
    assert current_login() == "alan"


def test_a_crash_between_answers_loses_none(make_quiz: MakeQuiz, tmp_path: Path) -> None:
    code = (
        "import os, sys; from pathlib import Path; from quizzes.bank.loader import read_bank\n"
        "from quizzes.notebook.quiz import Quiz\n"
        "bank = read_bank(Path(sys.argv[1]) / 'banks' / 'sample.yaml')\n"
        "quiz = Quiz(bank, student='ada', folder=Path(sys.argv[1]) / 'work')\n"
        "quiz.answer('predict', 'c'); os.kill(os.getpid(), 9)"
    )
    make_quiz()
    done = subprocess.run([sys.executable, "-c", code, str(tmp_path)], timeout=60, check=False)
    assert done.returncode == -9
    assert make_quiz().given["predict"] == "c"


def test_a_wrong_answer_is_complete(make_quiz: MakeQuiz) -> None:
    """Guards the helper that other tests rely on."""
    quiz = make_quiz()
    for item in quiz.items:
        quiz.answer(item.number, wrong(item))
    assert quiz.open_questions == []
    assert quiz.submit().score == 0
