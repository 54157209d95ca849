"""Folders of students that are not what they should be: known before anything is run."""

from __future__ import annotations

import os
import unicodedata
from pathlib import Path

import pytest

from autograder.assignments.intake import claim_records, roster
from autograder.assignments.intake.claim_records import Claim
from autograder.assignments.intake.roster import Roster
from autograder.gradebook.waiting_extensions import WaitingExtensions


@pytest.fixture
def submitted(tmp_path: Path) -> Path:
    (tmp_path / "submitted" / "alice" / "ch05").mkdir(parents=True)
    return tmp_path / "submitted"


def found(submitted: Path) -> tuple[list[str], dict[str, str]]:
    return roster.find_submissions(submitted.parent, "ch05", Roster())


def test_a_link_to_what_another_student_handed_in_is_refused(submitted: Path) -> None:
    (submitted / "bob").mkdir()
    (submitted / "bob" / "ch05").symlink_to("../alice/ch05")
    (submitted / "carol").symlink_to("alice")
    good, wrong = found(submitted)
    assert good == ["alice"]
    assert "leads out of the student's own folder" in wrong["bob"]
    assert "a link to what another student handed in" in wrong["carol"]


def test_links_that_an_instructor_makes_are_followed(submitted: Path, tmp_path: Path) -> None:
    disk = tmp_path / "another-disk"
    (disk / "dora" / "ch05").mkdir(parents=True)
    (submitted / "dora").symlink_to(disk / "dora")
    (submitted / "emil" / "late").mkdir(parents=True)
    (submitted / "emil" / "ch05").symlink_to("late")
    submitted.rename(tmp_path / "elsewhere")
    submitted.symlink_to(tmp_path / "elsewhere")
    assert found(submitted) == (["alice", "dora", "emil"], {})


@pytest.mark.parametrize(
    "place",
    ["Ch05/qos-design.ipynb", "ch05 (1)/work/qos-design.ipynb", "hand-in.zip", "qos-design.ipynb",
     "report.pdf"],
)  # fmt: skip
def test_what_lies_in_no_assignments_folder_is_asked_about(submitted: Path, place: str) -> None:
    for other in ("ch05-quiz", "ch04"):
        (submitted / "bob" / other).mkdir(parents=True)
    (submitted.parent / "source" / "ch05-quiz").mkdir(parents=True)
    (submitted / "bob" / "ch04" / "exercise.ipynb").write_text("{}")
    (submitted / "bob" / place).parent.mkdir(parents=True, exist_ok=True)
    (submitted / "bob" / place).write_text("x")
    good, wrong = roster.find_submissions(submitted.parent, "ch05", Roster(), ["ch04", "ch05"])
    assert good == ["alice"]
    name = place.partition("/")[0]
    assert wrong == {
        "bob": f"There is no submitted/bob/ch05, but there is '{name}' in submitted/bob: move it "
        "to submitted/bob/ch05 if that is this assignment's work, or out of submitted/bob if not; "
        "then grade again."
    }


def test_a_notebook_in_no_students_folder_is_asked_about(submitted: Path) -> None:
    (submitted / "qos-design.ipynb").write_text("{}")
    (submitted / "archive-of-moodle.zip").write_text("x")
    good, wrong = found(submitted)
    assert good == ["alice"]
    assert wrong == {
        "qos-design.ipynb": "submitted/qos-design.ipynb is in no student's folder: move it to "
        "submitted/STUDENT/ch05 if somebody handed it in, or out of submitted if not; then grade "
        "again."
    }


def test_who_has_handed_in_other_assignments_alone_is_not_asked_about(submitted: Path) -> None:
    for place in ("ch04/exercise.ipynb", "ch06/exercise.ipynb", ".DS_Store", "timestamp.txt"):
        (submitted / "bob" / place).parent.mkdir(parents=True, exist_ok=True)
        (submitted / "bob" / place).write_text("x")
    (submitted / "bob" / "Ch05").mkdir()
    (submitted / "__MACOSX" / "Ch05").mkdir(parents=True)
    (submitted / "__MACOSX" / "Ch05" / "exercise.ipynb").write_text("x")
    (submitted.parent / "release" / "ch06").mkdir(parents=True)
    assert roster.find_submissions(submitted.parent, "ch05", Roster(), ["ch04"]) == (["alice"], {})


