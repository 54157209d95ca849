"""Recognises the cells of a submitted notebook that have lost nbgrader's metadata, or moved.

Colab, a copy into a new notebook, merging and splitting all lose the grade ids by which nbgrader
knows a cell. What is missing is looked for among the other cells: given cells by their text, code
by the classes, functions and variables that its stub defines, written answers by the questions
that they stand between. What cannot be told for certain is left to a person: a stub that is put
back must never be examined in place of what a student wrote.
"""

from __future__ import annotations

import ast
import re
import uuid
from collections.abc import Iterator
from dataclasses import dataclass, field

import nbformat
from nbformat import NotebookNode
from rapidfuzz import fuzz

from autograder.submission import grade_id, is_locked, metadata

ALIKE = 90.0
"""Per cent of a given text that must be left in a cell that is taken for it."""

SHORTEST_ALIKE, SHORTEST_WITHIN = 40, 20
"""Characters of a given text that is recognised though it was changed, and inside another cell."""

LOST = (
    "The notebook had lost nbgrader's marks on its cells, as happens in Colab and when cells are "
    "copied into a new notebook; the cells were recognised by what stands in them and where."
)

_DEFINED = re.compile(
    r"^(?:async[ \t]+def|def|class)[ \t]+(\w+)|^(\w+)[ \t]*(?::[^=\n]+)?=(?!=)", re.MULTILINE
)


@dataclass
class Recognised:
    """What was made of a notebook's cells.

    Attributes:
        notes: for the student, what was recognised.
        doubts: {grade id: why a person has to look} of the cells that nothing was found for,
            while other cells hold what may belong there.
    """

    notes: list[str] = field(default_factory=list)
    doubts: dict[str, str] = field(default_factory=dict)


def recognise(submitted: NotebookNode, released: NotebookNode) -> Recognised:
    """Give the cells of ``submitted`` back the grade ids that they have lost."""
    return _Recognition(submitted, released).run()


def likeness(submitted: NotebookNode, released: NotebookNode) -> float:
    """Return which part of the given cells is there, from 0 to 1, by grade id or by text."""
    ids = {grade_id(cell) for cell in submitted.cells}
    texts = {_plain(cell.source) for cell in submitted.cells}
    given = [cell for cell in released.cells if is_locked(cell) and _plain(cell.source)]
    there = sum(grade_id(cell) in ids or _plain(cell.source) in texts for cell in given)
    return there / len(given) if given else 0.0


def is_untouched(submitted: NotebookNode, released: NotebookNode) -> bool:
    """Whether a notebook holds nothing but what was handed out."""
    texts = {_plain(cell.source) for cell in released.cells} | {""}
    return all(_plain(cell.source) in texts for cell in submitted.cells)


