"""Notebooks are built from text: always alike, checked, and in step with what is committed."""

from __future__ import annotations

import json
import re
from pathlib import Path

import nbformat
import pytest

from autograder.assignments import quiz_cells
from autograder.assignments.build_notebooks import (
    AssignmentBuildError,
    build,
    build_assignment,
    build_chapter,
    to_text,
)
from autograder.examination import points
from autograder.gradebook.safe_html import allowed_html
from autograder.util import exercise_folders
from course.errors import CourseError
from course.workspace.content import content_root

PICTURE_BYTES = 6 * 1024
HEADER = """\
# ---
# jupyter:
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---
"""
CHAPTER = (
    HEADER
    + """
# %% [markdown]
# # A chapter

# %%
# %load_ext course
x = 1


# %% tags=["solutions"]
answer = 42

# %%
x = 1

# %%
x = 1
"""
)
TASK = '"grade": false, "grade_id": "task", "locked": true, "schema_version": 3, "solution": false'
WORK = '"grade": false, "grade_id": "work", "locked": false, "schema_version": 3, "solution": true'
TEST = '"grade": true, "grade_id": "test", "locked": true, "points": 0, "schema_version": 3, "solution": false'  # noqa: E501
ASSIGNMENT = (
    HEADER
    + f"""
# %% [markdown] nbgrader={{{TASK}}}
# # Task

# %% nbgrader={{{WORK}}}
def answer():
    ### BEGIN SOLUTION
    return 42
    ### END SOLUTION


# %% nbgrader={{{TEST}}}
assert answer()
### BEGIN HIDDEN TESTS
assert answer() == 42
### END HIDDEN TESTS
"""
)


@pytest.fixture
def root(tmp_path: Path) -> Path:
    for name, text in {"chapters/one.py": CHAPTER, "assignments/ps1/two.py": ASSIGNMENT}.items():
        path = tmp_path / "authoring" / name
        path.parent.mkdir(parents=True)
        path.write_text(text, encoding="utf-8")
    return tmp_path


def write(root: Path, name: str, old: str, new: str) -> None:
    path = root / "authoring" / name
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")


def everything(root: Path) -> dict[str, bytes]:
    files = (path for path in root.rglob("*") if path.is_file())
    return {str(path.relative_to(root)): path.read_bytes() for path in files}


def test_the_same_text_always_makes_the_same_notebook() -> None:
    assert to_text(build_chapter(CHAPTER)) == to_text(build_chapter(CHAPTER))
    made = [build_assignment(ASSIGNMENT, {"test": 3}) for _ in range(2)]
    assert to_text(made[0]) == to_text(made[1])


def test_a_built_notebook_is_clean_and_valid() -> None:
    notebook = build_chapter(CHAPTER)
    nbformat.validate(notebook)
    assert set(notebook.metadata) == {"kernelspec", "language_info"}
    assert notebook.metadata.kernelspec.name == "python3"
    for cell in notebook.cells:
        assert not set(cell.metadata) - {"tags"}
        if cell.cell_type == "code":
            assert (cell.outputs, cell.execution_count) == ([], None)
    assert notebook.cells[1].source == "%load_ext course\nx = 1"


def test_ids_are_grade_ids_or_come_from_the_content() -> None:
    assert [cell.id for cell in build_assignment(ASSIGNMENT, {"test": 3}).cells] == [
        "task",
        "work",
        "test",
    ]
    before = build_chapter(CHAPTER)
    ids = [cell.id for cell in before.cells]
    assert len(set(ids)) == len(ids)
    more = CHAPTER.replace("# %% [markdown]\n# # A", "# %%\nnew = 1\n\n# %% [markdown]\n# # A")
    assert [cell.id for cell in build_chapter(more).cells][1:] == ids


def test_solutions_stay_out_of_a_chapter_unless_asked_for() -> None:
    assert "42" not in to_text(build_chapter(CHAPTER))
    assert "42" in to_text(build_chapter(CHAPTER, with_solutions=True))


@pytest.mark.parametrize("written", ['"points": 0', '"points": 7', '"points": null'])
def test_the_table_of_points_always_wins(written: str) -> None:
    source = ASSIGNMENT.replace('"points": 0', written)
    notebook = build_assignment(source, {"test": 2.5})
    assert notebook.cells[2].metadata.nbgrader.points == 2.5
    whole = build_assignment(source, {"test": 3.0}).cells[2].metadata.nbgrader.points
    assert json.dumps(whole) == "3"


def test_points_of_a_cell_that_the_table_does_not_know_are_kept() -> None:
    notebook = build_assignment(ASSIGNMENT.replace('"points": 0', '"points": 7'), {})
    assert notebook.cells[2].metadata.nbgrader.points == 7


