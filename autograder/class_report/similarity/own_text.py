"""What of a submission its student wrote, as lines and as tokens that can be compared.

The assignment's given code, its stub and its own solution do not count, nor do comments, blanks and
the names that a student has chosen: what is left is the choice of calls, values and structure. Of
an answer in words what stands in the question or in the model answer does not count.
"""

from __future__ import annotations

import ast
import builtins
import keyword
import re
import warnings
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import islice

from nbformat import NotebookNode

from autograder.assignments import submission

MAX_CHARS = 30_000
"""Characters of one submission that are looked at: work stays bounded whatever is handed in."""
MAX_TOKENS = 2_000
"""Tokens of one submission that are compared; a whole chapter's solutions have fewer."""
MANY, COMMON = 10, 0.25
"""A line is common ground if more than ten students, and a quarter of the class, have it."""

RUN = 4
"""Words in a row that an answer shares with the question or its model only by repeating it."""

# A quote that nothing closes goes to the end of its line: looked for from each one, it takes long.
_STRING = r"""\'\'\'.*?\'\'\'|\"\"\".*?\"\"\"|'(?:\\.|[^'\\\n])*+'?|"(?:\\.|[^"\\\n])*+\"?"""
_TOKEN = re.compile(
    # Comments, and strings that stand for themselves: they document.
    r"""(?P<nothing>\#[^\n]*|(?:(?<=\n)|\A)[ \t]*(?:\'\'\'.*?\'\'\'|\"\"\".*?\"\"\"))"""
    rf"""|(?P<formatted>[rR]?[fF][rR]?(?P<inside>{_STRING}))"""
    rf"""|(?P<string>[rRbBuU]{{0,2}}(?:{_STRING}))"""
    r"""|(?P<name>[^\W\d]\w*)|(?P<number>\d[\w.]*)|(?P<operator>\S)""",
    re.DOTALL,
)

OWN_NAME = "\N{OPEN BOX}"


@dataclass(frozen=True)
class OwnText:
    """The cells and files that a student worked on, line by line; ``cut`` if there is more."""

    lines: tuple[str, ...]
    cut: bool = False


class GivenText:
    """The assignment's own code: the lines of its released notebooks, and of its solutions."""

    def __init__(
        self,
        released: Mapping[str, NotebookNode],
        source: Mapping[str, NotebookNode] | None = None,
    ) -> None:
        """Take {notebook: released notebook}, and {notebook: the instructor's} if it is there."""
        self._cells = {
            (name, submission.grade_id(cell)): cell.source
            for name, notebook in released.items()
            for cell in notebook.cells
            if submission.grade_id(cell)
        }
        sources = [c.source for nb in released.values() for c in nb.cells if c.cell_type == "code"]
        solved = [
            cell.source
            for notebook in (source or {}).values()
            for cell in notebook.cells
            if cell.cell_type == "code"
        ]
        self.lines = frozenset(bare_line(line) for s in sources + solved for line in s.splitlines())
        self.names = frozenset(
            text for s in sources for is_name, text in _split_tokens(s) if is_name
        )

    def extract_own_text(
        self, notebooks: Mapping[str, NotebookNode], files: Mapping[str, bytes]
    ) -> OwnText:
        """Return what a student wrote in their notebooks, and in Python files beside them."""
        texts = [
            cell.source
            for name, notebook in notebooks.items()
            for cell in notebook.cells
            if cell.cell_type == "code" and not self._is_given(name, cell)
        ]
        texts += [
            content[:MAX_CHARS].decode("utf-8", "replace")
            for name, content in files.items()
            if name.endswith(".py")
        ]
        text = "\n".join(texts)
        return OwnText(tuple(text[:MAX_CHARS].splitlines()), len(text) > MAX_CHARS)

    def is_given(self, line: str) -> bool:
        """Whether a line stands in the assignment itself."""
        return bare_line(line) in self.lines

    def _is_given(self, name: str, cell: NotebookNode) -> bool:
        grade_id = submission.grade_id(cell)
        if submission.is_locked(cell):
            return True
        return bool(grade_id) and self._cells.get((name, grade_id)) == cell.source


def common_ground(texts: Iterable[OwnText]) -> frozenset[str]:
    """Return the lines that so many of a class have that they say nothing about two of them."""
    all_texts = list(texts)
    counts = Counter(
        line for text in all_texts for line in {bare_line(line) for line in text.lines}
    )
    many = max(MANY, COMMON * len(all_texts))
    return frozenset(line for line, count in counts.items() if count > many)


def own_tokens(
    text: OwnText, given: GivenText, common: frozenset[str], most: int = MAX_TOKENS
) -> tuple[str, ...]:
    """Return the first ``most`` tokens of what counts; names that the student chose are one."""
    left = [line for line in text.lines if bare_line(line) not in given.lines | common]
    chosen = _chosen_names("\n".join(text.lines)) - given.names
    return tuple(islice(_normalise_names("\n".join(left), chosen), most))


def own_words(text: OwnText, given: str) -> tuple[str, ...]:
    """Return the words of an answer, without what it has in common with a ``given`` text.

    That is every run of `RUN` words or more which stands there, too.
    """
    known = _split_words(given)
    runs = {known[n : n + RUN] for n in range(len(known) - RUN + 1)}
    own = _split_words("\n".join(text.lines))[:MAX_TOKENS]
    taken: set[int] = set()
    for n in range(len(own) - RUN + 1):
        if own[n : n + RUN] in runs:
            taken.update(range(n, n + RUN))
    return tuple(word for n, word in enumerate(own) if n not in taken)


def _split_words(text: str) -> tuple[str, ...]:
    return tuple(re.findall(r"\w+", text.casefold()))


def _normalise_names(text: str, chosen: set[str]) -> Iterator[str]:
    for is_name, token in _split_tokens(text):
        yield OWN_NAME if is_name and token in chosen else token


def _split_tokens(text: str) -> Iterator[tuple[bool, str]]:
    """Yield (whether it is a name, token) for what means something; never fails on any text.

    Five times as fast as pygments, which would take most of the time that a class is compared in.
    """
    for found in _TOKEN.finditer(text):
        if found.lastgroup == "formatted":
            yield from _split_tokens(found["inside"].strip("'\""))  # names stand in it, too
        elif found.lastgroup != "nothing":
            yield found.lastgroup == "name", found[0]


def _chosen_names(text: str) -> set[str]:
    """Return the names that a text itself gives to something; none if it is not Python."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a student's odd escapes are not the reader's concern
            tree = ast.parse(text)
        names = {name for node in ast.walk(tree) if (name := _bound_name(node))}
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return set()
    return {name for name in names if not keyword.iskeyword(name) and not hasattr(builtins, name)}


def _bound_name(node: ast.AST) -> str | None:
    """Return the name that a node gives to something, if it does."""
    if isinstance(node, ast.Name):
        return node.id if isinstance(node.ctx, ast.Store) else None
    if isinstance(node, ast.Attribute):
        return node.attr if isinstance(node.ctx, ast.Store) else None
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
        return node.name
    if isinstance(node, ast.arg):
        return node.arg
    return node.asname if isinstance(node, ast.alias) else None


def bare_line(line: str) -> str:
    """Return a line without its comment and its blanks."""
    return "".join(line.split("#")[0].split())