class _Recognition:
    def __init__(self, submitted: NotebookNode, released: NotebookNode) -> None:
        self._submitted = submitted
        self._reference = {grade_id(cell): cell for cell in released.cells if grade_id(cell)}
        self._answers = [name for name, cell in self._reference.items() if _is_answer(cell)]
        self._work = [
            name for name, cell in self._reference.items()
            if metadata(cell).get("solution") and name not in self._answers
        ]  # fmt: skip
        self._taken: list[str] = []
        self._moved: list[str] = []
        self._said = Recognised()

    @property
    def _cells(self) -> list[NotebookNode]:
        cells: list[NotebookNode] = self._submitted.cells
        return cells

    def run(self) -> Recognised:
        self._take_by_cell_id()
        self._split_merged()
        self._take_given()
        self._take_work()
        self._take_answers()
        if len(self._taken) > len(self._reference) / 2:
            self._said.notes.append(LOST)
        elif self._taken:
            named = ", ".join(f"'{name}'" for name in self._taken)
            self._said.notes.append(
                f"Cells had lost nbgrader's marks and were recognised by what stands in them and "
                f"where: {named}."
            )
        for name in self._moved:
            self._said.notes.append(
                f"Your answer to '{name}' stood in a cell beside it; it counts."
            )
        return self._said

    def _known(self) -> set[str]:
        return {grade_id(cell) for cell in self._cells} & self._reference.keys()

    def _missing(self) -> list[str]:
        known = self._known()
        return [name for name in self._reference if name not in known]

    def _unknown(self) -> list[NotebookNode]:
        """Return the cells that are none of the assignment's, and hold something."""
        return [
            cell for cell in self._cells
            if grade_id(cell) not in self._reference and cell.source.strip()
        ]  # fmt: skip

    def _is_given(self, cell: NotebookNode) -> bool:
        """Whether a cell holds nothing but a text that was handed out."""
        return _plain(cell.source) in {_plain(given.source) for given in self._reference.values()}

    def _take(self, name: str, cell: NotebookNode, *, said: bool = True) -> None:
        cell.metadata = nbformat.from_dict({"nbgrader": {"grade_id": name}})  # type: ignore[no-untyped-call]
        if said:
            self._taken.append(name)

    def _take_by_cell_id(self) -> None:
        """Take the cells whose own id, which is made of the grade id, is still there."""
        missing = set(self._missing())
        for cell in self._unknown():
            if cell.get("id") in missing:
                missing.discard(cell.id)
                self._take(cell.id, cell)

    def _split_merged(self) -> None:
        """Take cells apart that hold a given text and more: what is more is the student's."""
        for _ in self._reference:  # a cell may hold several
            if not any(self._take_apart(cell) for cell in list(self._cells)):
                return

    def _take_apart(self, cell: NotebookNode) -> bool:
        name = grade_id(cell)
        own = self._reference.get(name)
        if own is not None and is_locked(own):
            return self._cut(cell, own.source.strip(), name)
        locked = [name for name in self._missing() if is_locked(self._reference[name])]
        texts = {name: self._reference[name].source.strip() for name in locked}
        return any(
            len(text) >= SHORTEST_WITHIN and self._cut(cell, text, name)
            for name, text in texts.items()
        )

    def _cut(self, cell: NotebookNode, given: str, name: str) -> bool:
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
        made = [self._piece(cell, source, of) for source, of in pieces if source.strip()]
        at = next(number for number, one in enumerate(self._cells) if one is cell)
        self._cells[at : at + 1] = made
        self._said.notes.append(f"The cell '{name}' was merged with others; they were taken apart.")
        return True

    def _piece(self, cell: NotebookNode, source: str, name: str) -> NotebookNode:
        fresh = {"source": source, "id": uuid.uuid4().hex[:8], "metadata": {}}
        piece: NotebookNode = nbformat.from_dict({**cell, **fresh})  # type: ignore[no-untyped-call]
        if name:
            self._take(name, piece, said=False)
        return piece

    def _take_given(self) -> None:
        """Take the given cells by their text: first what is the same, then what is still alike."""
        missing = [name for name in self._missing() if is_locked(self._reference[name])]
        for least in (100.0, ALIKE):
            for name in list(missing):
                text = _plain(self._reference[name].source)
                if not text or (least < 100 and len(text) < SHORTEST_ALIKE):
                    continue
                for cell in self._unknown():
                    plain = _plain(cell.source)
                    if plain == text or (
                        least < 100 and fuzz.ratio(text, plain, score_cutoff=least)
                    ):
                        missing.remove(name)
                        self._take(name, cell)
                        break

    def _take_work(self) -> None:
        """Take code by what it defines; ask where code is left that a missing cell may be."""
        given = {
            name for cell in self._reference.values() if is_locked(cell)
            for name in _defined(cell.source)
        }  # fmt: skip
        for name in self._missing():
            if name not in self._work:
                continue
            wanted = _defined(self._reference[name].source) - given
            cells = [cell for cell in self._unknown() if _is_code(cell)]
            fitting = [cell for cell in cells if wanted & _defined(cell.source)]
            if not wanted:  # a stub that defines nothing is known by its place alone
                fitting = [cell for cell in self._in_place(name) if _is_code(cell)]
                fitting = fitting if len(fitting) == 1 else []
            if fitting:
                # Further ones define the rest, or it again: all of them are run in their order.
                self._take(name, max(fitting, key=lambda cell: len(wanted & _defined(cell.source))))
            elif wanted and wanted <= self._all_defined():
                self._blank(name)
                self._said.notes.append(f"The work of the cell '{name}' was found in another cell.")
            elif wanted & self._defined_in_given() or not all(map(self._is_given, cells)):
                self._blank(name)
                self._doubt(
                    self._examined(),
                    f"The cell '{name}' is not in the notebook, while other cells hold code that "
                    "may belong there: a person has to look at it.",
                )

    def _in_place(self, name: str) -> list[NotebookNode]:
        """Return the unknown cells between what precedes and what follows a missing cell."""
        order = list(self._reference)
        before = set(order[: order.index(name)])
        known = [(n, grade_id(cell) in before) for n, cell in enumerate(self._cells)
                 if grade_id(cell) in self._reference]  # fmt: skip
        start = max((n for n, earlier in known if earlier), default=-1)
        end = min(
            (n for n, earlier in known if not earlier and n > start), default=len(self._cells)
        )
        unknown = {id(cell) for cell in self._unknown()}
        return [cell for cell in self._cells[start + 1 : end] if id(cell) in unknown]

    def _defined_in_given(self) -> set[str]:
        """Return what is defined in given cells that were changed: their own text is put back."""
        return {
            name for cell in self._cells for name in _defined(self._added(cell))
        }  # fmt: skip

    def _added(self, cell: NotebookNode) -> str:
        """Return the lines that a student has added to a given cell."""
        own = self._reference.get(grade_id(cell))
        if own is None or not is_locked(own):
            return ""
        lines = {line.strip() for line in own.source.splitlines()}
        return "\n".join(line for line in cell.source.splitlines() if line.strip() not in lines)

    def _all_defined(self) -> set[str]:
        cells = [c for c in self._cells if _is_code(c) and grade_id(c) in ("", *self._work)]
        return {name for cell in cells for name in _defined(cell.source)}

    def _examined(self) -> list[str]:
        return [
            name for name, cell in self._reference.items()
            if metadata(cell).get("grade") and name not in self._answers
        ]  # fmt: skip

    def _blank(self, name: str) -> None:
        """Put an empty cell where the stub would be put back."""
        order = list(self._reference)
        before = set(order[: order.index(name)])
        places = [n for n, cell in enumerate(self._cells, start=1) if grade_id(cell) in before]
        cell: NotebookNode = nbformat.from_dict(  # type: ignore[no-untyped-call]
            {**self._reference[name], "source": "", "id": name}
        )
        self._take(name, cell, said=False)
        self._cells.insert(max(places, default=0), cell)

    def _doubt(self, names: list[str], why: str) -> None:
        for name in names:
            self._said.doubts.setdefault(name, why)

    def _take_answers(self) -> None:
        """Take written answers by the given cells that they stand between, and their order."""
        for given, cells in self._segments():
            expected = self._answers_after(given)
            texts = [cell for cell in cells if _is_text(cell) and not self._is_known(cell)]
            open_ = [name for name in expected if self._is_open(name)]
            if not open_ or not texts:
                continue
            if len(open_) == 1:
                written = [cell for cell in texts if not self._is_empty(open_[0], cell)]
                self._answer(open_[0], written or texts[:1])
            elif len(open_) == len(texts):
                for name, cell in zip(open_, texts, strict=True):
                    self._answer(name, [cell])
            else:
                self._doubt(open_, _unclear(len(texts)))
        self._doubt_the_rest()

    def _segments(self) -> Iterator[tuple[str, list[NotebookNode]]]:
        """Yield what stands behind each given cell, up to the next one."""
        given: str = ""
        cells: list[NotebookNode] = []
        for cell in list(self._cells):
            name = grade_id(cell)
            if name in self._reference and name not in self._answers:
                yield given, cells
                given, cells = name, []
            else:
                cells.append(cell)
        yield given, cells

    def _answers_after(self, given: str) -> list[str]:
        """Return the answers that follow a given cell, up to the next one that is there."""
        order, known = list(self._reference), self._known()
        found = []
        for name in order[order.index(given) + 1 if given else 0 :]:
            if name in self._answers:
                found.append(name)
            elif name in known:
                break
        return found

    def _is_known(self, cell: NotebookNode) -> bool:
        return grade_id(cell) in self._reference

    def _cell(self, name: str) -> NotebookNode | None:
        """Return the cell that counts for an answer: of several, one with something in it."""
        found = [cell for cell in self._cells if grade_id(cell) == name]
        found.sort(key=lambda cell: self._is_empty(name, cell))
        return found[0] if found else None

    def _is_empty(self, name: str, cell: NotebookNode) -> bool:
        return _plain(cell.source) in ("", _plain(self._reference[name].source))

    def _is_open(self, name: str) -> bool:
        """Whether nothing has been written where an answer belongs."""
        cell = self._cell(name)
        return cell is None or self._is_empty(name, cell)

    def _answer(self, name: str, texts: list[NotebookNode]) -> None:
        """Make cells with text the answer ``name``, as one cell in their place."""
        first, *others = texts
        first.source = "\n\n".join(cell.source for cell in texts)
        for cell in others:
            if cell.get("attachments"):
                first.attachments = {**first.get("attachments", {}), **cell.attachments}
        empty = self._cell(name)
        gone = {id(cell) for cell in (empty, *others) if cell is not None}
        self._submitted.cells = [cell for cell in self._cells if id(cell) not in gone]
        self._take(name, first, said=empty is None)
        if empty is not None:
            self._moved.append(name)

    def _doubt_the_rest(self) -> None:
        """Ask about answers that are missing while there is text that nobody has claimed."""
        open_ = [name for name in self._answers if self._is_open(name)]
        missing = [name for name in open_ if self._cell(name) is None]
        texts = [cell for cell in self._unknown() if _is_text(cell) and not self._is_given(cell)]
        if missing and texts:
            self._doubt(missing, _unclear(len(texts)))
        last = self._answers[-1] if self._answers else ""
        if last in self._moved:  # all of them may have been written below the last question
            self._doubt(open_, _unclear(1))
        elif last in self._taken:
            self._doubt(missing, _unclear(1))
        order = list(self._reference)
        for name in open_:
            question = order[order.index(name) - 1] if order.index(name) else ""
            if any(self._added(c).strip() for c in self._cells if grade_id(c) == question):
                self._doubt([name], _unclear(1))


