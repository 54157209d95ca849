"""Recognises written answers by the questions that they stand between, and by their order."""

from __future__ import annotations

from collections.abc import Iterator

from nbformat import NotebookNode

from autograder.assignments.intake.recognition.known_cells import Cells, is_text, strip_line_ends
from autograder.assignments.submission import grade_id


class MatchedAnswers(Cells):
    """The cells of a notebook among which the written answers are looked for."""

    def take_answers(self) -> None:
        """Take written answers by the given cells that they stand between, and their order."""
        self._join_copies()
        for given, cells in self._given_segments():
            expected = self._answers_after(given)
            texts = [cell for cell in cells if is_text(cell) and not self.is_known(cell)]
            open_ = [name for name in expected if self._is_open(name)]
            if not open_ or not texts:
                continue
            if len(open_) == 1:
                written = [cell for cell in texts if not self._is_empty(open_[0], cell)]
                self._make_answer(open_[0], written or texts[:1])
            elif len(open_) == len(texts):
                for name, cell in zip(open_, texts, strict=True):
                    self._make_answer(name, [cell])
            else:
                self.doubt_cells(open_, _unclear_reason(len(texts)))
        self._doubt_the_rest()

    def _join_copies(self) -> None:
        """Make one cell of those with the same grade id that were all written in: a split one."""
        for name in self.answers:
            written = [
                cell for cell in self.cells
                if grade_id(cell) == name and not self._is_empty(name, cell)
            ]  # fmt: skip
            if len(written) > 1:
                self._join_cells(written)
                self.said.notes.append(
                    f"Your answer to '{self.cell_title(name)}' stood in {len(written)} cells; all "
                    "of them count."
                )

    def _join_cells(self, texts: list[NotebookNode]) -> None:
        """Put cells' texts and pictures into the first of them, and remove the others."""
        first, *others = texts
        first.source = "\n\n".join(dict.fromkeys(cell.source for cell in texts))
        for cell in others:
            if cell.get("attachments"):
                first.attachments = {**first.get("attachments", {}), **cell.attachments}
        self._remove_cells(others)

    def _remove_cells(self, cells: list[NotebookNode]) -> None:
        gone = set(map(id, cells))
        self.submitted.cells = [cell for cell in self.cells if id(cell) not in gone]

    def _given_segments(self) -> Iterator[tuple[str, list[NotebookNode]]]:
        """Yield what stands behind each given cell, up to the next one."""
        given: str = ""
        cells: list[NotebookNode] = []
        for cell in list(self.cells):
            name = grade_id(cell)
            if name in self.reference and name not in self.answers:
                yield given, cells
                given, cells = name, []
            else:
                cells.append(cell)
        yield given, cells

    def _answers_after(self, given: str) -> list[str]:
        """Return the answers that follow a given cell, up to the next one that is there."""
        order, known = list(self.reference), self.known_ids()
        found = []
        for name in order[order.index(given) + 1 if given else 0 :]:
            if name in self.answers:
                found.append(name)
            elif name in known:
                break
        return found

    def _answer_cell(self, name: str) -> NotebookNode | None:
        """Return the cell that counts for an answer: of several, one with something in it."""
        found = [cell for cell in self.cells if grade_id(cell) == name]
        found.sort(key=lambda cell: self._is_empty(name, cell))
        return found[0] if found else None

    def _is_empty(self, name: str, cell: NotebookNode) -> bool:
        return strip_line_ends(cell.source) in ("", strip_line_ends(self.reference[name].source))

    def _is_open(self, name: str) -> bool:
        """Whether nothing has been written where an answer belongs."""
        cell = self._answer_cell(name)
        return cell is None or self._is_empty(name, cell)

    def _make_answer(self, name: str, texts: list[NotebookNode]) -> None:
        """Make cells with text the answer ``name``, as one cell in their place."""
        self._join_cells(texts)
        if (empty := self._answer_cell(name)) is not None:
            self._remove_cells([empty])
        self.take_cell(name, texts[0], said=empty is None)
        if empty is not None:
            self.moved.append(name)

    def _doubt_the_rest(self) -> None:
        """Ask about answers that nothing stands for while there is text that nobody has claimed."""
        open_ = [name for name in self.answers if self._is_open(name)]
        texts = [cell for cell in self.unknown_cells() if is_text(cell) and not self.is_given(cell)]
        texts += [c for c in self.cells if c.cell_type != "code" and self.added_lines(c).strip()]
        if texts:
            self.doubt_cells(open_, _unclear_reason(len(texts)))
        last = self.answers[-1] if self.answers else ""
        if last in self.moved:  # all of them may have been written below the last question
            self.doubt_cells(open_, _unclear_reason(1))
        elif last in self.taken:
            self.doubt_cells(
                [name for name in open_ if self._answer_cell(name) is None], _unclear_reason(1)
            )


def _unclear_reason(count: int) -> str:
    cells = "a cell of the notebook holds" if count == 1 else f"{count} cells of the notebook hold"
    return f"Nothing stands where this answer belongs, while {cells} text that may be it."
