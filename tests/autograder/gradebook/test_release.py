"""A release holds the students' notebooks, and not a line more."""

from __future__ import annotations

import errno
import json
import os
import re
import shutil
import sqlite3
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import nbformat
import pytest
from nbformat import NotebookNode
from nbgrader.api import Gradebook

from autograder.gradebook import course_gradebook
from autograder.gradebook.database import GradebookLockedError
from autograder.gradebook.release import ReleaseError, find_leaks, make_release
from autograder.util import exercise_folders
from course.workspace.student_version import student_versions

REGION = re.compile(r"### BEGIN (?:SOLUTION|HIDDEN TESTS)\n(.*?)### END", re.DOTALL)


@pytest.fixture
def root(released_course: Path, tmp_path: Path) -> Path:
    shutil.copytree(released_course, tmp_path / "course")
    return tmp_path / "course"


def read(path: Path) -> NotebookNode:
    return nbformat.read(path, as_version=4)


def released(root: Path) -> Path:
    return root / "release" / "ch05" / "qos-design.ipynb"


def leaks(root: Path) -> list[str]:
    picture = Path("qos-design.svg")
    beside = {picture: exercise_folders.exercise_file("qos", exercise_folders.PICTURE).read_bytes()}
    return find_leaks(root / "source" / "ch05", root / "release" / "ch05", beside)


def change(path: Path, grade_id: str, text: str) -> None:
    notebook = read(path)
    [cell] = [
        c for c in notebook.cells if c.metadata.get("nbgrader", {}).get("grade_id") == grade_id
    ]
    cell.source += text
    nbformat.write(notebook, path)


def test_the_release_holds_no_solution_hidden_test_or_authoring_file(root: Path) -> None:
    folder = root / "release" / "ch05"
    assert sorted(path.name for path in folder.rglob("*")) == ["qos-design.ipynb", "qos-design.svg"]
    assert leaks(root) == []
    text = "\n".join(cell.source for cell in read(released(root)).cells)
    assert "BEGIN" not in text
    source = read(root / "source" / "ch05" / "qos-design.ipynb")
    hidden = [found for cell in source.cells for found in REGION.findall(cell.source)]
    assert len(hidden) == 4  # the solution, the hidden tests, two exemplary answers
    for region in hidden:
        assert region.strip() not in text


def test_the_release_keeps_what_students_need(root: Path) -> None:
    cells = {cell.id: cell for cell in read(released(root)).cells}
    assert "# Your work goes here." in cells["qos-solution"].source
    assert "camera_qos = QoSProfile(depth=80, " in cells["qos-solution"].source
    assert 'check("qos")' in cells["qos-visible"].source
    assert cells["qos-visible"].metadata.editable is False
    assert cells["qos-explanation-depth"].source == "*Your answer goes here.*"


def test_a_working_copy_gets_byte_for_byte_what_nbgrader_releases(root: Path) -> None:
    texts = student_versions(root)
    assert texts == {Path("ch05/qos-design.ipynb"): released(root).read_text(encoding="utf-8")}


@pytest.mark.parametrize(
    ("grade_id", "text", "says"),
    [
        ("qos-given", "\ndepth=5,", None),  # the solution has this line, indented or not
        ("qos-visible", '\ncheck("qos", part="hidden")', "qos-visible"),
        ("qos-solution", "\n### BEGIN SOLUTION", "still marks"),
        (
            "qos-explanation-depth",
            "\npause, and the controller steers by the past.",
            "qos-explanation-depth",
        ),
    ],
)
def test_a_leak_is_found_wherever_it_is(
    root: Path, grade_id: str, text: str, says: str | None
) -> None:
    change(released(root), grade_id, text)
    [found] = leaks(root)
    assert (says or grade_id) in found


def test_files_too_many_or_too_few_are_found(root: Path) -> None:
    folder = root / "release" / "ch05"
    (folder / "notes").mkdir()
    (folder / "notes" / "qos-design.py").touch()
    assert leaks(root) == ["it holds the file notes/qos-design.py"]
    shutil.rmtree(folder)
    assert leaks(root) == [f"qos-design.{kind} is missing from it" for kind in ("ipynb", "svg")]


def test_outputs_are_found(root: Path) -> None:
    data = json.loads(released(root).read_text(encoding="utf-8"))
    cell = next(cell for cell in data["cells"] if cell["cell_type"] == "code")
    cell["outputs"] = [{"output_type": "stream", "name": "stdout", "text": ["42"]}]
    released(root).write_text(json.dumps(data), encoding="utf-8")
    [found] = leaks(root)
    assert found.endswith("has outputs")


