"""The other files of a submission: what its code is given, and what is said of the rest."""

from __future__ import annotations

import os
import subprocess
import unicodedata
from pathlib import Path

import pytest

from autograder.assignments.intake.handed_files import attachments
from autograder.assignments.intake.handed_files.attachments import files_beside
from autograder.running.outcomes import ledger
from autograder.util import work_files


def test_other_files_of_a_submission_are_found_and_links_are_not(tmp_path: Path) -> None:
    (tmp_path / "profiles.py").write_text("depth = 5")
    (tmp_path / "pack").mkdir()
    (tmp_path / "pack" / "more.py").write_text("x = 1")
    (tmp_path / "timestamp.txt").write_text("2026-01-01")
    (tmp_path / ".hidden").write_text("x")
    (tmp_path / "link.py").symlink_to("/etc/hostname")
    (tmp_path / "away").symlink_to("/etc")
    found = files_beside(tmp_path)
    assert found.files == {"pack/more.py": b"x = 1", "profiles.py": b"depth = 5"}
    (note,) = found.notes
    assert "without 'away', 'link.py': a link leads out of the submission." in note


def test_a_decomposed_name_is_found_as_code_names_it(tmp_path: Path) -> None:
    (tmp_path / unicodedata.normalize("NFD", "größe.csv")).write_text("1")
    assert files_beside(tmp_path).files == {unicodedata.normalize("NFC", "größe.csv"): b"1"}


def test_a_name_with_a_line_break_is_said_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "a\n\x1b[31mb").symlink_to("/etc")
    (note,) = files_beside(tmp_path).notes
    assert "without 'a\\n\\x1b[31mb'" in note


def test_what_is_too_large_is_left_out_and_named(tmp_path: Path) -> None:
    (tmp_path / "a.bin").write_bytes(bytes(attachments.MAX_BYTES))
    for number in range(7):
        (tmp_path / f"b{number}.bin").write_bytes(b"x")
    found = files_beside(tmp_path)
    assert list(found.files) == ["a.bin"]
    (note,) = found.notes
    assert "without 'b0.bin', 'b1.bin', 'b2.bin', 'b3.bin', 'b4.bin' and 2 more: " in note
    assert "10 MB together" in note


def test_a_name_that_is_no_text_can_be_said(tmp_path: Path) -> None:
    (tmp_path / os.fsdecode(b"\xff" + b"n" * 200)).symlink_to("/etc")
    (note,) = files_beside(tmp_path).notes
    assert len(note.encode()) < 300


@pytest.mark.parametrize("linked", ["submitted", "submitted/bob"])
def test_other_files_are_found_where_a_folder_above_is_a_link(tmp_path: Path, linked: str) -> None:
    disk = tmp_path / "another-disk"
    place = tmp_path / linked
    place.parent.mkdir(exist_ok=True)
    place.symlink_to(disk)
    folder = tmp_path / "submitted" / "bob" / "ch05"
    disk.mkdir()
    folder.mkdir(parents=True)
    (folder / "profiles.py").write_text("depth = 5")
    assert files_beside(folder).files == {"profiles.py": b"depth = 5"}


def test_of_very_many_files_the_upper_ones_are_taken(tmp_path: Path) -> None:
    (tmp_path / "profiles.py").write_text("depth = 5")
    deep = tmp_path / "many"
    deep.mkdir()
    for number in range(work_files.MAX_FILES):
        (deep / f"{number:05}.py").touch()
    found = files_beside(tmp_path)
    assert len(found.files) == work_files.MAX_FILES
    assert "profiles.py" in found.files
    assert f"more than {work_files.MAX_FILES} files" in found.notes[0]


def nested(folder: Path, depth: int, name: str) -> None:
    """Make a file under so many folders: more than a path can name."""
    handle = os.open(folder, os.O_RDONLY)
    for _ in range(depth):
        os.mkdir("d", dir_fd=handle)
        below = os.open("d", os.O_RDONLY, dir_fd=handle)
        os.close(handle)
        handle = below
    os.close(os.open(name, os.O_CREAT | os.O_WRONLY, dir_fd=handle))
    os.close(handle)


@pytest.mark.parametrize("depth", [3, 1000, 3000])
def test_folders_within_folders_are_looked_through_up_to_a_depth(
    tmp_path: Path, depth: int
) -> None:
    nested(tmp_path, depth, "deep.py")
    assert len(files_beside(tmp_path).files) == (1 if depth == 3 else 0)
    assert ledger.of_folder(tmp_path)
    subprocess.run(["rm", "-rf", tmp_path / "d"], check=True)  # pytest's own way is recursive
