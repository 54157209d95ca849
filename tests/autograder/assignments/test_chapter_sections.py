"""Where checks say to read on: every section that they name is in the chapter."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from autograder import exercises
from autograder.assignments.build_notebooks import AssignmentBuildError
from autograder.assignments.chapter_sections import find_sections, require_sections
from autograder.cli import app
from autograder.examination import points
from course.workspace.content import content_root

CHAPTER = """\
# %% [markdown]
# # Chapter 7: Maps
#
# ## Grids (10 minutes)
#
# **Free cells.** They are free.
#
# ### Topics: data (publish-subscribe)
"""


@pytest.fixture
def root(tmp_path: Path) -> Path:
    folder = tmp_path / "authoring" / "chapters"
    folder.mkdir(parents=True)
    (folder / "maps.py").write_text(CHAPTER, encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize("name", sorted(points.table()))
def test_every_section_that_a_bundled_check_names_is_in_its_chapter(name: str) -> None:
    sections = find_sections(content_root())
    assert {"5", "6"} <= set(sections)
    require_sections(sections, name, exercises.where_to_read(name))


def test_headings_and_parts_in_bold_letters_are_sections(root: Path) -> None:
    assert find_sections(root) == {"7": ["Grids", "Free cells", "Topics: data"]}


def test_a_section_that_is_not_there_is_named_with_one_that_may_be_meant(root: Path) -> None:
    with pytest.raises(AssignmentBuildError) as caught:
        require_sections(find_sections(root), "lamp", {"blinks": "Chapter 7, “Grid” and “Grids”"})
    assert str(caught.value).startswith(
        "The check 'blinks' of the exercise 'lamp' says to read “Grid” in chapter 7, which has no "
        "such section."
    )
    assert "Grids" in str(caught.value)


def test_what_is_no_section_of_the_courses_chapters_is_not_looked_at(root: Path) -> None:
    elsewhere = {"a": "Chapter 8, “Grid”", "b": "ROS 2 documentation, “Grid”", "c": ""}
    require_sections(find_sections(root), "lamp", elsewhere)


def test_build_says_which_check_names_a_section_that_is_not_there(tmp_path: Path) -> None:
    run, root = CliRunner(), tmp_path / "robots"
    for words in (
        ["course", str(root)],
        ["exercise", "lamp", "--assignment", "l1", "--root", root],
    ):
        made = run.invoke(app, ["new", *map(str, words)])
        assert made.exit_code == 0, made.output
    (root / "authoring" / "chapters").mkdir(parents=True, exist_ok=True)
    (root / "authoring" / "chapters" / "maps.py").write_text(CHAPTER, encoding="utf-8")
    exam = next(root.rglob("lamp/exam.py"))
    text = exam.read_text(encoding="utf-8")
    assert "@EXAM.check(" in text
    for name, fits in (("Grids", True), ("Grit", False)):
        changed = text.replace("@EXAM.check(", f"@EXAM.check(read='Chapter 7, “{name}”', ", 1)
        exam.write_text(changed, encoding="utf-8")
        built = run.invoke(app, ["build", "--root", str(root)])
        assert ("says to read “Grit” in chapter 7" in str(built.exception)) != fits
