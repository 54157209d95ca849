"""Damaged submissions: mended where that is honest, refused in one sentence otherwise."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import nbformat
import pytest
from nbformat import NotebookNode
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook

from autograder.assignments import bounds, submission
from autograder.assignments.submission import SubmissionError
from autograder.examination.program import program_digest
from autograder.processes.channel import MAX_LINE_BYTES


def cell(grade_id: str, source: str, **flags: bool) -> NotebookNode:
    data = {"grade": False, "locked": False, "solution": False, **flags}
    data |= {"grade_id": grade_id, "schema_version": 3} | ({"points": 2} if data["grade"] else {})
    return new_code_cell(source, id=grade_id, metadata={"nbgrader": data})


def notebook(hidden: str = "") -> NotebookNode:
    return new_notebook(
        cells=[
            new_markdown_cell("# Task", id="text"),
            cell("given", "x = 1", locked=True),
            cell("qos-solution", "y = 0", solution=True),
            cell("qos-visible", f"check('qos'){hidden}", locked=True, grade=True),
            cell("tail", "assert y", locked=True, grade=True),
        ]
    )


SOURCE, RELEASED = notebook("  # secret"), notebook()


def restored(submitted: NotebookNode) -> tuple[NotebookNode, list[str]]:
    return submission.restore_cells(submitted, SOURCE, RELEASED)


def ids(nb: NotebookNode) -> list[str]:
    return [submission.grade_id(c) for c in nb.cells]


def test_an_honest_submission_needs_no_mending() -> None:
    nb = notebook()
    nb.cells[2].source = "y = 42"
    mended, notes = restored(nb)
    assert notes == []
    assert mended.cells[2].source == "y = 42"
    assert mended.cells[3].source.endswith("secret")


def test_an_edited_locked_cell_gets_its_text_back() -> None:
    nb = notebook()
    nb.cells[3].source = "15.0"
    mended, notes = restored(nb)
    assert mended.cells[3].source == SOURCE.cells[3].source
    assert "qos-visible" in notes[0]


def test_metadata_are_the_instructors() -> None:
    nb = notebook()
    nb.cells[3].metadata["nbgrader"].update(points=99, locked=False, solution=True, grade=False)
    mended, _ = restored(nb)
    assert mended.cells[3].metadata["nbgrader"] == RELEASED.cells[3].metadata["nbgrader"]


@pytest.mark.parametrize("gone", [(3,), (4,), (3, 4), (1, 2, 3, 4), (0, 1, 2, 3, 4)])
def test_deleted_cells_come_back_in_their_place(gone: tuple[int, ...]) -> None:
    nb = notebook()
    nb.cells = [c for index, c in enumerate(nb.cells) if index not in gone]
    mended, notes = restored(nb)
    assert [i for i in ids(mended) if i] == ["given", "qos-solution", "qos-visible", "tail"]
    assert len(notes) == len([index for index in gone if index])


def test_of_duplicated_cells_the_one_worked_on_counts() -> None:
    nb = notebook()
    work = cell("qos-solution", "y = 42", solution=True)
    nb.cells.append(work)
    mended, notes = restored(nb)
    (counting,) = [c for c in mended.cells if submission.grade_id(c) == "qos-solution"]
    assert counting.source == "y = 42"
    assert "2 times" in notes[0]


def test_a_duplicated_test_cell_is_disarmed() -> None:
    nb = notebook()
    nb.cells.insert(4, cell("qos-visible", "7.0", locked=True, grade=True))
    mended, _ = restored(nb)
    assert ids(mended).count("qos-visible") == 1
    assert [c.exam for c in submission.extract_program(mended)].count("qos") == 1


def test_a_cell_of_another_type_is_changed_back() -> None:
    nb = notebook()
    nb.cells[2] = new_markdown_cell("y = 42", metadata=nb.cells[2].metadata)
    mended, notes = restored(nb)
    assert (mended.cells[2].cell_type, mended.cells[2].source) == ("code", "y = 42")
    assert "markdown" in notes[0]


def test_foreign_grade_cells_are_disarmed() -> None:
    nb = notebook()
    nb.cells.append(cell("gift", "100.0", locked=True, grade=True))
    mended, notes = restored(nb)
    assert "gift" not in ids(mended)
    assert "gift" in notes[0]


FORGED = {"schema_version": 3, "grade": False, "locked": False, "solution": False}


@pytest.mark.parametrize(
    "nonsense",
    [
        None, [], {}, "x", {"grade_id": ["a"]}, {"grade_id": None},
        {**FORGED, "cell_type": "No space left on device"},
    ],
)  # fmt: skip
def test_nonsense_in_metadata_reaches_nobody(nonsense: object) -> None:
    nb = notebook()
    nb.metadata["widgets"] = nonsense
    nb.cells[0].metadata = nbformat.from_dict({"nbgrader": nonsense, "transient": nonsense})
    nb.cells[2].metadata["transient"] = nonsense
    mended, _ = restored(nb)
    assert ids(mended)[1:] == ["given", "qos-solution", "qos-visible", "tail"]
    assert mended.cells[0].metadata == {}
    assert mended.cells[2].metadata == RELEASED.cells[2].metadata
    assert mended.metadata == {**RELEASED.metadata, "kernelspec": {}}


def test_the_program_names_where_exams_are_sat() -> None:
    program = submission.extract_program(restored(notebook())[0])
    assert [(c.source, c.exam, c.part) for c in program] == [
        ("x = 1", "", ""), ("y = 0", "", ""), ("", "qos", "visible"), ("assert y", "", ""),
    ]  # fmt: skip


def test_equal_programs_have_equal_digests_and_exams_matter() -> None:
    program = submission.extract_program(notebook())
    assert program_digest(program, {}, "a") == program_digest(
        submission.extract_program(notebook()), {}, "a"
    )
    assert program_digest(program, {}, "a") != program_digest(program, {}, "b")
    assert program_digest(program, {}, "a") != program_digest(program, {"x": b""}, "a")


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("", "not valid JSON"),
        ('{"cells": [', "not valid JSON"),
        ("[]", "not a notebook"),
        ('{"nbformat": 4.0, "nbformat_minor": 5, "metadata": {}, "cells": []}', "not a notebook"),
        ('{"nbformat": 4, "nbformat_minor": 4.5, "metadata": {}, "cells": []}', "not a notebook"),
        ('{"nbformat": 3, "worksheets": []}', "not a notebook"),
        ('{"nbformat": 4, "nbformat_minor": 5, "metadata": {}, "cells": [{}]}', "format"),
        ("[" * 100_000, "not valid JSON"),
    ],
)
def test_what_is_no_notebook_is_one_sentence(tmp_path: Path, content: str, reason: str) -> None:
    path = tmp_path / "qos-design.ipynb"
    path.write_text(content)
    with pytest.raises(SubmissionError, match=reason) as caught:
        submission.read_notebook(path)
    assert "qos-design.ipynb" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_bytes_that_are_no_text_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "qos-design.ipynb"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(SubmissionError, match="not valid JSON"):
        submission.read_notebook(path)


def test_a_missing_notebook_is_named(tmp_path: Path) -> None:
    with pytest.raises(SubmissionError, match=r"no qos-design\.ipynb"):
        submission.read_notebook(tmp_path / "qos-design.ipynb")


def test_a_huge_notebook_is_refused_unread(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(submission, "MAX_NOTEBOOK_BYTES", 1000)
    path = tmp_path / "qos-design.ipynb"
    path.write_text(json.dumps(nbformat.from_dict(notebook())) + " " * 1000)
    with pytest.raises(SubmissionError, match="clear its outputs"):
        submission.read_notebook(path)


@pytest.mark.parametrize("depth", [200, 500, 900, 5000])
def test_a_notebook_that_is_nested_too_deep_is_refused(tmp_path: Path, depth: int) -> None:
    path = tmp_path / "qos-design.ipynb"
    text = json.dumps(nbformat.from_dict(notebook()))
    path.write_text(
        text.replace('"metadata": {}', f'"metadata": {{"x": {"[" * depth}{"]" * depth}}}', 1)
    )
    with pytest.raises(SubmissionError, match=r"nested|not valid JSON"):
        submission.read_notebook(path)


def test_more_cells_than_anybody_writes_are_refused(tmp_path: Path) -> None:
    nb = notebook()
    nb.cells += [new_code_cell("x = 1") for _ in range(1000)]
    nbformat.write(nb, tmp_path / "qos-design.ipynb")
    with pytest.raises(SubmissionError, match="has 1005 cells, more than the 1000"):
        submission.read_notebook(tmp_path / "qos-design.ipynb")


@pytest.mark.parametrize("letter", ["x", "\x01", "ü"])
def test_code_that_no_channel_carries_is_refused(tmp_path: Path, letter: str) -> None:
    nb = notebook()
    path = tmp_path / "qos-design.ipynb"
    sizes = {"x": 1, "\x01": 6, "ü": 2}
    nb.cells[2].source = letter * ((bounds.MAX_CODE_BYTES - 200) // sizes[letter])
    nbformat.write(nb, path)
    program = submission.extract_program(submission.read_notebook(path))
    told = json.dumps({"cells": [vars(cell) for cell in program]}, ensure_ascii=False)
    assert len(told.encode()) < MAX_LINE_BYTES
    nb.cells[2].source += letter * 200
    nbformat.write(nb, path)
    with pytest.raises(SubmissionError, match=r"has 1\.0 MB of code.*into a file beside it"):
        submission.read_notebook(path)


def test_half_a_surrogate_pair_is_replaced(tmp_path: Path) -> None:
    nb = notebook()
    path = tmp_path / "qos-design.ipynb"
    path.write_text(json.dumps(nbformat.from_dict(nb)).replace("y = 0", "y = '\\ud83d'"))
    read = submission.read_notebook(path)
    assert read.cells[2].source == "y = '?'"
    nbformat.write(read, tmp_path / "again.ipynb")


def test_a_byte_order_mark_is_no_damage(tmp_path: Path) -> None:
    path = tmp_path / "qos-design.ipynb"
    path.write_text(json.dumps(nbformat.from_dict(notebook())), encoding="utf-8-sig")
    assert len(submission.read_notebook(path).cells) == 5


def test_what_is_no_plain_file_is_refused_at_once(tmp_path: Path) -> None:
    folder, fifo, loop = (tmp_path / name for name in ("a.ipynb", "b.ipynb", "c.ipynb"))
    folder.mkdir()
    os.mkfifo(fifo)
    loop.symlink_to(loop)
    for path in (folder, fifo, loop):
        with pytest.raises(SubmissionError, match="hand in the notebook itself"):
            submission.read_notebook(path)


def test_cells_that_were_moved_are_noted() -> None:
    nb = notebook()
    nb.cells[2], nb.cells[3] = nb.cells[3], nb.cells[2]
    _, notes = restored(nb)
    assert notes == ["The cells of the assignment had been moved; they were run as they stood."]


def _many(**cell: Any) -> str:
    cells = [{"cell_type": "code", "metadata": {}, "source": "x", "outputs": [], **cell}]
    return json.dumps({"nbformat": 4, "nbformat_minor": 5, "metadata": {}, "cells": cells})


@pytest.mark.parametrize(
    "text",
    [
        _many(outputs=[{"output_type": "stream", "name": "stdout", "text": ""}] * 100_000),
        _many(outputs=[{"output_type": "none"}] * 100_000),
        _many(metadata={str(number): number for number in range(100_000)}),
        _many(metadata={"x": [{}] * 100_000}),
        json.dumps({"nbformat": 4, "nbformat_minor": 5, "metadata": {}, "cells": [{}] * 100_000}),
    ],
    ids=["outputs", "wrong outputs", "metadata", "objects", "cells"],
)
def test_what_takes_long_to_compare_with_the_format_is_not_compared(text: str) -> None:
    with pytest.raises(SubmissionError, match=r"has (more than 1000 outputs|100000 cells)"):
        submission.parse(text, "x.ipynb")


def test_tags_that_take_long_to_compare_are_no_reason_to_refuse_a_notebook() -> None:
    text = _many(id="a", execution_count=None, metadata={"tags": [{} for _ in range(20_000)]})
    assert submission.parse(text, "x.ipynb").cells[0].metadata == {}
