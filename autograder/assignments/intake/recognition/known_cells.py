"""The cells of a submitted notebook: which are the assignment's, and what stands in them."""

from __future__ import annotations

import ast
import re
import warnings
from dataclasses import dataclass, field

import nbformat
from nbformat import NotebookNode

from autograder.assignments import questions
from autograder.assignments.submission import grade_id, is_locked, nbgrader_metadata

MAX_ANSWER_CHARS = 100_000
"""Characters of a written answer."""

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


class Cells:
    """The cells of a notebook ``submitted`` for one ``released``, as far as they are known.

    Attributes:
        reference: {grade id: cell as it was handed out}, in their order.
        answers: the grade ids of written answers.
        work: those of other cells that a student fills in.
        taken: those that were given back to a cell.
        moved: answers that stood beside their cell.
        said: what is said of all that.
    """

    def __init__(self, submitted: NotebookNode, released: NotebookNode) -> None:
        """Look at ``submitted``, which is changed on the way."""
        self.submitted = submitted
        self._released = released
        self.reference = {grade_id(cell): cell for cell in released.cells if grade_id(cell)}
        self.answers = [name for name, cell in self.reference.items() if is_answer(cell)]
        self.work = [
            name for name, cell in self.reference.items()
            if nbgrader_metadata(cell).get("solution") and name not in self.answers
        ]  # fmt: skip
        self.taken: list[str] = []
        self.moved: list[str] = []
        self.said = Recognised()

    @property
    def cells(self) -> list[NotebookNode]:
        """All cells, in order."""
        cells: list[NotebookNode] = self.submitted.cells
        return cells

    def cell_title(self, name: str) -> str:
        """Return what a cell is called: by its question, or by its grade id if it has none."""
        question = questions.of_notebook(self._released, "").get(name)
        return question.title if question else name

    def known_ids(self) -> set[str]:
        """Return the grade ids that are there."""
        return {grade_id(cell) for cell in self.cells} & self.reference.keys()

    def missing_ids(self) -> list[str]:
        """Return the grade ids that are not, in their order."""
        known = self.known_ids()
        return [name for name in self.reference if name not in known]

    def unknown_cells(self) -> list[NotebookNode]:
        """Return the cells that are none of the assignment's, and hold something."""
        return [
            cell for cell in self.cells
            if grade_id(cell) not in self.reference and cell.source.strip()
        ]  # fmt: skip

    def is_known(self, cell: NotebookNode) -> bool:
        """Whether a cell has one of the assignment's grade ids."""
        return grade_id(cell) in self.reference

    def is_given(self, cell: NotebookNode) -> bool:
        """Whether a cell holds nothing but a text that was handed out."""
        return strip_line_ends(cell.source) in {
            strip_line_ends(given.source) for given in self.reference.values()
        }

    def added_lines(self, cell: NotebookNode) -> str:
        """Return the lines that a student has added to a given cell."""
        own = self.reference.get(grade_id(cell))
        if own is None or not is_locked(own):
            return ""
        lines = {line.strip() for line in own.source.splitlines()}
        return "\n".join(line for line in cell.source.splitlines() if line.strip() not in lines)

    def take_cell(self, name: str, cell: NotebookNode, *, said: bool = True) -> None:
        """Give a cell the grade id ``name``; ``said``: the student is told."""
        cell.metadata = nbformat.from_dict({"nbgrader": {"grade_id": name}})  # type: ignore[no-untyped-call]
        if said:
            self.taken.append(name)

    def doubt_cells(self, names: list[str], why: str) -> None:
        """Have a person look at some cells, and why."""
        for name in names:
            self.said.doubts.setdefault(name, why)


def is_answer(cell: NotebookNode) -> bool:
    """Whether a cell is for a written answer."""
    data = nbgrader_metadata(cell)
    return bool(data.get("solution") and data.get("grade")) and cell.cell_type == "markdown"


def is_code(cell: NotebookNode) -> bool:
    """Whether a cell holds code; a cell of text may, if its type was changed by mistake."""
    return bool(cell.cell_type == "code" or (defined_names(cell.source) and is_python(cell.source)))


def is_text(cell: NotebookNode) -> bool:
    """Whether a cell may hold an answer: text, or code that is none or says nothing but text."""
    if not cell.source.strip():
        return False
    return bool(cell.cell_type != "code" or not is_python(cell.source) or _only_says(cell.source))


def is_python(source: str) -> bool:
    """Whether a text is sound Python; what nobody would write as an answer is not looked at."""
    if len(source) > MAX_ANSWER_CHARS:
        return True
    # A magic or a shell command is no Python, and no prose either.
    lines = [line for line in source.splitlines() if not line.lstrip().startswith(("%", "!", "?"))]
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a student's backslash is nothing to warn us of
            ast.parse("\n".join(lines))
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return False
    return True


def _only_says(source: str) -> bool:
    """Whether sound code is comments and strings alone."""
    if len(source) > MAX_ANSWER_CHARS:
        return False
    try:
        body = ast.parse(source).body
    except (SyntaxError, ValueError, RecursionError, MemoryError):  # magics
        return False
    return all(
        isinstance(line, ast.Expr)
        and isinstance(line.value, ast.Constant)
        and isinstance(line.value.value, str)
        for line in body
    )


def defined_names(source: str) -> set[str]:
    """Return the names that code defines at its top level, whether or not it is sound."""
    return {name for found in _DEFINED.findall(source) for name in found if name}


def strip_line_ends(source: str) -> str:
    """Return a text without what editors change by themselves at the ends of lines."""
    return "\n".join(line.rstrip() for line in source.strip().splitlines())
