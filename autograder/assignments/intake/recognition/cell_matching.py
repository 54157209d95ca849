"""Recognises the cells of a submitted notebook that have lost nbgrader's metadata, or moved.

Colab, a copy into a new notebook, merging and splitting all lose the grade ids by which nbgrader
knows a cell. What is missing is looked for among the other cells: given cells by their text, code
by the classes, functions and variables that its stub defines, written answers by the questions
that they stand between. What cannot be told for certain is left to a person: a stub that is put
back must never be examined in place of what a student wrote.
"""

from __future__ import annotations

import re
import uuid

import nbformat
from nbformat import NotebookNode
from rapidfuzz import fuzz

from autograder.assignments.intake.recognition.answer_matching import MatchedAnswers
from autograder.assignments.intake.recognition.known_cells import (
    Recognised,
    defined_names,
    is_code,
    is_python,
    strip_line_ends,
)
from autograder.assignments.submission import grade_id, is_locked, nbgrader_metadata

ALIKE = 90.0
"""Per cent of a given text that must be left in a cell that is taken for it."""

SHORTEST_ALIKE, SHORTEST_WITHIN = 40, 20
"""Characters of a given text that is recognised though it was changed, and inside another cell."""

LOST = (
    "The notebook had lost nbgrader's marks on its cells, as happens in Colab and when cells are "
    "copied into a new notebook; the cells were recognised by what stands in them and where."
)


def recognise_cells(submitted: NotebookNode, released: NotebookNode) -> Recognised:
    """Give the cells of ``submitted`` back the grade ids that they have lost."""
    return _Recognition(submitted, released).run()


def measure_likeness(submitted: NotebookNode, released: NotebookNode) -> float:
    """Return which part of the given cells is there, from 0 to 1, by grade id or by text."""
    ids = {grade_id(cell) for cell in submitted.cells}
    texts = {strip_line_ends(cell.source) for cell in submitted.cells}
    given = [cell for cell in released.cells if is_locked(cell) and strip_line_ends(cell.source)]
    there = sum(grade_id(cell) in ids or strip_line_ends(cell.source) in texts for cell in given)
    return there / len(given) if given else 0.0


def is_untouched(submitted: NotebookNode, released: NotebookNode) -> bool:
    """Whether a notebook holds nothing but what was handed out."""
    texts = {strip_line_ends(cell.source) for cell in released.cells} | {""}
    return all(strip_line_ends(cell.source) in texts for cell in submitted.cells)