@pytest.mark.parametrize("kind", ["pipe", "huge", "link", "folder", "no date"])
def test_a_time_stamp_that_is_none_is_not_waited_for(tmp_path: Path, kind: str) -> None:
    file = tmp_path / "timestamp.txt"
    if kind == "pipe":
        os.mkfifo(file)
    elif kind == "huge":
        file.write_text("2026-01-01 12:00:00" + " " * 1000)
    elif kind == "link":
        (tmp_path / "another").write_text("2026-01-01 12:00:00")
        file.symlink_to(tmp_path / "another")
    elif kind == "folder":
        file.mkdir()
    else:
        file.write_text("yesterday")
    assert roster.read_timestamp(file) is None
    assert roster.remarks(tmp_path) == [
        "timestamp.txt holds no date, so the time of submission is unknown."
    ]


def test_a_time_stamp_is_read(tmp_path: Path) -> None:
    assert roster.remarks(tmp_path) == []
    (tmp_path / "timestamp.txt").write_text("2026-01-01 12:00:00 UTC\n")
    assert roster.read_timestamp(tmp_path / "timestamp.txt") == "2026-01-01 12:00:00.000000 UTC"
    assert roster.remarks(tmp_path) == []


@pytest.mark.parametrize("text", ["2026-01-01 12:00 CST", "01/02/2026 12:00"])
def test_a_time_stamp_that_can_be_several_is_asked_about(tmp_path: Path, text: str) -> None:
    (tmp_path / "timestamp.txt").write_text(text)
    assert roster.read_timestamp(tmp_path / "timestamp.txt") is None
    (said,) = roster.remarks(tmp_path)
    assert "timestamp.txt is not clear" in said
    assert "nothing is taken off for lateness" in said


def test_the_courses_zone_makes_a_time_stamp_clear(tmp_path: Path) -> None:
    (tmp_path / "timestamp.txt").write_text("2026-01-01 12:00 CST")
    file, zone = tmp_path / "timestamp.txt", "America/Chicago"
    assert roster.read_timestamp(file, zone) == "2026-01-01 18:00:00.000000 UTC"
    assert roster.remarks(tmp_path, zone) == []


MUELLER = unicodedata.normalize("NFC", "Müller")


def test_a_decomposed_folder_name_is_the_student_of_the_roster(submitted: Path) -> None:
    (submitted / unicodedata.normalize("NFD", MUELLER) / "ch05").mkdir(parents=True)
    root = submitted.parent
    for people in (Roster(), Roster(frozenset({"alice", MUELLER}), closed=True)):
        assert roster.find_submissions(root, "ch05", people) == ([MUELLER, "alice"], {})
    assert (roster.student_folder(root, MUELLER) / "ch05").is_dir()


def test_an_extension_that_an_earlier_version_kept_in_a_file_still_waits(tmp_path: Path) -> None:
    (tmp_path / "extensions").mkdir()
    (tmp_path / "extensions" / "ch05.json").write_text('{"ada": 24.0}')
    assert WaitingExtensions(tmp_path, "ch05").hours_for("ada") == 24.0
    WaitingExtensions(tmp_path, "ch05").set_hours("ada", 0)
    assert WaitingExtensions(tmp_path, "ch05").hours_for("ada") == 0


@pytest.mark.parametrize(("kept", "asked"), [("NFC", "NFD"), ("NFD", "NFC")])
def test_what_waits_for_a_student_is_found_in_either_form_of_the_name(
    tmp_path: Path, kept: str, asked: str
) -> None:
    kept, asked = unicodedata.normalize(kept, MUELLER), unicodedata.normalize(asked, MUELLER)
    waiting = WaitingExtensions(tmp_path, "ch05")
    waiting.set_hours(kept, 2.0)
    assert waiting.hours_for(asked) == 2.0
    waiting.set_hours(asked, 0)
    assert waiting.hours_for(kept) == 0
    claim = Claim("a.ipynb", "state")
    claim_records.keep_claim(tmp_path, "ch05", kept, "qos", claim)
    assert claim_records.of_student(tmp_path, "ch05", asked) == {"qos": claim}


def test_two_folders_whose_names_read_the_same_are_two(submitted: Path) -> None:
    for form in ("NFC", "NFD"):
        (submitted / unicodedata.normalize(form, MUELLER) / "ch05").mkdir(parents=True)
    good, wrong = found(submitted)
    assert good == ["alice"]
    assert len(wrong) == 2
    assert all("two folders whose names read 'Müller'" in problem for problem in wrong.values())
