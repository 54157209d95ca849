"""``autograder try``: an exam on its exemplar, a case, or any notebook, step by step."""

from __future__ import annotations

import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from nbformat import NotebookNode

from autograder import exercises
from autograder.assignments import submission
from autograder.corpus import command, trials
from autograder.corpus.case import Case, CorpusError, make_exemplar
from autograder.examination.pictures.wording import describe_picture
from autograder.examination.verdict import CheckResult
from autograder.running import runner
from autograder.running.runner import Outcome
from autograder.util import exercise_folders

LOOK_S = 0.5
"""Seconds between two looks at the files of an exercise that is watched."""

_MARKS = {
    "passed": "✔", "failed": "✘", "not_checked": "-", "not_examined": "?", "grader_error": "!",
}  # fmt: skip


@dataclass(frozen=True)
class Tried:
    """One run of an exam: on what, what came of it, and how that differs from what must come."""

    what: str
    outcome: Outcome
    difference: str = ""

    def as_lines(self) -> Iterator[str]:
        """Yield it line by line: each check, what it did and saw, and what was needed."""
        yield f"{self.what}, in {self.outcome.seconds:.1f} s"
        yield from (f"  {note}" for note in self.outcome.notes)
        for verdict in self.outcome.verdicts.values():
            yield f"  {verdict.part}: {verdict.score:g} of {verdict.max_score:g}"
            for check in verdict.checks:
                yield from _check_lines(check)
        if self.difference:
            yield f"  not as it must be: {self.difference}"


def _grader_errors(outcome: Outcome) -> str:
    checks = [check for verdict in outcome.verdicts.values() for check in verdict.checks]
    failed = [check.name for check in checks if check.status == "grader_error"]
    return f"the exam itself failed in {', '.join(failed)}" if failed else ""


def _check_lines(check: CheckResult) -> Iterator[str]:
    points = f"{check.points:g} of {check.max_points:g}"
    yield f"    {_MARKS[check.status]} {check.name} ({points}): {check.title}"
    yield from (f"        {step}" for step in check.steps)
    if check.expected:
        yield f"        needed: {check.expected}"
    if check.actual:
        yield f"        seen:   {check.actual}"
    if check.picture is not None:
        yield f"        shown:  {describe_picture(check.picture)}"


def try_exam(
    exam: str, what: str = "", *, say: Callable[[str], None] = lambda _line: None
) -> Tried:
    """Run an exam once.

    Args:
        exam: the exercise.
        what: a case of its corpus, or a notebook's file; its exemplar if it is empty.
        say: is told what should be known about this machine.

    Raises:
        ExamError: an unknown exercise.
        CorpusError: no such case and no such file.
    """
    source, released = trials.make_notebooks(exercises.load_exam(exam).name)
    case: Case | None = None
    if what.endswith(".ipynb"):
        path = Path(what)
        if not path.is_file():
            raise CorpusError(f"There is no notebook {path}: look at its name and folder.")
        handed_in: NotebookNode = submission.read_notebook(path)
    elif what:
        (case,) = command.choose_cases(command.load_cases(exam), [what])[exam]
        handed_in = case.make_submission(source, released)
    else:
        case = make_exemplar(exam)
        handed_in = case.make_submission(source, released)
    notebook, _ = submission.restore_cells(handed_in, source, released)
    program = submission.extract_program(notebook)
    outcome = runner.run(program, trust=command.needs_trust(say), seed=0)
    difference = case.verdict_of(outcome) if case else _grader_errors(outcome)
    return Tried(what or f"the exemplar of {exam}", outcome, difference)


def try_again_and_again(exam: str, what: str = "", *, say: Callable[[str], None]) -> None:
    """Run an exam, in a process of its own, whenever one of its files has changed; until Ctrl-C.

    A process of its own, because Python keeps what it has imported.
    """
    command = [sys.executable, "-P", "-m", "autograder", "try", exam, *([what] if what else [])]
    if (root := exercise_folders.current_exercises().root) is not None:
        command += ["--root", str(root)]
    seen, never = -1, threading.Event()
    while True:
        if (now := changed_ns(watched_files(exam, what))) != seen:
            seen = now
            subprocess.run(command, check=False)
            say("Waiting for a change of its files; Ctrl-C ends it.")
        never.wait(LOOK_S)


def watched_files(exam: str, what: str = "") -> list[Path]:
    """Return the files of which a change is a reason to try again."""
    folder = exercise_folders.current_exercises().folders[exam]
    files = [path for path in sorted(folder.rglob("*")) if path.suffix in (".py", ".toml")]
    return [*files, Path(what)] if what.endswith(".ipynb") else files


def changed_ns(files: list[Path]) -> int:
    """Return when the newest of some files was changed; 0 if none is there."""
    return max((path.stat().st_mtime_ns for path in files if path.exists()), default=0)
