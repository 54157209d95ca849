"""Files that are replaced whole."""

from __future__ import annotations

from pathlib import Path

import pytest

from course.util.files import replace_file, write_text


def test_a_file_that_cannot_be_finished_leaves_the_old_one(tmp_path: Path) -> None:
    path = tmp_path / "notes.txt"
    write_text(path, "old\n")

    def write_half() -> None:
        with replace_file(path) as file:
            file.write(b"half of the n")
            file.write("\ud800".encode())

    with pytest.raises(UnicodeEncodeError):
        write_half()
    assert path.read_text() == "old\n"
    assert [entry.name for entry in tmp_path.iterdir()] == ["notes.txt"]


def test_everyone_may_read_what_is_written(tmp_path: Path) -> None:
    path = tmp_path / ("n" * 250)
    write_text(path, "Zürich\r\n")
    assert path.read_bytes() == "Zürich\r\n".encode()
    assert path.stat().st_mode & 0o777 == 0o644


def test_a_folder_that_is_not_there_is_an_error_of_the_system(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        write_text(tmp_path / "none" / "file", "")