def _unclear(count: int) -> str:
    cells = "a cell of the notebook holds" if count == 1 else f"{count} cells of the notebook hold"
    return f"Nothing stands where this answer belongs, while {cells} text that may be it."


def _is_answer(cell: NotebookNode) -> bool:
    data = metadata(cell)
    return bool(data.get("solution") and data.get("grade")) and cell.cell_type == "markdown"


def _is_code(cell: NotebookNode) -> bool:
    """Whether a cell holds code; a cell of text may, if its type was changed by mistake."""
    return bool(cell.cell_type == "code" or (_defined(cell.source) and _parses(cell.source)))


def _is_text(cell: NotebookNode) -> bool:
    """Whether a cell may hold an answer: text, or code that is none."""
    if not cell.source.strip():
        return False
    return bool(cell.cell_type != "code" or not _parses(cell.source))


def _parses(source: str) -> bool:
    # A magic or a shell command is no Python, and no prose either.
    lines = [line for line in source.splitlines() if not line.lstrip().startswith(("%", "!", "?"))]
    try:
        ast.parse("\n".join(lines))
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return False
    return True


def _defined(source: str) -> set[str]:
    """Return the names that code defines at its top level, whether or not it is sound."""
    return {name for found in _DEFINED.findall(source) for name in found if name}


def _plain(source: str) -> str:
    """Return a text without what editors change by themselves at the ends of lines."""
    return "\n".join(line.rstrip() for line in source.strip().splitlines())