@pytest.mark.parametrize(
    ("old", "new", "cell", "says"),
    [
        ('"grade_id": "task"', '"grade_id": "work"', "cell 2 'work'", "used twice"),
        ('"grade_id": "task"', '"grade_id": "a b"', "cell 1 'a b'", "letters, digits"),
        ('"grade_id": "task"', '"grade_id": ""', "cell 1", "letters, digits"),
        (TASK, TASK.replace(": 3", ": 2"), "cell 1 'task'", "nbgrader refuses"),
        (TASK, TASK + ', "mine": 1', "cell 1 'task'", "nbgrader refuses"),
        (TASK, TASK.replace('"locked": true, ', ""), "cell 1 'task'", "nbgrader refuses"),
        ('"points": 0', '"points": 0', "cell 3 'test'", "without points"),
        ('"points": 0, ', "", "cell 3 'test'", "without points"),
        ("    ### END SOLUTION\n", "", "cell 2 'work'", "has no 'END SOLUTION'"),
        ("    ### BEGIN SOLUTION\n", "", "cell 2 'work'", "does not pair up"),
        ("END HIDDEN TESTS", "END SOLUTION", "cell 3 'test'", "does not pair up"),
        (WORK, WORK.replace('solution": true', 'solution": false'), "cell 2", "a solution in"),
        ("def", "### BEGIN HIDDEN TESTS\n### END HIDDEN TESTS\ndef", "cell 2", "hidden tests in"),
    ],
)
def test_metadata_that_nbgrader_would_stumble_over_name_file_and_cell(
    old: str, new: str, cell: str, says: str
) -> None:
    assert old in ASSIGNMENT
    table = {} if says == "without points" else {"test": 3.0}
    with pytest.raises(AssignmentBuildError) as raised:
        build_assignment(ASSIGNMENT.replace(old, new, 1), table, name="ps1/two.py")
    assert str(raised.value).startswith(f"ps1/two.py, {cell}")
    assert says in str(raised.value)


def test_an_assignment_without_a_grade_cell_is_refused() -> None:
    with pytest.raises(AssignmentBuildError, match="ps1 has no grade cell"):
        build_assignment(CHAPTER, {}, name="ps1")


def test_building_writes_what_changed_and_nothing_else(root: Path) -> None:
    built = build(root, points={"test": 3})
    assert [str(path.relative_to(root)) for path in built] == [
        "chapters/one.ipynb",
        "source/ps1/two.ipynb",
    ]
    before = {path: path.stat().st_mtime_ns for path in built}
    build(root, points={"test": 3})
    assert {path: path.stat().st_mtime_ns for path in built} == before
    assert {path.suffix for path in root.rglob("*") if path.is_file()} == {".py", ".ipynb"}


def test_check_says_which_notebooks_are_not_in_step_and_changes_nothing(root: Path) -> None:
    build(root, points={"test": 3})
    assert build(root, check=True, points={"test": 3})
    write(root, "chapters/one.py", "x = 1", "x = 2")
    before = everything(root)
    with pytest.raises(AssignmentBuildError, match=r"Not in step.*: chapters/one\.ipynb; run"):
        build(root, check=True, points={"test": 3})
    with pytest.raises(AssignmentBuildError, match=r"source/ps1/two\.ipynb"):
        build(root, check=True, points={"test": 4})
    assert everything(root) == before


def test_check_names_notebooks_whose_source_is_gone(root: Path) -> None:
    build(root, points={"test": 3})
    (root / "release" / "ps1").mkdir(parents=True)
    for name in ("release/ps1/two.ipynb", "chapters/checkpoint.txt"):
        (root / name).write_text("{}")
    assert build(root, check=True, points={"test": 3})
    (root / "release" / "ps1" / "gone.ipynb").write_text("{}")
    write(root, "chapters/one.py", "x = 1", "x = 2")
    with pytest.raises(AssignmentBuildError) as raised:
        build(root, check=True, points={"test": 3})
    assert "Not in step" in str(raised.value)
    assert "Without a source in" in str(raised.value)
    assert "release/ps1/gone.ipynb; remove what is no part" in str(raised.value)
    build(root, points={"test": 3})
    (root / "authoring" / "assignments" / "ps1" / "two.py").unlink()
    before = everything(root)
    with pytest.raises(
        AssignmentBuildError, match=r"source/ps1/two\.ipynb.*release/ps1/two\.ipynb"
    ):
        build(root, check=True, points={})
    (root / "authoring" / "chapters" / "one.py").rename(
        root / "authoring" / "chapters" / "three.py"
    )
    with pytest.raises(AssignmentBuildError, match=r"chapters/one\.ipynb.*; remove"):
        build(root, check=True, points={})
    assert everything(root).keys() - before.keys() == {"authoring/chapters/three.py"}