class _Recognition(MatchedAnswers):
    def run(self) -> Recognised:
        self._take_by_cell_id()
        self._split_merged()
        self._take_given()
        self._take_work()
        self.take_answers()
        self._keep_additions()
        self._doubt_work_behind_its_exam()
        if len(self.taken) > len(self.reference) / 2:
            self.said.notes.append(LOST)
        elif self.taken:
            named = ", ".join(f"'{self.cell_title(name)}'" for name in self.taken)
            self.said.notes.append(
                f"Cells had lost nbgrader's marks and were recognised by what stands in them and "
                f"where: {named}."
            )
        for name in map(self.cell_title, self.moved):
            self.said.notes.append(f"Your answer to '{name}' stood in a cell beside it; it counts.")
        return self.said

    def _take_by_cell_id(self) -> None:
        """Take the cells whose own id, which is made of the grade id, is still there."""
        missing = set(self.missing_ids())
        for cell in self.unknown_cells():
            if cell.get("id") in missing:
                missing.discard(cell.id)
                self.take_cell(cell.id, cell)

    def _split_merged(self) -> None:
        """Take cells apart that hold a given text and more: what is more is the student's."""
        for _ in self.reference:  # a cell may hold several
            if not any(self._take_apart(cell) for cell in list(self.cells)):
                return

    def _take_apart(self, cell: NotebookNode) -> bool:
        name = grade_id(cell)
        own = self.reference.get(name)
        if own is not None and is_locked(own):
            return self._cut_given(cell, own.source.strip(), name)
        locked = [name for name in self.missing_ids() if is_locked(self.reference[name])]
        texts = {name: self.reference[name].source.strip() for name in locked}
        return any(
            len(text) >= SHORTEST_WITHIN and self._cut_given(cell, text, name)
            for name, text in texts.items()
        )

    def _cut_given(self, cell: NotebookNode, given: str, name: str) -> bool:
        """Cut a given text out of a cell as the cell ``name``; return whether there was more."""
        found = re.search(rf"^{re.escape(given)}[ \t]*$", cell.source, re.MULTILINE)
        if found is None or not given:
            return False
        before = cell.source[: found.start()].strip("\n")
        after = cell.source[found.end() :].strip("\n")
        if not (before.strip() or after.strip()):
            return False
        was = "" if grade_id(cell) == name else grade_id(cell)
        pieces = [(before, was), (given, name), (after, "" if before.strip() else was)]
        made = [self._make_piece(cell, source, of) for source, of in pieces if source.strip()]
        at = next(number for number, one in enumerate(self.cells) if one is cell)
        self.cells[at : at + 1] = made
        called = self.cell_title(name)
        self.said.notes.append(
            f"The cell '{called}' was merged with others; they were taken apart."
        )
        return True

    def _make_piece(self, cell: NotebookNode, source: str, name: str) -> NotebookNode:
        fresh = {"source": source, "id": uuid.uuid4().hex[:8], "metadata": {}}
        piece: NotebookNode = nbformat.from_dict({**cell, **fresh})  # type: ignore[no-untyped-call]
        if name:
            self.take_cell(name, piece, said=False)
        return piece

    def _take_given(self) -> None:
        """Take the given cells by their text: first what is the same, then what is still alike."""
        missing = [name for name in self.missing_ids() if is_locked(self.reference[name])]
        for least in (100.0, ALIKE):
            for name in list(missing):
                text = strip_line_ends(self.reference[name].source)
                if not text or (least < 100 and len(text) < SHORTEST_ALIKE):
                    continue
                for cell in self.unknown_cells():
                    alike = strip_line_ends(cell.source)
                    if alike == text or (
                        least < 100 and fuzz.ratio(text, alike, score_cutoff=least)
                    ):
                        missing.remove(name)
                        self.take_cell(name, cell)
                        break

    def _take_work(self) -> None:
        """Take code by what it defines; ask where code is left that a missing cell may be."""
        given = self._defined_as_given()
        for name in self.missing_ids():
            if name not in self.work:
                continue
            wanted = defined_names(self.reference[name].source) - given
            cells = [cell for cell in self.unknown_cells() if is_code(cell)]
            fitting = [cell for cell in cells if wanted & defined_names(cell.source)]
            if not wanted:  # a stub that defines nothing is known by its place alone
                fitting = [cell for cell in self._in_place(name) if is_code(cell)]
                fitting = fitting if len(fitting) == 1 else []
            if fitting:
                # Further ones define the rest, or it again: all of them are run in their order.
                self.take_cell(
                    name, max(fitting, key=lambda cell: len(wanted & defined_names(cell.source)))
                )
            elif wanted and wanted <= self._all_defined():
                self._insert_blank(name)
                self.said.notes.append(f"The work of the cell '{name}' was found in another cell.")
            elif wanted & self._defined_in_given() or not all(map(self.is_given, cells)):
                self._insert_blank(name)
                self.doubt_cells(
                    self._examined_cells(),
                    f"The cell '{name}' is not in the notebook, while other cells hold code that "
                    "may belong there: a person has to look at it.",
                )

    def _keep_additions(self) -> None:
        """Run given cells also as the student has them, if there are lines of theirs in it.

        Their text is put back, as every given one. An import in the middle would be lost with it.
        """
        for number, cell in reversed([*enumerate(self.cells)]):
            own = self.reference.get(grade_id(cell))
            if own is None or cell.cell_type != "code" or nbgrader_metadata(own).get("grade"):
                continue
            if self.added_lines(cell).strip() and is_python(cell.source):
                self.cells.insert(number + 1, self._make_piece(cell, cell.source, ""))
                self.said.notes.append(
                    f"You have added to the given cell '{self.cell_title(grade_id(cell))}': it is "
                    "run as it was given, and then as you have it."
                )

    def _doubt_work_behind_its_exam(self) -> None:
        """Ask where what a check examines is only defined below it: cells run from the top."""
        order = list(self.reference)
        given = self._defined_as_given()
        for name in self.work:
            wanted = defined_names(self.reference[name].source) - given
            exams = [
                exam for exam in self._examined_cells() if order.index(exam) > order.index(name)
            ]
            places = [n for n, cell in enumerate(self.cells) if grade_id(cell) in exams]
            if not wanted or not places:
                continue
            before, behind = self.cells[: min(places)], self.cells[min(places) :]
            done = {
                word for cell in before if is_code(cell) and not self._is_stub(cell)
                for word in defined_names(cell.source)
            }  # fmt: skip
            late = {
                word for cell in behind
                if is_code(cell) and grade_id(cell) in ("", name) and not self._is_stub(cell)
                for word in defined_names(cell.source)
            }  # fmt: skip
            if not wanted & done and wanted & late:
                self.doubt_cells(
                    self._examined_cells(),
                    f"'{sorted(wanted & late)[0]}' is defined below the check that examines it, "
                    "and cells are run from the top: a person has to look at it.",
                )

    def _is_stub(self, cell: NotebookNode) -> bool:
        own = self.reference.get(grade_id(cell))
        return own is not None and strip_line_ends(own.source) == strip_line_ends(cell.source)

    def _in_place(self, name: str) -> list[NotebookNode]:
        """Return the unknown cells between what precedes and what follows a missing cell."""
        order = list(self.reference)
        before = set(order[: order.index(name)])
        known = [(n, grade_id(cell) in before) for n, cell in enumerate(self.cells)
                 if grade_id(cell) in self.reference]  # fmt: skip
        start = max((n for n, earlier in known if earlier), default=-1)
        end = min((n for n, earlier in known if not earlier and n > start), default=len(self.cells))
        unknown = {id(cell) for cell in self.unknown_cells()}
        return [cell for cell in self.cells[start + 1 : end] if id(cell) in unknown]

    def _defined_as_given(self) -> set[str]:
        """Return what the given cells define as they were handed out."""
        return {
            name for cell in self.reference.values() if is_locked(cell)
            for name in defined_names(cell.source)
        }  # fmt: skip

    def _defined_in_given(self) -> set[str]:
        """Return what is defined in given cells that were changed: their own text is put back."""
        return {
            name for cell in self.cells for name in defined_names(self.added_lines(cell))
        }  # fmt: skip

    def _all_defined(self) -> set[str]:
        cells = [c for c in self.cells if is_code(c) and grade_id(c) in ("", *self.work)]
        return {name for cell in cells for name in defined_names(cell.source)}

    def _examined_cells(self) -> list[str]:
        return [
            name for name, cell in self.reference.items()
            if nbgrader_metadata(cell).get("grade") and name not in self.answers
        ]  # fmt: skip

    def _insert_blank(self, name: str) -> None:
        """Put an empty cell where the stub would be put back."""
        order = list(self.reference)
        before = set(order[: order.index(name)])
        places = [n for n, cell in enumerate(self.cells, start=1) if grade_id(cell) in before]
        cell: NotebookNode = nbformat.from_dict(  # type: ignore[no-untyped-call]
            {**self.reference[name], "source": "", "id": name}
        )
        self.take_cell(name, cell, said=False)
        self.cells.insert(max(places, default=0), cell)
