"""What is done and what is left in a working copy."""

from __future__ import annotations

import datetime
import json
from pathlib import Path

from course.workspace.journal import progress_page
from course.workspace.journal.journal_file import (
    MANIFEST,
    Entries,
    Journal,
    JournalError,
    journal_here,
)
from course.workspace.journal.student_notebooks import StudentNotebook, read_notebook
from course.workspace.journal.work import Chapter, ExerciseWork, QuizTaken, WorkDone
from quizzes.attempts.record import MAX_FILE_BYTES, attempts_filename, parse_attempts

WELCOME = Path("start-here.ipynb")
"""The notebook that `course lab` opens first; it is not a chapter."""


class Progress(WorkDone):
    """What a student has done; a notebook shows it as a page, `print` as text."""

    def __repr__(self) -> str:
        """Return it as text."""
        return progress_page.render_text(self)

    def _repr_markdown_(self) -> str:
        return progress_page.render_markdown(self, Path.cwd())


def progress(folder: Path | str | None = None) -> Progress:
    """Return what is done and what is left, as the last expression of a cell shows it.

    Args:
        folder: a working copy, or a folder inside one; the current folder if left out.

    Raises:
        JournalError: there is no working copy there.
    """
    journal = journal_here(Path(folder) if folder else None)
    if journal is None:
        raise JournalError(
            f"{Path(folder or '.').absolute()} is no working copy of the course: make one with "
            "`course lab`, and open its notebooks there."
        )
    return progress_of(journal)


def progress_of(journal: Journal) -> Progress:
    """Return what is done and left in the working copy of ``journal``."""
    entries = journal.read()
    notebooks = [read_notebook(journal.folder, path) for path in handed_out(journal.folder)]
    notices = [entries.notice] if entries.notice else []
    notices += [f"{n.path} cannot be read: {n.problem}." for n in notebooks if n.problem]
    sound = [notebook for notebook in notebooks if not notebook.problem]
    quizzes = tuple(_quiz_progress(journal.folder, n) for n in sound if n.quiz)
    notices += [
        f"{attempts_filename(quiz.notebook.quiz)} has {quiz.damaged} damaged lines: run the quiz "
        "again, which keeps them aside."
        for quiz in quizzes if quiz.damaged
    ]  # fmt: skip
    return Progress(
        journal.folder,
        datetime.datetime.now().astimezone(),
        tuple(_chapter_progress(n, entries) for n in sound if not (n.exam or n.quiz)),
        tuple(
            ExerciseWork(n, entries.checks.get(n.exam))
            for n in sorted(sound, key=lambda notebook: notebook.title)
            if n.exam and not n.quiz
        ),
        quizzes,
        tuple(notices),
    )


def handed_out(folder: Path) -> list[Path]:
    """Return the course's notebooks in a working copy, chapters first."""
    try:
        names = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))
        # Without a digest it comes through nbgrader's exchange, and is there once it was fetched.
        paths = [
            Path(name) for name, digests in names.items() if digests or (folder / name).exists()
        ]
    except (OSError, ValueError, TypeError, AttributeError):
        paths = []
    if not paths:  # a damaged record: look for what is there
        found = [*folder.glob("*.ipynb"), *folder.glob("*/*.ipynb")]
        paths = [path.relative_to(folder) for path in found if ".new" not in path.stem]
    inside = [p for p in paths if p.suffix == ".ipynb" and not p.is_absolute()]
    mine = [path for path in inside if path != WELCOME and ".." not in path.parts]
    return sorted(mine, key=lambda path: (len(path.parts), path))


def _chapter_progress(notebook: StudentNotebook, entries: Entries) -> Chapter:
    return Chapter(
        notebook,
        tuple(sum(cell in entries.cells for cell in s.cells) for s in notebook.sections),
    )


def _quiz_progress(folder: Path, notebook: StudentNotebook) -> QuizTaken:
    file = folder / notebook.path.parent / attempts_filename(notebook.quiz)
    try:
        if not file.is_file():
            return QuizTaken(notebook, ())
        with file.open("rb") as opened:
            attempts, damaged = parse_attempts(opened.read(MAX_FILE_BYTES + 1))
    except OSError:
        return QuizTaken(notebook, (), 1)
    mine = tuple(attempt for attempt in attempts if attempt.quiz == notebook.quiz)
    return QuizTaken(notebook, mine, damaged)
