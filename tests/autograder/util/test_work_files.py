"""Files that are whole or not there, and what killed processes leave behind."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from autograder.util import work_files


@pytest.fixture(autouse=True)
def scratch(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def test_what_is_written_is_whole_and_for_its_owner_only(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "file.json"
    work_files.write_whole(path, "a lone surrogate: \ud800")
    assert path.read_text() == "a lone surrogate: ?"
    assert path.stat().st_mode & 0o777 == work_files.PRIVATE
    assert [file.name for file in path.parent.iterdir()] == ["file.json"]


def test_scratch_folders_of_the_dead_are_swept_and_only_those(tmp_path: Path) -> None:
    program = (
        "import sys; from autograder.util import work_files\n"
        "with work_files.scratch_folder() as folder:\n"
        "    (folder / 'f').touch(); print(folder, flush=True); sys.stdin.read()"
    )
    other = subprocess.Popen(
        [sys.executable, "-c", program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        env={**os.environ, "TMPDIR": str(tmp_path)},
    )  # fmt: skip
    assert other.stdout is not None
    theirs = Path(other.stdout.readline().strip())
    (tmp_path / "ros2-course-interfaces-x").mkdir()
    with work_files.scratch_folder() as own:
        assert work_files.sweep_scratch() == 0
        assert own.is_dir()
        assert theirs.is_dir()
        other.kill()
        other.communicate()
        assert work_files.sweep_scratch() == 1
        assert own.is_dir()
        assert not theirs.exists()
    assert [path.name for path in tmp_path.iterdir()] == ["ros2-course-interfaces-x"]
