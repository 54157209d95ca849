"""The corpus: submissions with known verdicts, by which the graders themselves are graded.

A case is a file ``<exam>/<name>.py``: what a student wrote in the solution cell, under a header

    # title: one line that says what is special about it
    # fails: the checks that must fail, by name; "nothing" for a correct design, "everything"
    #        for a submission that cannot be examined at all
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import nbformat
from nbformat import NotebookNode

from autograder import runner, submission
from autograder.runner import Outcome
from course.errors import CourseError

STUB_MARK = "# Your work goes here."
"""What nbgrader leaves in place of a solution (``ClearSolutions.code_stub``)."""

_HEADER = re.compile(r"\A# title: (?P<title>.+)\n# fails: (?P<fails>.+)\n")


class CorpusError(CourseError):
    """A case of the corpus that is not well formed, or a corpus that is not there."""


@dataclass(frozen=True)
class Case:
    """One submission and the checks that it must fail; ``fails`` is None for "everything"."""

    exam: str
    name: str
    title: str
    fails: frozenset[str] | None
    body: str

    def solution(self, stub: str) -> str:
        """Return the solution cell: the stub with its mark replaced, or a cell of its own."""
        if "SensorDrivers" in self.body and "SensorConsumers" in self.body:
            return self.body
        return stub.replace(STUB_MARK, self.body)

    def submission(self, released: NotebookNode) -> NotebookNode:
        """Return the released notebook as this student hands it in."""
        notebook: NotebookNode = nbformat.from_dict(dict(released))  # type: ignore[no-untyped-call]
        notebook.cells = [nbformat.from_dict(dict(cell)) for cell in released.cells]  # type: ignore[no-untyped-call]
        for cell in notebook.cells:
            if submission.grade_id(cell) == f"{self.exam}-solution":
                cell.source = self.solution(cell.source)
            elif submission.grade_id(cell) == f"{self.exam}-explanation":
                cell.source = f"My idea: {self.title[0].lower()}{self.title[1:]}."
        return notebook

    def verdict_of(self, outcome: Outcome) -> str:
        """Return an empty string if ``outcome`` is what must come out, else what is different."""
        checks = [check for v in outcome.verdicts.values() for check in v.checks]
        if self.fails is None:
            wrong = [c.name for c in checks if c.status != "not_checked"]
            return f"checked nevertheless: {', '.join(wrong)}" if wrong or not checks else ""
        failed = {check.name for check in checks if check.status == "failed"}
        spoilt = {check.name for check in checks if check.status == "grader_error"}
        differences = [
            f"{what} {', '.join(sorted(names))}"
            for what, names in (
                ("passed but must fail:", self.fails - failed),
                ("failed but must pass:", failed - self.fails),
                ("grader error in:", spoilt),
            )
            if names
        ]
        return "; ".join(differences)


def load(folder: Path, exam: str) -> list[Case]:
    """Return the cases of an exam, sorted by name.

    Raises:
        CorpusError: the folder or a case's header is missing.
    """
    files = sorted((folder / exam).glob("*.py"))
    if not files:
        raise CorpusError(f"There is no corpus for '{exam}' in {folder}.")
    return [_case(exam, file) for file in files]


def _case(exam: str, file: Path) -> Case:
    text = file.read_text(encoding="utf-8")
    header = _HEADER.match(text)
    if header is None:
        raise CorpusError(f"{file} must begin with the lines '# title: …' and '# fails: …'.")
    fails = header["fails"].strip()
    names = frozenset(re.findall(r"\w+", fails)) if fails != "nothing" else frozenset()
    return Case(
        exam, file.stem, header["title"], None if fails == "everything" else names,
        text[header.end() :].strip() + "\n",
    )  # fmt: skip


@dataclass(frozen=True)
class Trial:
    """One run of a case: its outcome, and how that differs from what must come out."""

    case: Case
    outcome: Outcome
    difference: str


def run(
    cases: list[Case],
    source: NotebookNode,
    released: NotebookNode,
    *,
    jobs: int = 2,
    repeat: int = 1,
    done: Callable[[Trial], None] = lambda _trial: None,
) -> list[Trial]:
    """Run every case ``repeat`` times, ``jobs`` at a time, and compare."""

    def one(case: Case) -> Trial:
        notebook, _ = submission.restore(case.submission(released), source, released)
        outcome = runner.run(submission.program(notebook))
        trial = Trial(case, outcome, case.verdict_of(outcome))
        done(trial)
        return trial

    def rounds() -> Iterator[Case]:
        for _ in range(repeat):
            yield from cases

    with ThreadPoolExecutor(max_workers=jobs) as pool:
        return list(pool.map(one, rounds()))
