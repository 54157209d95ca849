"""Feedback on its way back through Moodle and Canvas: under the names that these take it by."""

from __future__ import annotations

import csv
import io
import re
import shutil
import zipfile
from collections.abc import Mapping
from pathlib import Path

import nbformat
import pytest

from autograder.class_report.class_data import Person
from autograder.class_report.platforms import feedback_archive, platform_names
from autograder.class_report.platforms.platform_names import NamesError
from tests.autograder.commands.test_cli import autograder
from tests.autograder.conftest import ASSIGNMENT, NOTEBOOK

pytestmark = pytest.mark.xdist_group("graded class")


def archive(path: Path, members: Mapping[str, bytes]) -> Path:
    with zipfile.ZipFile(path, "w") as file:
        for name, content in members.items():
            file.writestr(name, content)
    return path


def packed(*members: tuple[str, bytes]) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as file:
        for name, content in members:
            file.writestr(name, content)
    return buffer.getvalue()


def handed_in(root: Path, student: str) -> bytes:
    return (root / "submitted" / student / ASSIGNMENT / f"{NOTEBOOK}.ipynb").read_bytes()


def moodles_participant(name: str) -> tuple[str, str] | None:
    """Return (number, file name) as Moodle's import reads a path; None if it passes it over."""
    parts = name.split("/")
    while parts:
        info = parts.pop(0).split("_", 4)
        if len(info) < 5 or not info[1].isdecimal():
            continue
        assert (info[2], info[3]) == ("assignsubmission", "file")
        return info[1], "/".join([info[4], *parts])
    return None


def canvas_numbers(name: str) -> list[str]:
    """Return the numbers by which Canvas's import finds the user and what they handed in."""
    return [part for part in name.split("_") if re.fullmatch(r"\d+", part)][:2]


def test_moodle_gets_each_students_pages_in_the_folder_that_it_made(
    graded: Path, tmp_path: Path
) -> None:
    names = archive(tmp_path / "download.zip", {
        # By the content, whatever the name; as an archive in the archive; by the name alone.
        f"Somebody Else_101_assignsubmission_file/{NOTEBOOK}.ipynb": handed_in(graded, "eve"),
        "Annie_102_assignsubmission_file_/work.zip": packed(
            (f"{NOTEBOOK}.ipynb", handed_in(graded, "ann"))
        ),
        "bob <b>bee_103_assignsubmission_file/later.ipynb": b"{}",
        "Un Known_104_assignsubmission_file/x.ipynb": b"{}",
        "Zoe Zest_105_assignsubmission_onlinetext/onlinetext.html": b"",
    })  # fmt: skip
    done = feedback_archive.pack_feedback(
        graded, ASSIGNMENT, "moodle", names, tmp_path / "new" / "out.zip"
    )
    with zipfile.ZipFile(done.path) as file:
        found = {member: moodles_participant(member) for member in file.namelist()}
        for student, number in {"eve": "101", "ann": "102", "bob": "103"}.items():
            for page in ("index.html", f"{NOTEBOOK}.html"):
                [member] = [m for m, where in found.items() if where == (number, f"/{page}")]
                theirs = graded / "feedback" / student / ASSIGNMENT / page
                assert file.read(member) == theirs.read_bytes()
        assert len(found) == 6
    assert done.students == ("ann", "bob", "eve")
    assert set(done.left_out["not found in download.zip"]) == {"-dan", "cy"}
    assert done.left_out["in download.zip, but not known here"] == (
        "Un Known_104_assignsubmission_file_",
    )


def test_moodles_grading_worksheet_is_enough(graded: Path, tmp_path: Path) -> None:
    sheet = tmp_path / "grades.csv"
    with sheet.open("w", encoding="utf-8-sig", newline="") as file:
        csv.writer(file).writerows([
            ["Bezeichner", "Vollständiger Name", "E-Mail-Adresse", "Status", "Bewertung"],
            ["Teilnehmer/in 201", "Ann O'Hara", "", "Zur Bewertung abgegeben", ""],
            ["Teilnehmer/in 202", "Cy_Young", "cy", "Zur Bewertung abgegeben", ""],
        ])  # fmt: skip
    done = feedback_archive.pack_feedback(graded, ASSIGNMENT, "moodle", sheet, tmp_path / "out.zip")
    assert done.students == ("ann", "cy")
    with zipfile.ZipFile(done.path) as file:
        numbers = {found[0] for name in file.namelist() if (found := moodles_participant(name))}
    assert numbers == {"201", "202"}


