"""Quizzes in the gradebook: the saved answers of a submission, marked with the instructor's keys.

A grade cell whose grade id is ``quiz-NAME`` stands for the quiz NAME, whose bank lies in the course
(``authoring/banks``) or in the package. The scores in a student's attempts file are not looked at:
its best attempt is marked again (see `quizzes.marking.regrade`), so a file that was written by hand
earns what its answers earn. How many attempts there are stands in the feedback; a file that looks
machine-made is marked for a person, with the reason.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from nbformat import NotebookNode

from autograder.assignments.intake import attempts_search
from autograder.assignments.intake.handed_files.file_names import is_same_name
from autograder.assignments.quiz_cells import PREFIX, find_bank, in_cells, quiz_names
from autograder.examination.verdict import CheckResult, Status, Verdict
from autograder.running.runner import Outcome
from quizzes.attempts import record
from quizzes.bank.contents import Bank
from quizzes.marking import regrade, wording
from quizzes.marking.marks import Mark
from quizzes.text import rendering

PART = "answers"


def with_quizzes(
    outcome: Outcome,
    notebook: NotebookNode,
    folder: Path,
    student: str,
    root: Path,
    roster: Collection[str] = (),
) -> Outcome:
    """Return an outcome that holds the marks of the notebook's quizzes, too.

    Args:
        outcome: what came of running the notebook.
        notebook: the submitted notebook, its cells restored.
        folder: the submission, with the attempts file in it.
        student: whose submission it is.
        root: the course root, with banks of its own.
        roster: the students whom the gradebook knows.

    Raises:
        QuizMarksError: a bank is not sound.
    """
    asked = [name for name in in_cells(notebook) if name in quiz_names(root)]
    marked = {
        f"{PREFIX}{name}": mark_best_attempt(find_bank(root, name), folder, student, root, roster)
        for name in asked
    }
    return replace(outcome, verdicts={**outcome.verdicts, **marked}) if marked else outcome


def with_unmarked_quizzes(
    outcome: Outcome, notebook: NotebookNode, root: Path, reason: str
) -> Outcome:
    """Return the outcome of a notebook that is not graded, with its quizzes, for ``reason``.

    Raises:
        QuizMarksError: a bank is not sound.
    """
    asked = [name for name in in_cells(notebook) if name in quiz_names(root)]
    marks = {
        f"{PREFIX}{name}": _unmarked_verdict(find_bank(root, name), reason, status="grader_error")
        for name in asked
    }
    return replace(outcome, verdicts={**outcome.verdicts, **marks})


def quiz_questions(
    notebook: NotebookNode, folder: Path, student: str, root: Path, roster: Collection[str] = ()
) -> dict[str, tuple[str, str]]:
    """Return {grade id: (what a person is asked, the command that answers)} of its quizzes.

    Arguments as in `with_quizzes`.
    """
    asked: dict[str, tuple[str, str]] = {}
    for name in in_cells(notebook):
        if name in quiz_names(root):
            with suppress(OSError):
                found = attempts_search.find_attempts(folder, name, student, root, roster)
                if found.question:
                    asked[f"{PREFIX}{name}"] = (found.question, found.command)
    return asked


def mark_best_attempt(
    bank: Bank,
    folder: Path,
    student: str,
    root: Path | None = None,
    roster: Collection[str] = (),
) -> Verdict:
    """Mark the best attempt that lies in ``folder``; arguments as in `with_quizzes`.

    The course ``root`` is that above ``submitted/STUDENT/ASSIGNMENT`` if it is left out.
    """
    name = record.attempts_filename(bank.quiz)
    root = root or folder.parents[2]
    try:
        found = attempts_search.find_attempts(folder, bank.quiz, student, root, roster)
    except OSError as error:
        reason = f"{name} cannot be read ({error.strerror or error}): a person has to look at it."
        return _unmarked_verdict(bank, reason, status="not_examined")
    if found.content is None:
        reason = (
            f"There is no {name} in the submission: it lies beside the notebook once you have "
            "submitted the quiz, and has to be handed in with it."
        )
        if found.nothing:
            reason = f"{name} was not handed in, as a person has said."
        status: Status = "not_examined" if found.question else "not_checked"
        return _unmarked_verdict(bank, found.question or reason, status=status)
    content = found.content
    try:
        marked = regrade.mark_file(bank, content)
    except Exception as error:  # noqa: BLE001 - one student's data must not end the class
        reason = (
            f"The attempts in {name} could not be marked ({type(error).__name__}: {error}): a "
            "person has to look at them."
        )
        return _unmarked_verdict(bank, reason[:500], status="grader_error")
    if marked.best_result is None and found.question:
        return _unmarked_verdict(bank, found.question, tuple(_file_remarks(marked)), "not_examined")
    if marked.best_result is None:
        return _none_counts(bank, name, marked)
    checks = tuple(_make_check(mark) for mark in marked.best_result.marks)
    if marked.doubt:  # its points stand below; whether they count is for a person to say
        title = "The attempts were made by a person"
        doubt = CheckResult("attempts", title, "not_examined", 0.0, 0.0, actual=marked.doubt)
        checks = (*checks, doubt)
    if found.question:
        title = "It is clear which attempts count, and whose they are"
        unclear = CheckResult("file", title, "not_examined", 0.0, 0.0, actual=found.question)
        checks = (*checks, unclear)
    notes = (*([found.note] if found.note else []), *_attempt_notes(marked, student))
    return Verdict(f"{PREFIX}{bank.quiz}", PART, checks, notes)


def _make_check(mark: Mark) -> CheckResult:
    wrong = [remark for remark in mark.remarks if not remark.right]
    answer = rendering.render_plain(wording.of_answer(mark.item, mark.answer))
    return CheckResult(
        mark.item.variant.id, rendering.render_plain(mark.item.concept.objective),
        "passed" if mark.is_right else "failed", round(mark.credit, 2), 1.0,
        rationale=" ".join(rendering.render_plain(r.feedback) for r in wrong if r.feedback),
        actual=f"The answer was: {answer}",
    )  # fmt: skip


def _attempt_notes(marked: regrade.MarkedAgain, student: str) -> Iterator[str]:
    assert marked.best_result is not None
    paper = marked.best_result.paper
    count = len(marked.results)
    which = (
        f"The best of {count} attempts counts:" if count > 1 else "The one attempt that counts is"
    )
    yield f"{which} number {paper.attempt}. {marked.best_result.headline}"
    if not is_same_name(paper.student, student):
        yield f"It was made under the login '{paper.student}'."
    yield from _file_remarks(marked)


def _file_remarks(marked: regrade.MarkedAgain) -> Iterator[str]:
    yield from marked.problems[:5]
    if marked.damaged:
        yield f"{marked.damaged} lines of the file are no attempts and were left out."
    if marked.other_edition:
        yield f"{marked.other_edition} attempts were made with another edition of the quiz."


def _none_counts(bank: Bank, name: str, marked: regrade.MarkedAgain) -> Verdict:
    remarks = tuple(_file_remarks(marked))
    if marked.other_edition:
        reason = (
            "The attempts were made with another edition of the quiz than the one that is "
            "installed here, so a person has to mark them."
        )
        return _unmarked_verdict(bank, reason, remarks, "grader_error")
    if marked.doubt:
        return _unmarked_verdict(bank, marked.doubt, remarks, "not_examined")
    if marked.damaged:
        reason = f"{name} holds nothing that can be read as an attempt: a person has to look at it."
        return _unmarked_verdict(bank, reason, remarks, "not_examined")
    return _unmarked_verdict(bank, f"{name} holds no attempt that counts.", remarks)


def _unmarked_verdict(
    bank: Bank, reason: str, notes: tuple[str, ...] = (), status: Status = "not_checked"
) -> Verdict:
    checks = tuple(
        CheckResult(c.id, rendering.render_plain(c.objective), status, 0.0, 1.0, actual=reason)
        for c in bank.concepts
    )
    return Verdict(f"{PREFIX}{bank.quiz}", PART, checks, notes)
