"""A quiz's attempts under another name, or another login, count or are asked about."""

from __future__ import annotations

import unicodedata
import zipfile
from pathlib import Path

import pytest

from autograder.assignments.intake import claim_records
from autograder.assignments.intake.claim_records import Claim
from autograder.assignments.intake.handed_files.handed_in import look_through
from autograder.examination.verdict import Verdict
from autograder.gradebook.quizzes import quiz_marks
from quizzes.bank.loader import load_bank
from tests.autograder.gradebook.test_quiz_marks import FILE, take

KEY = "quiz-ch05"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    folder = tmp_path / "submitted" / "ada" / "ch05-quiz"
    folder.mkdir(parents=True)
    return folder


def verdict(folder: Path, student: str = "ada") -> Verdict:
    return quiz_marks.mark_best_attempt(load_bank("ch05"), folder, student)


def rename(folder: Path, name: str) -> None:
    (folder / name).parent.mkdir(parents=True, exist_ok=True)
    (folder / FILE).rename(folder / name)


def asked(found: Verdict) -> str:
    assert found.needs_human
    said = next(check.actual for check in found.checks if check.status == "not_examined")
    assert said.isprintable()
    return said


@pytest.mark.parametrize(
    "name",
    [
        "quiz-ch05.attempts (1).jsonl", "Quiz-ch05.attempts.jsonl", "ada_quiz-ch05.attempts.jsonl",
        "quiz-ch05.attempts.jsonl.txt", "ch05-quiz/quiz-ch05.attempts.jsonl", "attempts\n.jsonl",
        "quiz-ch05.attempts.jsonl.corrupt-1", "quiz_ch05.json", "my_quiz.txt", "answers.json",
        "ada.txt", "quiz-ch05",
    ],
)  # fmt: skip
def test_attempts_under_another_name_count_and_that_is_said(folder: Path, name: str) -> None:
    take(folder, "ada", 5)
    rename(folder, name)
    found = verdict(folder)
    assert (found.score, found.needs_human) == (5.0, False)
    assert f"There was no {FILE}, but" in found.notes[0]
    assert found.notes[0].isprintable()


def test_attempts_in_a_zip_file_count(folder: Path) -> None:
    take(folder, "ada", 5)
    with zipfile.ZipFile(folder / "hand-in.zip", "w") as archive:
        archive.write(folder / FILE, FILE)
    (folder / FILE).unlink()
    assert verdict(folder).score == 5.0
    (folder / "hand-in.zip").write_bytes((folder / "hand-in.zip").read_bytes()[:-40])
    assert "there is 'hand-in.zip'" in asked(verdict(folder))


def test_of_several_files_a_person_says_which_counts(folder: Path) -> None:
    for name, right in {"a.jsonl": 5, "b.jsonl": 2}.items():
        take(folder, "ada", right)
        rename(folder, name)
    assert "there are 'a.jsonl' and 'b.jsonl'" in asked(verdict(folder))


@pytest.mark.parametrize(
    "name",
    ["quiz-ch05.attempts (1).jsonl", "my quiz.txt", "quiz-ch05", "hand-in.tar.gz", "screen.png"],
)
def test_a_file_that_may_hold_attempts_is_asked_about(folder: Path, name: str) -> None:
    (folder / name).write_text("{")
    assert f"there is '{name}'" in asked(verdict(folder))


def test_no_file_at_all_is_no_question(folder: Path) -> None:
    (folder / "quiz.ipynb").write_text("{}")
    (folder / "map.png").write_text("handed out")
    handed_out = folder.parents[2] / "release" / "ch05-quiz" / "map.png"
    handed_out.parent.mkdir(parents=True)
    handed_out.write_text("handed out")
    (folder / "timestamp.txt").write_text("2026-11-27 20:15:05 UTC")
    found = verdict(folder)
    assert (found.score, found.needs_human) == (0.0, False)


def beside(folder: Path, content: str | None, *rights: int) -> Verdict:
    """Return the verdict with the attempts in "... (1).jsonl", and in their place ``content``."""
    name = "quiz-ch05.attempts (1).jsonl"
    take(folder, "ada", *rights)
    rename(folder, name)
    if content is not None:
        (folder / FILE).write_text(content)
    return verdict(folder)


@pytest.mark.parametrize("content", ["", "{\n", "rubbish"])
def test_an_empty_or_damaged_file_in_its_place_is_asked_about_if_there_is_another(
    folder: Path, content: str
) -> None:
    found = beside(folder, content, 5)
    assert "but there is 'quiz-ch05.attempts (1).jsonl'" in asked(found)


