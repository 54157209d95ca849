"""Hand-ins in a zip file of Moodle's or Canvas's: whose they are, and what of them is taken."""

from __future__ import annotations

import io
import json
import stat
import struct
import zipfile
from collections.abc import Mapping
from pathlib import Path

import nbformat
import pytest
from nbgrader.api import Gradebook

from autograder.assignments.intake.handed_files.download_names import parse_canvas, parse_moodle
from autograder.corpus import Case
from autograder.gradebook.collecting import platform_zip
from autograder.gradebook.collecting.collect_zip import CollectedZip, collect_zip
from autograder.gradebook.collecting.placing import kept_folder
from autograder.gradebook.collecting.platform_zip import DownloadError
from autograder.gradebook.course_gradebook import CourseGradebook
from autograder.grading import engine
from autograder.grading.engine import BusyError
from tests.autograder.commands.test_cli import autograder
from tests.autograder.conftest import ASSIGNMENT, NOTEBOOK, Course
from tests.machine import needs_isolation

FILE = f"{NOTEBOOK}.ipynb"
PEOPLE = {
    "ada": ("Ada", "Lovelace", "1001"), "ann": ("Ann", "O'Hara", ""), "bob": ("Bob", "Bee", ""),
    "bo2": ("Bob", "Bee", "1004"), "grace": ("Grace Brewster", "Hopper", ""),
    "jürgen": ("Jürgen-Peter", "Groß", ""),
}  # fmt: skip


@pytest.fixture
def named(course: Course) -> Course:
    """A course that knows its students by name."""
    with Gradebook(f"sqlite:///{course.root / 'gradebook.db'}") as book:
        for student, (first, last, number) in PEOPLE.items():
            book.add_student(
                student, first_name=first, last_name=last, lms_user_id=number or None,
                email=f"{student}@example.org",
            )  # fmt: skip
    return course


def pack(path: Path, files: Mapping[str, bytes | str]) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return path


def collect(
    course: Course, path: Path, assignment: str = "", said: Mapping[str, str] | None = None
) -> CollectedZip:
    return collect_zip(
        CourseGradebook(course.root), path, assignment, said or {},
        lambda: engine.lock_course(course.root),
    )  # fmt: skip


def files(course: Course, student: str) -> dict[str, str]:
    folder = course.root / "submitted" / student / ASSIGNMENT
    return {
        path.relative_to(folder).as_posix(): path.read_text()
        for path in folder.rglob("*") if path.is_file()
    }  # fmt: skip


def test_the_names_of_both_platforms_are_taken_apart() -> None:
    for name, place in {
        "Ada Lovelace_12_assignsubmission_file/work/a.ipynb": "work/a.ipynb",
        "Ada Lovelace_12_assignsubmission_file_/a_b.ipynb": "a_b.ipynb",
        "Ada Lovelace_12_assignsubmission_file_a_b.ipynb": "a_b.ipynb",
        "course-quiz-17/Ada Lovelace_12_assignsubmission_file/a.ipynb": "a.ipynb",
        "Ada Lovelace_12_assignsubmission_file/Bob Bee_13_assignsubmission_file/a.ipynb":
            "Bob Bee_13_assignsubmission_file/a.ipynb",
    }.items():  # fmt: skip
        found = parse_moodle(name)
        assert found is not None, name
        assert (found.who, found.number, found.place) == ("Ada Lovelace", "12", place)
    for name, said in {
        "lovelaceada_12_345_a_b.ipynb": ("lovelaceada", "12", "a_b.ipynb", False),
        "lovelaceada_LATE_12_345_a-1.ipynb": ("lovelaceada", "12", "a-1.ipynb", True),
        "r2_d2_12_345_7_8_a.ipynb": ("r2_d2", "12", "7_8_a.ipynb", False),
        "anon_x7Yz1_345_a.ipynb": ("", "x7Yz1", "a.ipynb", False),
        "LATE_anon_x7Yz1_345_a.ipynb": ("", "x7Yz1", "a.ipynb", True),
    }.items():
        parts = parse_canvas(name)
        assert parts is not None, name
        assert (parts.who, parts.number, parts.place, parts.late) == said
    for name in ("a.ipynb", "ada/a.ipynb", "lovelaceada_12_text.html", "Ada_file_a.ipynb"):
        assert parse_moodle(name) is None
        assert parse_canvas(name) is None


