"""Where a check sends a student to read, their chapter has something for them."""

from __future__ import annotations

import re

import nbformat
import pytest

from autograder import exercises
from course.workspace.content import content_root

CHAPTER = "ch05-building-blocks.ipynb"


def places() -> dict[str, set[str]]:
    """Return what a student's chapter is made of: {heading: how its paragraphs begin, in bold}."""
    notebook = nbformat.read(content_root() / "chapters" / CHAPTER, as_version=4)
    found: dict[str, set[str]] = {}
    for cell in notebook.cells:
        for line in cell.source.splitlines() if cell.cell_type == "markdown" else ():
            if heading := re.match(r"#+ (.+)", line):
                leads = found.setdefault(heading[1].replace("(", "").replace(")", ""), set())
            elif bold := re.match(r"\*\*(.+?)\.?\*\*", line):
                leads.add(bold[1].lower())
    return found


def is_there(reference: str) -> bool:
    if any(heading.startswith(reference.replace("(", "").replace(")", "")) for heading in places()):
        return True
    if any(reference.lower() in leads for leads in places().values()):
        return True
    heading, _, lead = reference.partition(": ")
    return any(heading in name and lead in leads for name, leads in places().items())


@pytest.mark.parametrize("exam", exercises.exercise_names())
def test_what_a_check_tells_to_read_is_in_the_students_chapter(exam: str) -> None:
    for check in exercises.load_exam(exam).checks.values():
        assert check.read, check.name
        if check.read.startswith("Chapter 5, "):
            references = re.findall(r"“(.+?)”", check.read)
            assert references, check.read
            for reference in references:
                assert is_there(reference), f"{check.name}: {reference}"


@pytest.mark.parametrize("reference", ["Exercise solutions", "Actions: teleportation", "Topics 2"])
def test_what_is_not_in_the_chapter_is_not_found(reference: str) -> None:
    assert not is_there(reference)
