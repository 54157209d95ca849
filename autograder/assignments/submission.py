"""A submitted notebook: reading it, putting its cells right, and what of it is to be run.

Nothing here runs a student's code. A damaged notebook is mended where that is honest (a deleted
test cell is put back, a duplicated one is disarmed), and each mend is noted for the student.
"""

from __future__ import annotations

import copy
import json
import stat
import warnings
from pathlib import Path
from typing import Any

import nbformat
import nbformat.v4
import nbformat.validator
from nbformat import NotebookNode

from autograder.assignments import bounds
from autograder.examination import answer_keys, points
from autograder.examination.program import Cell, Program
from course.errors import CourseError

MAX_NOTEBOOK_BYTES = 20 * 1024 * 1024
"""Largest notebook file in bytes that is read; a course notebook with its outputs has 0.1 MB."""


class SubmissionError(CourseError):
    """A submission that cannot be read; the message says why, for the student's grade."""


def read_notebook(path: Path) -> NotebookNode:
    """Return the notebook at ``path``.

    Raises:
        SubmissionError: missing, no plain file, too large, not JSON, or not a notebook of format 4.
    """
    return parse(_read_text(path), path.name)


def parse(text: str, name: str) -> NotebookNode:
    """Return the notebook in a file's ``text``; ``name`` is the file's, for what is said of it.

    Raises:
        SubmissionError: it is too large, not JSON, or not a notebook of format 4.
    """
    try:
        data = json.loads(text)
        versions = (data["nbformat"], data["nbformat_minor"])
        if versions[0] != 4 or not all(type(version) is int for version in versions):
            raise KeyError("nbformat")
    except (KeyError, TypeError):
        raise SubmissionError(
            f"{name} is not a notebook of format 4: open it in JupyterLab, save it, and hand "
            "it in again."
        ) from None
    except (ValueError, RecursionError) as error:
        raise SubmissionError(
            f"{name} is not valid JSON ({str(error)[:120]}): the file was cut off or damaged; "
            "hand in the original again."
        ) from None
    if bounds.is_too_deep(data):
        raise SubmissionError(
            f"{name} is nested more than {bounds.MAX_NESTING} levels deep: clear its outputs, or "
            "begin with a new copy of the notebook, and hand it in again."
        )
    if excess := bounds.excess_of_parts(data):
        raise SubmissionError(f"{name} {excess}")
    try:
        # Half of a surrogate pair is legal in JSON, but no text that anything could write again.
        clean = json.dumps(data, ensure_ascii=False).encode("utf-8", "replace").decode()
        notebook = _normalise_notebook(nbformat.v4.reads(clean))  # type: ignore[no-untyped-call]
    except Exception as error:  # noqa: BLE001 - a stranger's data: nbformat fails in many ways
        reason = (str(error) or type(error).__name__).splitlines()[0][:160]
        raise SubmissionError(
            f"{name} does not follow the notebook format ({reason}): open it in JupyterLab, "
            "save it, and hand it in again."
        ) from None
    if excess := bounds.excess_of_notebook(notebook):
        raise SubmissionError(f"{name} {excess}")
    return notebook


def _read_text(path: Path) -> str:
    try:
        status = path.lstat()  # a link may lead to another student's work
        if not stat.S_ISREG(status.st_mode):
            raise SubmissionError(f"{path.name} is not a file: hand in the notebook itself.")
        if status.st_size > MAX_NOTEBOOK_BYTES:
            raise SubmissionError(
                f"{path.name} has {status.st_size / 2**20:.0f} MB, more than the "
                f"{MAX_NOTEBOOK_BYTES // 2**20} MB that are read: clear its outputs and hand it in "
                "again."
            )
        return decode_text(path.read_bytes(), path.name)
    except FileNotFoundError:
        raise SubmissionError(f"There is no {path.name} in the submission.") from None
    except OSError as error:
        raise SubmissionError(
            f"{path.name} cannot be read ({error.strerror}): hand in the notebook itself."
        ) from None


def decode_text(content: bytes, name: str) -> str:
    """Return the text of a notebook's file; ``name`` is the file's, for what is said of it.

    Raises:
        SubmissionError: it is no UTF-8.
    """
    try:
        return content.decode("utf-8-sig")
    except UnicodeError as error:
        raise SubmissionError(
            f"{name} is not valid JSON ({str(error)[:120]}): the file was cut off or damaged; "
            "hand in the original again."
        ) from None


def _normalise_notebook(notebook: NotebookNode) -> NotebookNode:
    """Return a valid notebook, with the cell ids that editors of other versions leave out."""
    with warnings.catch_warnings():
        # Missing or repeated ids are mended right here, so nobody needs to be warned.
        warnings.simplefilter("ignore")
        _, normal = nbformat.validator.normalize(notebook)
    nbformat.validate(normal)
    sound: NotebookNode = normal
    return sound


def nbgrader_metadata(cell: NotebookNode) -> dict[str, Any]:
    """Return a cell's nbgrader metadata, or an empty dict whatever nonsense stands there."""
    found = cell.metadata.get("nbgrader")
    return found if isinstance(found, dict) else {}