@pytest.mark.parametrize("form", ["{}/{}", "{}_/{}", "{}_{}", "all of them/{}/{}"])
def test_what_moodle_packs_is_collected(named: Course, tmp_path: Path, form: str) -> None:
    def of(who: str, name: str) -> str:
        return form.format(f"{who}_assignsubmission_file", name)

    done = collect(named, pack(tmp_path / "moodle.zip", {
        of("Ada Lovelace_12", FILE): "ada's", of("Ada Lovelace_12", "plot.png"): "a plot",
        of("Ann OHara_13", "my work.ipynb"): "ann's",  # Moodle takes the apostrophe out
        of("Team 7-Hopper Grace Brewster_14", FILE): "grace's",
        of("Ju\u0308rgen-Peter Groß_15", FILE): "jürgen's",
        "Ada Lovelace_12_assignsubmission_onlinetext/onlinetext.html": "typed",
        of("Ada Lovelace_12", "timestamp.txt"): "2020-01-01 12:00 UTC",
        "__MACOSX/" + of("Ada Lovelace_12", FILE): "junk",
    }))  # fmt: skip
    assert (done.platform, done.assignment, done.problems) == ("Moodle", ASSIGNMENT, ())
    assert done.collected == ("ada", "ann", "grace", "jürgen")
    assert files(named, "ada") == {FILE: "ada's", "plot.png": "a plot"}
    assert files(named, "ann") == {"my work.ipynb": "ann's"}
    assert files(named, "jürgen") == {FILE: "jürgen's"}
    [left_out] = done.remarks
    assert "onlinetext.html" in left_out
    assert "timestamp" not in left_out


def test_what_canvas_packs_is_collected(named: Course, tmp_path: Path) -> None:
    done = collect(named, pack(tmp_path / "canvas.zip", {
        f"whoevershesays_LATE_1001_901_{NOTEBOOK}-2.ipynb": "ada's",  # by the gradebook's number
        f"oharaann_1002_902_{FILE}": "ann's", "oharaann_1002_903_map-3.png": "a map",
        f"beebob_1004_904_{FILE}": "bo2's",
        f"hoppergracebrewster_1005_905_{FILE}": "first",
        f"hoppergracebrewster_1005_906_{NOTEBOOK}-1.ipynb": "second",
        "großjürgenpeter_1006_text.html": "typed",
    }))  # fmt: skip
    assert (done.platform, done.assignment, done.problems) == ("Canvas", ASSIGNMENT, ())
    assert done.collected == ("ada", "ann", "bo2", "grace")
    assert files(named, "ada") == {FILE: "ada's"}
    assert files(named, "ann") == {FILE: "ann's", "map-3.png": "a map"}
    assert files(named, "grace") == {FILE: "first", f"{NOTEBOOK}-1.ipynb": "second"}
    left_out, late = done.remarks
    assert "großjürgenpeter_1006_text.html" in left_out
    assert late.startswith("Late, says Canvas: ada. It does not say how much")


def test_a_name_that_fits_nobody_or_two_is_said_and_the_rest_is_collected(
    named: Course, tmp_path: Path
) -> None:
    path = pack(tmp_path / "moodle.zip", {
        f"Bob Bee_13_assignsubmission_file/{FILE}": "whose?",
        f"Ada Lovlace_14_assignsubmission_file/{FILE}": "misspelt",
        f"Participant_15_assignsubmission_file/{FILE}": "hidden",
        f"Ann O'Hara_16_assignsubmission_file/{FILE}": "one",
        f"Ann O'Hara_17_assignsubmission_file/{FILE}": "another",
        f"Grace Brewster Hopper_18_assignsubmission_file/{FILE}": "grace's",
    })  # fmt: skip
    done = collect(named, path)
    assert done.collected == ("grace",)
    again = "and run the same command again."
    assert done.problems == (
        f"'Bob Bee' (13) fits bo2 and bob: say who it is with --who 13=STUDENT, {again}",
        "'Ada Lovlace' (14) fits nobody in the gradebook (is it 'Ada Lovelace'?): add the student, "
        f"or say who it is with --who 14=STUDENT, {again}",
        "'Participant' (15) fits nobody in the gradebook: add the student, or say who it is with "
        f"--who 15=STUDENT, {again}",
        "'Ann O'Hara' (16) and 'Ann O'Hara' (17) fit ann: say who is who with --who 16=STUDENT "
        f"--who 17=STUDENT, {again}",
    )
    said = {"13": "bob", "14": "ada", "16": "ann", "17": "jürgen"}
    done = collect(named, path, said=said)
    assert done.collected == ("ada", "ann", "bob", "jürgen")
    assert done.unchanged == ("grace",)
    assert files(named, "jürgen") == {FILE: "another"}
    assert len(done.problems) == 1
    with pytest.raises(DownloadError, match=r"no student 'adda' \(is it 'ada'\?\)"):
        collect(named, path, said={"13": "adda"})