def test_an_unsound_source_leaves_every_notebook_as_it_was(root: Path) -> None:
    build(root, points={"test": 3})
    write(root, "chapters/one.py", "x = 1", "x = 2")
    write(root, "assignments/ps1/two.py", "    ### END SOLUTION\n", "")
    before = everything(root)
    with pytest.raises(
        AssignmentBuildError, match=r"authoring/assignments/ps1/two\.py, cell 2 'work'"
    ):
        build(root, points={"test": 3})
    assert everything(root) == before


def test_a_root_without_sources_or_that_cannot_be_written_is_said(
    root: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    with pytest.raises(AssignmentBuildError, match="There is nothing to build"):
        build(tmp_path_factory.mktemp("empty"), points={})
    (root / "chapters").write_text("in the way")
    with pytest.raises(CourseError, match=r"one\.ipynb cannot be .*"):
        build(root, points={"test": 3})


def test_a_source_that_is_not_text_is_said(root: Path) -> None:
    (root / "authoring" / "chapters" / "one.py").write_bytes(b"\xff\xfe# %%")
    with pytest.raises(AssignmentBuildError, match=r"one\.py cannot be read as UTF-8"):
        build(root, points={"test": 3})


def test_the_committed_notebooks_are_in_step_with_their_sources() -> None:
    root = content_root()
    built = build(root, check=True)
    patterns = ("chapters/*.ipynb", "source/*/*.ipynb", "source/*/*.svg")
    committed = [path for pattern in patterns for path in root.glob(pattern)]
    assert sorted(committed) == sorted(built)


def test_a_notebook_shows_the_picture_of_its_exercise_and_says_what_is_to_be_seen() -> None:
    for name, entry in points.table().items():
        picture = exercise_folders.read_picture(name)
        text = exercise_folders.exercise_file(name, exercise_folders.TASK).read_text("utf-8")
        shown = re.findall(rf"^# !\[(.{{20,}})\]\({entry.notebook}\.svg\)$", text, re.MULTILINE)
        assert len(shown) == (picture is not None), name
        if picture is not None:
            assert len(picture) < PICTURE_BYTES, name
            assert allowed_html.is_still(picture), name
            assert b"<title>" in picture, name


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("exercises = ['qso']", r"ps2\.toml lists the exercise 'qso', .* Did you mean 'qos'\?"),
        ("quizzes = ['midterm']", r"ps2\.toml lists the quiz 'midterm', .*\. There is none\."),
        ("exercises = 'qos'", r"ps2\.toml: exercises must be a list of names"),
        ("exercises = ['qos', 'qos']", "the notebook 'qos-design' would be there twice"),
        ("title = 'Two'", r"ps2\.toml has a 'title', which an assignment has not"),
        ("[broken", r"ps2\.toml is no TOML"),
        ("", r"ps2\.toml lists nothing"),
    ],
)
def test_a_list_of_an_assignment_that_is_not_sound_is_one_sentence(
    root: Path, text: str, says: str
) -> None:
    (root / "authoring" / "assignments" / "ps2.toml").write_text(text)
    with pytest.raises(CourseError, match=says) as raised:
        build(root)
    assert len(str(raised.value).splitlines()) == 1


def test_an_assignment_has_what_its_list_says_in_that_order(root: Path) -> None:
    assignments = root / "authoring" / "assignments"
    (assignments / "ps1.toml").write_text("exercises = ['patterns', 'qos']\nquizzes = ['last']\n")
    (root / "authoring" / "quizzes").mkdir()
    (root / "authoring" / "quizzes" / "last.py").write_text(ASSIGNMENT.replace("0,", "3,"))
    built = build(root, points={"test": 3.0, **points.of_grade_cells()})
    assert [str(path.relative_to(root)) for path in built] == [
        "chapters/one.ipynb", "source/ps1/patterns.ipynb", "source/ps1/qos-design.ipynb",
        "source/ps1/last.ipynb", "source/ps1/two.ipynb",
        "source/ps1/patterns.svg", "source/ps1/qos-design.svg",
    ]  # fmt: skip


def test_every_grade_cell_of_the_table_of_points_is_in_an_assignment() -> None:
    found = {}
    for path in content_root().glob("source/*/*.ipynb"):
        for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
            data = cell["metadata"].get("nbgrader", {})
            if data.get("grade"):
                found[data["grade_id"]] = data["points"]
    assert found == points.of_grade_cells() | quiz_cells.of_grade_cells(content_root())
