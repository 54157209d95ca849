"""``course lab``: a working copy that grows with the course and never loses a student's work."""

from __future__ import annotations

import json
import os
import resource
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from course.errors import CourseError
from course.workspace import working_copy
from course.workspace.content import content_root
from course.workspace.journal.journal_file import MANIFEST
from course.workspace.journal.progress import handed_out

CHAPTER, EXERCISE = Path("ch05-building-blocks.ipynb"), Path("ch05/qos-design.ipynb")
WELCOME = Path("start-here.ipynb")
SOURCE = content_root() / "source"
NOTEBOOKS = sorted(path.relative_to(SOURCE) for path in SOURCE.glob("*/*.ipynb"))
"""Every notebook of an assignment; `EXERCISE` is one of them."""
PICTURES = sorted(path.relative_to(SOURCE) for path in SOURCE.glob("*/*.svg"))
"""Those that lie beside these."""
CHAPTERS = sorted(Path(path.name) for path in (content_root() / "chapters").glob("*.ipynb"))
"""Every notebook that is none; `CHAPTER` and `WELCOME` are among them."""
COMMAND = [sys.executable, "-c", "from course.command_line.launch import course; course()", "lab"]


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """The course as it is built, free to be changed."""
    root = tmp_path / "course"
    for name in ("chapters", "source"):
        shutil.copytree(content_root() / name, root / name)
    shutil.copy(content_root() / "nbgrader_config.py", root)
    return root


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path / "mine"


def update(root: Path, text: str) -> None:
    """Give the course a newer chapter."""
    chapter = root / "chapters" / CHAPTER
    chapter.write_text(chapter.read_text(encoding="utf-8") + text, encoding="utf-8")


def everything(folder: Path) -> dict[Path, bytes]:
    files = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder): path.read_bytes() for path in files}


def without_output(notebook: bytes) -> Any:
    """Return the first notebook's content without the progress that `course lab` puts into it."""
    content = json.loads(notebook)
    for cell in content["cells"]:
        cell.pop("outputs", None)
    return content


def test_a_new_copy_has_the_chapters_and_the_student_versions(root: Path, folder: Path) -> None:
    copied = working_copy.make_copy(folder, root)
    assert copied.new == [*CHAPTERS, *NOTEBOOKS, *PICTURES]
    assert not copied.beside
    assert set(everything(folder)) == {*CHAPTERS, *NOTEBOOKS, *PICTURES, Path(MANIFEST)}
    exercise = (folder / EXERCISE).read_text(encoding="utf-8")
    assert "# Your work goes here." in exercise
    assert "BEGIN SOLUTION" not in exercise
    assert "BEGIN HIDDEN" not in exercise


def test_a_copy_leaves_the_assignments_to_the_exchange(root: Path, folder: Path) -> None:
    copied = working_copy.make_copy(folder, root, assignments=False)
    assert copied.new == CHAPTERS
    assert not (folder / EXERCISE.parent).exists()
    assert EXERCISE not in handed_out(folder)
    (folder / EXERCISE).parent.mkdir()
    (folder / EXERCISE).write_text("fetched")
    assert working_copy.make_copy(folder, root, assignments=False).beside == {}
    assert EXERCISE in handed_out(folder)


def test_a_students_work_stays_as_it_is(root: Path, folder: Path) -> None:
    working_copy.make_copy(folder, root)
    (folder / EXERCISE).write_text("my work")
    (folder / "mine.py").write_text("mine")
    before = everything(folder)
    copied = working_copy.make_copy(folder, root)
    assert (copied.new, copied.beside) == ([], {})
    after = everything(folder)
    assert without_output(after.pop(WELCOME)) == without_output(before.pop(WELCOME))
    assert after == before


def test_a_newer_version_is_put_beside_once(root: Path, folder: Path) -> None:
    working_copy.make_copy(folder, root)
    (folder / CHAPTER).write_text("my notes")
    update(root, "\n")
    newer = (root / "chapters" / CHAPTER).read_bytes()
    beside = Path("ch05-building-blocks.new.ipynb")
    assert working_copy.make_copy(folder, root).beside == {CHAPTER: beside}
    assert (folder / CHAPTER).read_text() == "my notes"
    assert (folder / beside).read_bytes() == newer
    (folder / beside).write_text("my notes in the new one")
    assert working_copy.make_copy(folder, root).beside == {}

    update(root, "\n\n")
    second = Path("ch05-building-blocks.new-2.ipynb")
    assert working_copy.make_copy(folder, root).beside == {CHAPTER: second}
    assert (folder / CHAPTER).read_text() == "my notes"
    assert (folder / beside).read_text() == "my notes in the new one"