def test_what_lies_there_is_replaced_by_other_work_only_and_kept(
    named: Course, tmp_path: Path
) -> None:
    named.submit("ada", "old")
    (named.folder("ada") / "timestamp.txt").write_text("2026-01-01 12:00:00 UTC")
    of_ada = f"Ada Lovelace_12_assignsubmission_file/{FILE}"
    done = collect(named, pack(tmp_path / "same.zip", {of_ada: "old"}))
    assert (done.collected, done.unchanged) == ((), ("ada",))
    assert "timestamp.txt" in files(named, "ada"), "what came through the exchange stays"
    done = collect(named, pack(tmp_path / "new.zip", {of_ada: "new"}))
    assert (done.collected, done.replaced, done.unchanged) == (("ada",), ("ada",), ())
    assert files(named, "ada") == {FILE: "new"}
    assert (kept_folder(named.folder("ada")) / FILE).read_text() == "old"


def test_nothing_leads_out_of_the_folder(named: Course, tmp_path: Path) -> None:
    link = zipfile.ZipInfo("Ada Lovelace_12_assignsubmission_file/secret.png")
    link.external_attr = (stat.S_IFLNK | 0o777) << 16
    with zipfile.ZipFile(tmp_path / "moodle.zip", "w") as archive:
        start = "Ada Lovelace_12_assignsubmission_file"
        archive.writestr(f"{start}/{FILE}", "ada's")
        out = (f"../../bob/{ASSIGNMENT}/{FILE}", "/etc/x", "a/../../x", "a\\..\\x", "x" * 256)
        for place in (*out, "/".join("a" * 30)):
            archive.writestr(f"{start}/{place}", "mallory's")
        archive.writestr(link, "/etc/passwd")
    done = collect(named, tmp_path / "moodle.zip")
    assert done.collected == ("ada",)
    assert files(named, "ada") == {FILE: "ada's"}
    assert not (named.root / "submitted" / "bob").exists()
    [left_out] = done.remarks
    assert "secret.png" in left_out


def test_one_hand_in_that_cannot_be_taken_is_said_and_the_rest_is_collected(
    named: Course, tmp_path: Path
) -> None:
    def of(who: str) -> str:
        return f"{who}_assignsubmission_file/{FILE}"

    path = pack(tmp_path / "moodle.zip", {
        of("Ada Lovelace_12"): b"\0" * 110_000_000,  # 100 kB as it is packed
        of("Ann O'Hara_13"): "damaged", of("Grace Brewster Hopper_14"): "grace's",
        f"Jürgen-Peter Groß_15_assignsubmission_file/{FILE}/a": "a folder",
        of("Jürgen-Peter Groß_15"): "a file",
    })  # fmt: skip
    content = path.read_bytes()
    with zipfile.ZipFile(path) as archive:
        at = archive.getinfo(of("Ann O'Hara_13")).header_offset + 30 + len(of("Ann O'Hara_13"))
    path.write_bytes(content[:at] + b"\xff" * 4 + content[at + 4 :])
    done = collect(named, path)
    assert done.collected == ("grace",)
    bomb, damaged, both = done.problems
    assert bomb == (
        f"'Ada Lovelace' (12) is not collected: {FILE} has 110 MB unpacked, more than the 100 MB "
        "that nbgrader takes (CourseDirectory.max_file_size)."
    )
    assert damaged.startswith(f"'Ann O'Hara' (13) is not collected: {FILE} is damaged (")
    assert both.endswith(f"{FILE} is a file and a folder in it.")
    assert not (named.root / "submitted" / "ada").exists()
    assert not list((named.root / ".autograder").glob("collected/*"))