def grade_id(cell: NotebookNode) -> str:
    """Return a cell's grade id, or an empty string."""
    return str(nbgrader_metadata(cell).get("grade_id") or "")


def is_locked(cell: NotebookNode) -> bool:
    """Whether the instructor's text of this cell always wins, as nbgrader defines it."""
    data = nbgrader_metadata(cell)
    return not data.get("solution") and bool(data.get("grade") or data.get("locked"))


def restore_cells(
    submitted: NotebookNode, source: NotebookNode, released: NotebookNode
) -> tuple[NotebookNode, list[str]]:
    """Return the submission with the instructor's cells as they should be, and what was mended.

    Locked cells get the text of ``source`` (hidden tests included), deleted cells come back as
    they stand in ``released``, and a second cell with the same grade id loses it. All metadata are
    the instructor's: nbgrader and the templates of feedback trust what stands there.
    """
    reference = {grade_id(cell): cell for cell in released.cells if grade_id(cell)}
    originals = {grade_id(cell): cell for cell in source.cells if grade_id(cell)}
    notes: list[str] = []
    kept: list[NotebookNode] = []
    chosen = _choose_cells(submitted, reference, notes)
    for cell in submitted.cells:
        name = grade_id(cell)
        counts = bool(name) and chosen.get(name) is cell
        if counts:
            cell = _mend_cell(cell, reference[name], originals.get(name, reference[name]), notes)
        else:
            cell.metadata = nbformat.from_dict({})  # type: ignore[no-untyped-call]
        kept.append(cell)
    order = [name for cell in kept if (name := grade_id(cell))]
    if order != [name for name in reference if name in order]:
        notes.append("The cells of the assignment had been moved; they were run as they stood.")
    _put_back(kept, reference, originals, notes)
    mended = nbformat.from_dict({**submitted, "cells": kept})  # type: ignore[no-untyped-call]
    mended.metadata = copy.deepcopy(released.metadata)
    mended.metadata["kernelspec"] = dict(source.metadata.get("kernelspec", {}))
    return mended, notes


def _choose_cells(
    submitted: NotebookNode, reference: dict[str, NotebookNode], notes: list[str]
) -> dict[str, NotebookNode]:
    """Pick the cell that counts for each grade id: of several, the first that was worked on."""
    candidates: dict[str, list[NotebookNode]] = {}
    for cell in submitted.cells:
        if grade_id(cell) in reference:
            candidates.setdefault(grade_id(cell), []).append(cell)
        elif grade_id(cell):
            notes.append(f"The cell '{grade_id(cell)}' is not part of this assignment.")
    chosen = {}
    for name, cells in candidates.items():
        worked_on = [cell for cell in cells if cell.source != reference[name].source]
        chosen[name] = (worked_on or cells)[0]
        if len(cells) > 1:
            notes.append(f"The cell '{name}' was there {len(cells)} times; one of them counts.")
    return chosen


def _mend_cell(
    cell: NotebookNode, reference: NotebookNode, original: NotebookNode, notes: list[str]
) -> NotebookNode:
    name = grade_id(reference)
    if cell.cell_type != reference.cell_type:
        notes.append(f"The cell '{name}' had become a {cell.cell_type} cell; it was changed back.")
        cell = _copy_cell(reference, cell.source)
    if is_locked(reference):
        if cell.source.strip() != reference.source.strip():
            notes.append(f"The text of cell '{name}' had been changed; the original was used.")
        cell.source = original.source
    cell.metadata = copy.deepcopy(reference.metadata)
    return cell


def _put_back(
    cells: list[NotebookNode],
    reference: dict[str, NotebookNode],
    originals: dict[str, NotebookNode],
    notes: list[str],
) -> None:
    """Insert the cells that are missing, each behind the one that precedes it in the release."""
    position = 0
    for name, cell in reference.items():
        present = [index for index, kept in enumerate(cells) if grade_id(kept) == name]
        if present:
            position = present[0] + 1
            continue
        text = originals.get(name, cell).source if is_locked(cell) else cell.source
        cells.insert(position, _copy_cell(cell, text))
        position += 1
        if cell.cell_type == "code":
            notes.append(f"The cell '{name}' had been deleted; it was put back.")


def _copy_cell(cell: NotebookNode, source: str) -> NotebookNode:
    same = copy.deepcopy(cell)
    same.source = source
    if same.cell_type == "code":
        same.outputs, same.execution_count = [], None
    return same


def extract_program(notebook: NotebookNode) -> Program:
    """Return what is to be run, in order: code cells, and the places where exams are sat."""
    cells = []
    ours = points.grade_cells()
    for cell in notebook.cells:
        if cell.cell_type != "code":
            continue
        name = grade_id(cell)
        if is_locked(cell) and name in ours:
            exam, part = ours[name]
            cells.append(Cell("", name, exam, part, answer_keys.of_cell(cell.source)))
        else:
            cells.append(Cell(cell.source, name))
    return tuple(cells)