def state(root: Path) -> dict[str, bytes]:
    """Return the release as it stands, and what the gradebook says of it."""
    folder = root / "release"
    found = {str(p.relative_to(root)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}
    with closing(sqlite3.connect(root / "gradebook.db")) as gradebook:
        found["gradebook"] = "\n".join(gradebook.iterdump()).encode()
    return found


def test_a_release_that_leaks_is_not_made_and_the_old_one_stays(root: Path) -> None:
    before = state(root)
    config = root / "nbgrader_config.py"
    stub = 'c.ClearSolutions.code_stub = {"python": "stop_qos = QoSProfile("}\n'
    config.write_text(config.read_text(encoding="utf-8") + stub, encoding="utf-8")
    with pytest.raises(ReleaseError, match=r"because in the release .*qos-solution.*as it was"):
        make_release(root, "ch05")
    assert state(root) == before
    shutil.rmtree(root / "release")
    with pytest.raises(ReleaseError, match=r"then build and release again\.$"):
        make_release(root, "ch05")
    assert list((root / "release").iterdir()) == []


def hand_in(root: Path) -> None:
    with Gradebook(f"sqlite:///{root / 'gradebook.db'}") as gradebook:
        gradebook.add_student("ada")
        gradebook.add_submission("ch05", "ada")


def rename_a_cell(root: Path) -> None:
    path = root / "source" / "ch05" / "qos-design.ipynb"
    path.write_text(path.read_text().replace("qos-explanation-loss", "qos-explanation-lost"))


def add_a_notebook(root: Path) -> None:
    old = root / "source" / "ch05" / "qos-design.ipynb"
    shutil.copy(old, old.with_name("a-new-one.ipynb"))
    texts = root / "authoring" / "assignments" / "ch05"
    texts.mkdir()
    shutil.copy(exercise_folders.exercise_file("qos", "task.py"), texts / "a-new-one.py")


@pytest.mark.filterwarnings("ignore::sqlalchemy.exc.SAWarning")  # of nbgrader's own
@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (rename_a_cell, r"Cannot add or remove cells for notebook 'qos-design' because"),
        (add_a_notebook, r"Cannot modify existing assignment 'Assignment<ch05>' because"),
    ],
)
def test_what_nbgrader_refuses_once_work_is_graded_is_said_with_the_way_out(
    root: Path, change: Callable[[Path], None], reason: str
) -> None:
    hand_in(root)
    change(root)
    before = state(root)
    with pytest.raises(ReleaseError) as raised:
        make_release(root, "ch05")
    said = str(raised.value)
    assert re.search(f"'ch05' is not released, because nbgrader says: {reason}", said)
    assert "undo that change, or release it as an assignment of another name" in said
    assert said.endswith("The earlier release stands as it was.")
    assert len(said.splitlines()) == 1
    assert state(root) == before


def test_a_release_that_cannot_be_put_in_place_leaves_the_old_one(
    root: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    change(root / "source" / "ch05" / "qos-design.ipynb", "qos-visible", "\n# another test")
    before = state(root)
    rename = Path.rename

    def fails(self: Path, target: Path) -> Path:
        if self.parent.name.endswith(".partial") and self.name == "ch05":
            raise OSError(errno.ENOSPC, "No space left on device")
        return rename(self, target)

    monkeypatch.setattr(Path, "rename", fails)
    with pytest.raises(ReleaseError, match=r"cannot be replaced \(No space left"):
        make_release(root, "ch05")
    assert state(root) == before
    monkeypatch.undo()
    make_release(root, "ch05")
    after = state(root)
    assert [name for name in before if after[name] != before[name]] == [
        "release/ch05/qos-design.ipynb", "gradebook",
    ]  # fmt: skip


@pytest.mark.parametrize("released_before", [True, False])
def test_a_gradebook_that_cannot_be_written_leaves_the_old_release(
    root: Path, monkeypatch: pytest.MonkeyPatch, released_before: bool
) -> None:
    change(root / "source" / "ch05" / "qos-design.ipynb", "qos-visible", "\n# another test")
    if not released_before:
        shutil.rmtree(root / "release" / "ch05")
    before = state(root)
    monkeypatch.setattr(course_gradebook, "LOCK_PATIENCE_S", 0.0)
    with closing(sqlite3.connect(root / "gradebook.db")) as other:
        other.execute("BEGIN IMMEDIATE")
        with pytest.raises(GradebookLockedError):
            make_release(root, "ch05")
    assert state(root) == before
    assert [path.name for path in (root / "release").iterdir()] == ["ch05"] * released_before


def test_what_a_killed_release_leaves_is_cleared_away(root: Path) -> None:
    for name, age in {"old": 1000.0, "new": 0.0}.items():
        left = root / "release" / f".ch05.{name}.partial"
        left.mkdir()
        os.utime(left, (time.time() - age,) * 2)
    make_release(root, "ch05")
    assert sorted(path.name for path in (root / "release").iterdir()) == [
        ".ch05.new.partial",
        "ch05",
    ]
    assert (root / "release" / "ch05").stat().st_mode & 0o777 == 0o755


def test_a_notebook_without_its_text_is_not_released(root: Path) -> None:
    before = state(root)
    source = root / "source" / "ch05" / "qos-design.ipynb"
    shutil.copy(source, source.with_name("removed.ipynb"))
    with pytest.raises(ReleaseError, match=r"removed\.ipynb is none of the notebooks .*remove it"):
        make_release(root, "ch05")
    assert state(root) == before


def test_releasing_again_replaces_the_release(root: Path) -> None:
    before = released(root).read_bytes()
    change(released(root), "qos-visible", "\n# changed")
    assert make_release(root, "ch05") == root / "release" / "ch05"
    assert released(root).read_bytes() == before


def test_an_unknown_assignment_names_the_ones_there_are(root: Path) -> None:
    with pytest.raises(ReleaseError, match=r"no assignment 'ch5' in .*: there are ch05\."):
        make_release(root, "ch5")


def test_an_assignment_that_is_not_built_says_so(root: Path) -> None:
    shutil.rmtree(root / "source")
    with pytest.raises(ReleaseError, match="has not been built: run `autograder build`"):
        make_release(root, "ch05")


def test_a_stray_file_is_not_handed_out(root: Path) -> None:
    (root / "source" / "ch05" / "solution.py").touch()
    with pytest.raises(ReleaseError, match=r"solution\.py would be handed out"):
        make_release(root, "ch05")
