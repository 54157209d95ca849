"""One case of the corpus: what a student handed in, and the verdict that it must get."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import nbformat
from nbformat import NotebookNode

from autograder import exercises
from autograder.assignments import submission
from autograder.assignments.cells import without_markers
from autograder.examination.draws import USUAL_SEED
from autograder.examination.verdict import CheckResult
from autograder.running.runner import CELL_TIMEOUT_S, Outcome
from autograder.sandbox import abilities
from course.errors import CourseError
from course.util.close_matches import is_it

STUB_MARK = "# Your work goes here."
"""What nbgrader leaves in place of a solution (``ClearSolutions.code_stub``)."""

EVERYTHING = "everything"
ROOTS = "the first"

OURS = ("autograder", "site-packages", "/tmp/", "/project/src", "Traceback", "ipykernel_")
"""What no feedback may hold: the grader's own insides, paths, and tracebacks."""

Splice = tuple[str, str]


def solution_cell(exam: str) -> str:
    """Return the grade id of the cell that holds an exercise's solution."""
    return f"{exam}-solution"


def make_exemplar(exam: str) -> Case:
    """Return the case that is an exercise's exemplar, as its author wrote it."""
    splices: dict[str, tuple[Splice, ...]] = {solution_cell(exam): ()}
    return Case(exam, "exemplar", "The exemplar", frozenset(), splices=splices)


class CorpusError(CourseError):
    """A case of the corpus that is not well formed, or a corpus that is not there."""