def test_a_file_from_elsewhere_is_kept_and_a_deleted_one_comes_back(
    root: Path, folder: Path
) -> None:
    (folder / "ch05").mkdir(parents=True)
    (folder / EXERCISE).write_text("fetched elsewhere, and worked on")
    copied = working_copy.make_copy(folder, root)
    others = [path for path in NOTEBOOKS if path != EXERCISE]
    assert copied.new == [*CHAPTERS, *others, *PICTURES]
    assert copied.beside == {EXERCISE: Path("ch05/qos-design.new.ipynb")}
    assert (folder / EXERCISE).read_text() == "fetched elsewhere, and worked on"
    (folder / CHAPTER).unlink()
    assert working_copy.make_copy(folder, root).new == [CHAPTER]


@pytest.mark.parametrize("damaged", ["", "{", "[]", '{"ch05/qos-design.ipynb": 3}'])
def test_a_damaged_record_costs_nothing(root: Path, folder: Path, damaged: str) -> None:
    working_copy.make_copy(folder, root)
    (folder / EXERCISE).write_text("my work")
    (folder / MANIFEST).write_text(damaged)
    assert working_copy.make_copy(folder, root).beside == {
        EXERCISE: Path("ch05/qos-design.new.ipynb"),
        WELCOME: Path("start-here.new.ipynb"),  # it shows the student's progress by now
    }
    assert (folder / EXERCISE).read_text() == "my work"
    assert json.loads((folder / MANIFEST).read_text())


def test_a_place_that_cannot_be_written_is_said(root: Path, folder: Path) -> None:
    folder.write_text("a file of that name")
    with pytest.raises(
        working_copy.WorkingCopyError, match=r"working copy .*mine cannot be written \(.*course lab"
    ):
        working_copy.make_copy(folder, root)
    assert folder.read_text() == "a file of that name"


def test_a_full_disk_leaves_no_half_file(root: Path, folder: Path) -> None:
    folder.mkdir()
    (folder / EXERCISE.parent).mkdir()
    (folder / EXERCISE).write_text("my work")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1024, limits[1]))  # as if 1 KB were left
    try:
        with pytest.raises(working_copy.WorkingCopyError, match="No file of yours was changed"):
            working_copy.make_copy(folder, root)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert everything(folder) == {EXERCISE: b"my work"}


def test_a_course_that_is_not_built_is_said(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    with pytest.raises(CourseError, match="autograder build"):
        working_copy.make_copy(folder, tmp_path / "empty")
    assert not folder.exists()


def run(*arguments: object, cwd: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*COMMAND, *map(str, arguments)],
        cwd=cwd,
        env={**os.environ, "COLUMNS": "200"},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


def test_the_command_copies_and_then_becomes_jupyterlab(tmp_path: Path) -> None:
    done = run("--version", cwd=tmp_path)  # an option of JupyterLab's, and no folder
    assert done.returncode == 0, done.stderr
    copy = tmp_path / "ros2-course"
    assert f"Your working copy is {copy}" in done.stdout
    assert done.stdout.splitlines()[-1][0].isdigit()  # JupyterLab's version
    assert {CHAPTER, EXERCISE} <= set(everything(copy))


def test_jupyterlab_opens_the_progress_first_unless_told_otherwise(
    folder: Path, root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    working_copy.make_copy(folder, root)
    started: list[list[str]] = []
    monkeypatch.setattr(os, "execv", lambda _program, command: started.append(command))
    monkeypatch.setenv("JUPYTER_CONFIG_PATH", "")
    monkeypatch.chdir(folder)
    first = f"--LabApp.default_url=/lab/tree/{WELCOME}"
    working_copy.open_lab(folder, ["--port", "9000"])
    assert started.pop()[3:] == [first, "--port", "9000"]
    working_copy.open_lab(folder, ["--LabApp.default_url=/doc"])
    assert started.pop()[3:] == ["--LabApp.default_url=/doc"]
    (folder / WELCOME).unlink()
    working_copy.open_lab(folder)
    assert started.pop()[3:] == []


def test_the_command_says_what_it_did_and_what_it_cannot_do(tmp_path: Path) -> None:
    done = run("here", "--copy-only", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert f"new: {tmp_path / 'here' / EXERCISE}" in done.stdout

    (tmp_path / "file").touch()
    done = run("file", "--copy-only", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr.startswith(f"course: The working copy {tmp_path / 'file'} cannot be written")
    assert len(done.stderr.splitlines()) == 1