def test_a_file_that_nothing_can_be_collected_from_is_one_sentence(
    named: Course, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "none.zip"
    with pytest.raises(DownloadError, match=r"none.zip cannot be read \(No such file"):
        collect(named, path)
    path.write_bytes(b"no zip file")
    with pytest.raises(DownloadError, match="is no zip file, or a damaged one"):
        collect(named, path)
    with pytest.raises(DownloadError, match=r"no names of Moodle's .* and none of Canvas's"):
        collect(named, pack(path, {FILE: "{}", "ada/work.ipynb": "{}"}))
    ada = pack(path, {"Ada Lovelace_12_assignsubmission_file/a.ipynb": "x" * 1000})
    with monkeypatch.context() as small:
        small.setattr(platform_zip, "MAX_UNPACKED_BYTES", 999)
        with pytest.raises(DownloadError, match=r"would unpack to .* nothing of it is collected"):
            collect(named, ada)
    with monkeypatch.context() as few:
        few.setattr(platform_zip, "MAX_MEMBERS", 0)
        with pytest.raises(DownloadError, match="has more than 0 files"):
            collect(named, ada)
    content = bytearray(ada.read_bytes())
    at = content.rfind(b"PK\x05\x06")
    content[at + 10 : at + 16] = struct.pack("<HI", 1, 2**31)  # a table of 2 GB, it says
    path.write_bytes(content)
    with pytest.raises(DownloadError, match="has more than 100000 files"):
        collect(named, path)
    assert not (named.root / "submitted").exists()


def test_an_archive_as_moodle_writes_it_with_long_sizes_is_read(
    named: Course, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(zipfile, "ZIP_FILECOUNT_LIMIT", 0)  # then its end is that of Zip64
    path = pack(tmp_path / "moodle.zip", {f"Ada Lovelace_1_assignsubmission_file/{FILE}": "x"})
    assert b"PK\x06\x06" in path.read_bytes()
    assert collect(named, path).collected == ("ada",)


def test_a_gradebook_without_students_and_a_course_at_work_are_one_sentence_each(
    course: Course, tmp_path: Path
) -> None:
    path = pack(tmp_path / "moodle.zip", {f"Ada Lovelace_1_assignsubmission_file/{FILE}": "x"})
    with pytest.raises(DownloadError, match=r"has no students yet.*nbgrader db student import"):
        collect(course, path)
    with Gradebook(f"sqlite:///{course.root / 'gradebook.db'}") as book:
        book.add_student("ada", first_name="Ada", last_name="Lovelace")
    with engine.lock_course(course.root), pytest.raises(BusyError):
        collect(course, path)
    with pytest.raises(DownloadError, match="There is no released assignment 'ch5' "):
        collect(course, path, "ch5")


@needs_isolation
def test_the_command_collects_and_what_it_collected_is_graded(
    named: Course, cases: dict[str, Case], tmp_path: Path
) -> None:
    handed_in = cases["right-chapter"].make_submission(named.source, named.released)
    text = io.StringIO()
    nbformat.write(handed_in, text)
    path = pack(tmp_path / "canvas.zip", {
        f"lovelaceada_1001_901_{FILE}": text.getvalue(), f"beebob_7_902_{FILE}": text.getvalue(),
    })  # fmt: skip
    done = autograder("collect", str(path), "--root", str(named.root), cwd=tmp_path, code=1)
    assert "'beebob' (7) fits bo2 and bob: say who it is with --who 7=STUDENT" in done.stdout
    assert "ch05: 1 submission collected (0 in place of an earlier one), 0 as before" in done.stdout
    done = autograder(
        "collect", str(path), "--who", "7=bob", "--root", str(named.root), "--json", cwd=tmp_path
    )
    assert json.loads(done.stdout)["collected"] == ["bob"]
    graded = {one.student: one.points for one in engine.grade(named.root, ASSIGNMENT)}
    assert graded["ada"] == graded["bob"] > 10
