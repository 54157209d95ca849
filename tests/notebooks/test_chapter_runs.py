"""Chapter 5 in a kernel: as it is handed out, and when a learner has answered everything."""

from __future__ import annotations

from pathlib import Path

import pytest

from . import chapter_five

ANSWERED = pytest.mark.parametrize("answered", [False, True], ids=["untouched", "answered"])


@pytest.mark.timeout(400)
@ANSWERED
def test_every_cell_runs_and_every_check_says_what_is_so(tmp_path: Path, answered: bool) -> None:
    chapter = chapter_five.read_chapter()
    if answered:
        chapter = chapter_five.with_answers(chapter)
    notebook = chapter_five.with_asserts(chapter, answered)
    done = chapter_five.run_with_nbval(notebook, tmp_path / "ch05-building-blocks.ipynb")
    assert done.returncode == 0, done.stdout[-6000:] + done.stderr[-2000:]


def test_every_expectation_belongs_to_one_cell() -> None:
    code = [c.source for c in chapter_five.read_chapter().cells if c.cell_type == "code"]
    for part in chapter_five.EXPECTED:
        assert sum(part in source for source in code) == 1, part