def test_canvas_gets_files_under_the_names_that_it_gave_with_what_the_names_say(
    graded: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "submissions"
    folder.mkdir()
    (folder / f"oharaann_LATE_11_901_{NOTEBOOK}-2.ipynb").write_bytes(handed_in(graded, "ann"))
    (folder / "beebob_12_902_everything.zip").write_bytes(
        packed((f"x/{NOTEBOOK}.ipynb", handed_in(graded, "bob") + b"\n"),
               (f"{NOTEBOOK}.ipynb", handed_in(graded, "eve")))
    )  # fmt: skip
    (folder / "strange_13_903_notes.txt").write_bytes(b"who?")
    done = feedback_archive.pack_feedback(
        graded, ASSIGNMENT, "canvas", folder, tmp_path / "out.zip"
    )
    assert done.students == ("ann", "eve")
    with zipfile.ZipFile(done.path) as file:
        assert set(file.namelist()) == {f"oharaann_LATE_11_901_{NOTEBOOK}-2.ipynb",
                                        "beebob_12_902_everything.zip"}  # fmt: skip
        assert [canvas_numbers(name) for name in file.namelist()] == [["11", "901"], ["12", "902"]]
        with zipfile.ZipFile(io.BytesIO(file.read("beebob_12_902_everything.zip"))) as inner:
            assert set(inner.namelist()) == {"index.html", f"{NOTEBOOK}.html"}
        notebook = nbformat.reads(file.read(f"oharaann_LATE_11_901_{NOTEBOOK}-2.ipynb").decode(), 4)
    nbformat.validate(notebook)
    text = "\n".join(cell.source for cell in notebook.cells)
    assert "17.5 of 20 points." in notebook.cells[0].source
    assert "Handed in 2 hours 5 minutes late" in notebook.cells[0].source
    assert "**A lost camera frame: 1.25 of 2.5 points**" in text
    assert "HIDDEN TESTS" not in text
    assert 'part="hidden"' not in text
    assert not any("nbgrader" in cell.metadata for cell in notebook.cells)


def test_canvas_gets_feedback_on_what_was_taken_whatever_its_name(
    graded: Path, tmp_path: Path
) -> None:
    names = {"ann": "my work.ipynb", "bob": "work.json", "cy": "broken.ipynb"}
    folder = tmp_path / "submissions"
    folder.mkdir()
    for number, (student, name) in enumerate(names.items(), 11):
        own = graded / "submitted" / student / ASSIGNMENT
        (own / f"{NOTEBOOK}.ipynb").rename(own / name)
        shutil.copyfile(own / name, folder / f"{student}_{number}_9{number}_{name}")
    (graded / "submitted" / "cy" / ASSIGNMENT / "other.ipynb").write_text("{}")
    (folder / "cy_13_914_other.ipynb").write_text("{}")
    done = feedback_archive.pack_feedback(
        graded, ASSIGNMENT, "canvas", folder, tmp_path / "out.zip"
    )
    assert done.students == ("ann", "bob", "cy")
    with zipfile.ZipFile(done.path) as file:
        assert set(file.namelist()) == {
            "ann_11_911_my work.ipynb", "bob_12_912_work.json", "cy_13_913_broken.ipynb",
        }  # fmt: skip
        for name in file.namelist():
            notebook = nbformat.reads(file.read(name).decode(), 4)
            assert "QoS profile design: feedback" in notebook.cells[0].source


def test_a_number_of_the_platform_or_an_address_says_who_it_is() -> None:
    people = {
        "ann": Person("ann", "Ann", "Ö", "ann@example.org", "11"),
        "bob": Person("bob", "Bob", "Bee"), "bo2": Person("bo2", "Bob", "Bee"),
    }  # fmt: skip
    participant = platform_names.Participant
    found = platform_names.match_participants(
        [participant("11", "", frozenset({"11"})), participant("9", "b", frozenset({"bob bee"}))],
        people, {},
    )  # fmt: skip
    assert {student: p.number for student, p in found.who.items()} == {"ann": "11"}
    assert found.unknown == ("b",), "two have this name"
    decomposed = participant("1", "x", frozenset({platform_names._comparable_name("ANN  O\u0308")}))
    assert set(platform_names.match_participants([decomposed], people, {}).who) == {"ann"}


def test_files_that_two_have_handed_in_alike_say_nothing(tmp_path: Path) -> None:
    same = tmp_path / "same.ipynb"
    same.write_bytes(b"{}")
    download = archive(tmp_path / "d.zip", {"X Y_1_assignsubmission_file/a.ipynb": b"{}"})
    participants = platform_names.of_moodle(download)
    assert not platform_names.match_participants(participants, {}, {"a": [same], "b": [same]}).who
    assert set(platform_names.match_participants(participants, {}, {"a": [same]}).who) == {"a"}


@pytest.mark.parametrize("platform", ["moodle", "canvas"])
def test_a_download_of_something_else_is_one_sentence(tmp_path: Path, platform: str) -> None:
    read = {"moodle": platform_names.of_moodle, "canvas": platform_names.of_canvas}[platform]
    with pytest.raises(NamesError, match=f"names of {platform.capitalize()}'s"):
        read(archive(tmp_path / "d.zip", {"ann/work.ipynb": b"{}"}))
    (tmp_path / "e.zip").write_bytes(b"PK no archive")
    for path in (tmp_path / "e.zip", tmp_path / "none.zip"):
        with pytest.raises(NamesError, match="cannot be read as a zip archive or folder"):
            read(path)


def test_the_command_says_where_it_is_and_who_is_not_in_it(graded: Path, tmp_path: Path) -> None:
    names = archive(
        tmp_path / "d.zip", {"Ann O'Hara_1_assignsubmission_file/x.ipynb": handed_in(graded, "ann")}
    )
    said = autograder("feedback", ASSIGNMENT, "--platform", "moodle", "--names", str(names),
                      "--root", str(graded), cwd=graded).stdout  # fmt: skip
    assert "Feedback for 1 student:" in said
    assert "Not in it, not found in d.zip" in said
    assert (graded / "reports" / ASSIGNMENT / "feedback-moodle.zip").is_file()
