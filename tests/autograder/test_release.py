"""A release holds the students' notebooks, and not a line more."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import nbformat
import pytest
from nbformat import NotebookNode

from autograder.release import ReleaseError, leaks, release
from course.student_version import student_versions

REGION = re.compile(r"### BEGIN (?:SOLUTION|HIDDEN TESTS)\n(.*?)### END", re.DOTALL)


@pytest.fixture
def root(released_course: Path, tmp_path: Path) -> Path:
    shutil.copytree(released_course, tmp_path / "course")
    return tmp_path / "course"


def read(path: Path) -> NotebookNode:
    return nbformat.read(path, as_version=4)


def released(root: Path) -> Path:
    return root / "release" / "ch05" / "qos-design.ipynb"


def change(path: Path, grade_id: str, text: str) -> None:
    notebook = read(path)
    [cell] = [
        c for c in notebook.cells if c.metadata.get("nbgrader", {}).get("grade_id") == grade_id
    ]
    cell.source += text
    nbformat.write(notebook, path)


def test_the_release_holds_no_solution_hidden_test_or_authoring_file(root: Path) -> None:
    folder = root / "release" / "ch05"
    assert [path.name for path in folder.rglob("*")] == ["qos-design.ipynb"]
    assert leaks(root / "source" / "ch05", folder) == []
    text = "\n".join(cell.source for cell in read(released(root)).cells)
    assert "BEGIN" not in text
    source = read(root / "source" / "ch05" / "qos-design.ipynb")
    hidden = [found for cell in source.cells for found in REGION.findall(cell.source)]
    assert len(hidden) == 7  # the solution, the hidden tests, five exemplary answers
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
            "\nestimator, too little to steer by the past.",
            "qos-explanation-depth",
        ),
    ],
)
def test_a_leak_is_found_wherever_it_is(
    root: Path, grade_id: str, text: str, says: str | None
) -> None:
    change(released(root), grade_id, text)
    [found] = leaks(root / "source" / "ch05", root / "release" / "ch05")
    assert (says or grade_id) in found


def test_files_too_many_or_too_few_are_found(root: Path) -> None:
    folder = root / "release" / "ch05"
    (folder / "notes").mkdir()
    (folder / "notes" / "qos-design.py").touch()
    assert leaks(root / "source" / "ch05", folder) == ["it holds the file notes/qos-design.py"]
    shutil.rmtree(folder)
    assert leaks(root / "source" / "ch05", folder) == ["qos-design.ipynb is missing from it"]


def test_outputs_are_found(root: Path) -> None:
    data = json.loads(released(root).read_text(encoding="utf-8"))
    cell = next(cell for cell in data["cells"] if cell["cell_type"] == "code")
    cell["outputs"] = [{"output_type": "stream", "name": "stdout", "text": ["42"]}]
    released(root).write_text(json.dumps(data), encoding="utf-8")
    [found] = leaks(root / "source" / "ch05", root / "release" / "ch05")
    assert found.endswith("has outputs")


def test_a_release_that_leaks_is_removed_again(root: Path) -> None:
    config = root / "nbgrader_config.py"
    stub = 'c.ClearSolutions.code_stub = {"python": "stop_qos = QoSProfile("}\n'
    config.write_text(config.read_text(encoding="utf-8") + stub, encoding="utf-8")
    with pytest.raises(ReleaseError, match=r"removed again, because .*qos-solution"):
        release(root, "ch05")
    assert not (root / "release" / "ch05").exists()


def test_releasing_again_replaces_the_release(root: Path) -> None:
    before = released(root).read_bytes()
    change(released(root), "qos-visible", "\n# changed")
    assert release(root, "ch05") == root / "release" / "ch05"
    assert released(root).read_bytes() == before


def test_an_unknown_assignment_names_the_ones_there_are(root: Path) -> None:
    with pytest.raises(ReleaseError, match=r"no assignment 'ch5' in .*: there are ch05\."):
        release(root, "ch5")


def test_an_assignment_that_is_not_built_says_so(root: Path) -> None:
    shutil.rmtree(root / "source")
    with pytest.raises(ReleaseError, match="has not been built: run `autograder build`"):
        release(root, "ch05")


def test_a_stray_file_is_not_handed_out(root: Path) -> None:
    (root / "source" / "ch05" / "solution.py").touch()
    with pytest.raises(ReleaseError, match=r"solution\.py would be handed out"):
        release(root, "ch05")