@dataclass(frozen=True)
class Case:
    """One submission and the checks that it must fail.

    Attributes:
        exam: the exam that it is a submission of.
        name: unique within the exam; begins with "right-", "wrong-" or "broken-".
        title: one line that says what is special about it.
        fails: names of checks; `EVERYTHING` for one that cannot be examined at all, `ROOTS` for
            one that fails every check that depends on no other.
        says: {check: a fragment that its result must hold, where the numbers are the usual ones}.
        cells: {grade id: text that replaces the cell's}; the rest stays as it is released.
        stub: {grade id: text that takes the place of the stub's mark}.
        splices: {grade id: (old, new) texts}, applied to the exemplar's cell.
        blank: empty the other cells in which a solution is asked for.
        cell_timeout: seconds that one of its cells may run.
        points: what all parts together must earn; None if that goes without saying.
    """

    exam: str
    name: str
    title: str
    fails: frozenset[str]
    says: Mapping[str, str] = field(default_factory=dict)
    cells: Mapping[str, str] = field(default_factory=dict)
    stub: Mapping[str, str] = field(default_factory=dict)
    splices: Mapping[str, tuple[Splice, ...]] = field(default_factory=dict)
    blank: bool = False
    cell_timeout: float = CELL_TIMEOUT_S
    points: float | None = None

    @property
    def must_fail(self) -> frozenset[str]:
        """The names of the checks that must fail; none for `EVERYTHING`, which are unexamined."""
        if self.fails == {EVERYTHING}:
            return frozenset()
        if self.fails == {ROOTS}:
            checks = exercises.load_exam(self.exam).checks.values()
            return frozenset(check.name for check in checks if check.is_root)
        return self.fails

    @property
    def fails_in_words(self) -> str:
        """What must fail, as a phrase for a table."""
        return ", ".join(sorted(self.fails)) or "nothing"

    def require_checks(self) -> None:
        """Require that what it names are checks of its exam.

        Raises:
            CorpusError: one is not.
        """
        known = exercises.load_exam(self.exam).checks
        for name in (*sorted(self.must_fail), *self.says):
            if name not in known:
                raise self._corpus_error(
                    f"it names a check '{name}', which its exam does not have{is_it(name, known)}"
                )

    def make_submission(self, source: NotebookNode, released: NotebookNode) -> NotebookNode:
        """Return the released notebook as this student hands it in.

        Raises:
            CorpusError: a splice does not fit the exemplar, or there is no such cell.
        """
        exemplar = {submission.grade_id(cell): cell.source for cell in source.cells}
        for grade_id in (*self.cells, *self.stub, *self.splices):
            if grade_id not in exemplar:
                raise self._corpus_error(f"there is no cell '{grade_id}' in the notebook")
        notebook: NotebookNode = nbformat.from_dict(dict(released))  # type: ignore[no-untyped-call]
        notebook.cells = [nbformat.from_dict(dict(cell)) for cell in released.cells]  # type: ignore[no-untyped-call]
        for cell in notebook.cells:
            name, data = submission.grade_id(cell), submission.nbgrader_metadata(cell)
            if name in self.splices:
                cell.source = self._apply_splices(
                    without_markers(exemplar[name]), self.splices[name]
                )
            elif name in self.cells:
                cell.source = self.cells[name]
            elif name in self.stub:
                cell.source = cell.source.replace(STUB_MARK, self.stub[name])
            elif cell.cell_type == "code" and data.get("solution"):
                if self.blank:
                    cell.source = ""
                elif self.splices:
                    cell.source = without_markers(exemplar[name])
            elif cell.cell_type == "markdown" and data.get("grade") and data.get("solution"):
                cell.source = f"My idea: {self.title[0].lower()}{self.title[1:]}."
        return notebook

    def _apply_splices(self, text: str, splices: tuple[Splice, ...]) -> str:
        for old, new in splices:
            if text.count(old) != 1:
                raise self._corpus_error(
                    f"{old!r} stands {text.count(old)} times in the exemplar, not once"
                )
            text = text.replace(old, new)
        return text

    def _corpus_error(self, what: str) -> CorpusError:
        return CorpusError(f"Corpus case {self.exam}/{self.name}: {what}.")

    def verdict_of(self, outcome: Outcome) -> str:
        """Return an empty string if ``outcome`` is what must come out, else what is different."""
        checks = {check.name: check for v in outcome.verdicts.values() for check in v.checks}
        if self.fails == {EVERYTHING}:
            wrong = [name for name, check in checks.items() if check.status != "not_checked"]
            return f"checked nevertheless: {', '.join(wrong)}" if wrong or not checks else ""
        failed = {name for name, check in checks.items() if check.status == "failed"}
        spoilt = {name for name, check in checks.items() if check.status == "grader_error"}
        # What this machine cannot examine (there is no sandbox) came out neither right nor wrong.
        unexamined = {name for name, check in checks.items() if check.status == "not_examined"}
        unknown = set() if abilities().loss else unexamined
        passed = {name for name, check in checks.items() if check.passed} | unknown
        differences = [
            f"{what} {', '.join(sorted(names))}"
            for what, names in (
                ("did not fail but must:", self.must_fail - failed - unknown),
                ("must pass:", set() if self.fails else set(checks) - passed - failed),
            )
            if names
        ]
        earned = sum(verdict.score for verdict in outcome.verdicts.values())
        if self.points is not None and earned != self.points:
            differences.append(f"earned {earned:g} points, not {self.points:g}")
        for name in sorted(unexamined - unknown):
            differences.append(f"{name} was not examined: {checks[name].actual!r}")
        if spoilt:
            reasons = {checks[name].actual for name in spoilt}
            differences.append(f"grader error in {', '.join(sorted(spoilt))}: {min(reasons)!r}")
        for name in sorted(failed - self.must_fail):
            differences.append(f"{name} failed but must not: {_result_text(checks[name])!r}")
        # With other numbers than the usual ones, texts have other numbers in them.
        usual = all(verdict.seed == USUAL_SEED for verdict in outcome.verdicts.values())
        for name, fragment in self.says.items() if usual else ():
            if (
                name in checks
                and name not in unknown
                and fragment not in _result_text(checks[name])
            ):
                differences.append(
                    f"{name} does not say {fragment!r}: {_result_text(checks[name])!r}"
                )
        texts = [_result_text(check) for check in checks.values() if check.name not in spoilt]
        for text in (*texts, *(note for v in outcome.verdicts.values() for note in v.notes)):
            differences += [f"feedback holds {ours!r}: {text!r}" for ours in OURS if ours in text]
        return "; ".join(differences)


def _result_text(result: CheckResult) -> str:
    return f"{result.expected} {result.actual} {result.note}"