@pytest.mark.parametrize("content", ["{\n", "rubbish", '{\n  "quiz": "ch05"\n}\n'])
def test_a_damaged_file_alone_in_its_place_waits_for_a_person(folder: Path, content: str) -> None:
    (folder / FILE).write_text(content)
    assert "holds nothing that can be read as an attempt" in asked(verdict(folder))


def test_a_file_that_cannot_be_read_waits_for_a_person(folder: Path) -> None:
    (folder / FILE).mkdir()
    assert "cannot be read" in asked(verdict(folder))


@pytest.mark.parametrize("kind", ["link", "folder"])
def test_something_else_in_its_place_is_asked_about_if_there_is_another(
    folder: Path, kind: str
) -> None:
    beside(folder, None, 5)
    if kind == "link":
        (folder / FILE).symlink_to("nowhere")
    else:
        (folder / FILE).mkdir()
    assert "but there is 'quiz-ch05.attempts (1).jsonl'" in asked(verdict(folder))


def test_a_poorer_file_in_its_place_is_asked_about_and_counts_until_then(folder: Path) -> None:
    take(folder, "ada", 1, 5)
    whole = (folder / FILE).read_text()
    (folder / "quiz-ch05.attempts (1).jsonl").write_text(whole)
    (folder / FILE).write_text(whole.splitlines(keepends=True)[0])
    found = verdict(folder)
    assert "there is 'quiz-ch05.attempts (1).jsonl', too, with other attempts" in asked(found)
    assert found.score < 5
    claim(folder, "quiz-ch05.attempts (1).jsonl")
    assert (verdict(folder).score, verdict(folder).needs_human) == (5.0, False)


def test_an_earlier_state_of_the_file_is_no_question(folder: Path) -> None:
    take(folder, "ada", 1, 5)
    whole = (folder / FILE).read_text()
    (folder / "quiz-ch05.attempts (1).jsonl").write_text(whole.splitlines(keepends=True)[0])
    (folder / "copy.jsonl").write_text(whole)
    assert (verdict(folder).score, verdict(folder).needs_human) == (5.0, False)
    (folder / FILE).unlink()
    assert (verdict(folder).score, verdict(folder).needs_human) == (5.0, False)


@pytest.mark.parametrize("name", [FILE, "renamed.jsonl"])
def test_a_login_of_somebody_else_in_the_class_is_asked_about(folder: Path, name: str) -> None:
    (folder.parents[1] / "bob").mkdir()
    take(folder, "bob", 5)
    rename(folder, name)
    found = verdict(folder)
    assert found.score == 5.0, "the points stand until a person has looked"
    assert "under the login of 'bob', who is in the class" in asked(found)


def test_the_class_is_whom_the_gradebook_knows_too(folder: Path) -> None:
    take(folder, "bob", 5)
    (folder.parents[1] / "carl").mkdir()
    found = quiz_marks.mark_best_attempt(load_bank("ch05"), folder, "ada", roster=("ada", "bob"))
    assert "under the login of 'bob', who is in the class" in asked(found)


@pytest.mark.parametrize("login", ["jovyan", "ada@laptop"])
def test_a_login_of_nobody_in_the_class_is_only_said(folder: Path, login: str) -> None:
    take(folder, login, 5)
    found = verdict(folder)
    assert (found.score, found.needs_human) == (5.0, False)
    assert any(f"under the login '{login}'" in note for note in found.notes)


def test_a_decomposed_login_is_the_students_own(tmp_path: Path) -> None:
    name = unicodedata.normalize("NFC", "Müller")
    folder = tmp_path / "submitted" / name / "ch05-quiz"
    folder.mkdir(parents=True)
    take(folder, unicodedata.normalize("NFD", name), 5)
    found = verdict(folder, name)
    assert (found.score, found.needs_human) == (5.0, False)
    assert not any("under the login" in note for note in found.notes)


def claim(folder: Path, file: str) -> None:
    state = claim_records.digest_state(folder, look_through(folder), FILE, file)
    claim_records.keep_claim(folder.parents[2], "ch05-quiz", "ada", KEY, Claim(file, state))


def test_what_is_claimed_counts_whoever_made_it(folder: Path) -> None:
    (folder.parents[1] / "bob").mkdir()
    for name, right in {"a.jsonl": 5, "b.jsonl": 2}.items():
        take(folder, "bob", right)
        rename(folder, name)
    claim(folder, "a.jsonl")
    found = verdict(folder)
    assert (found.score, found.needs_human) == (5.0, False)
    assert "as a person has said" in found.notes[0]


def test_that_there_are_none_is_zero_points_for_good(folder: Path) -> None:
    (folder / "my quiz.txt").write_text("{")
    claim(folder, "")
    found = verdict(folder)
    assert (found.score, found.needs_human) == (0.0, False)
    assert "as a person has said" in found.checks[0].actual
