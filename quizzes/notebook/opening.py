"""Opens a quiz by its name, for notebooks: finds its bank, and the folder of the learner's work.

A closed quiz comes as a question sheet beside the notebook; it goes before a bank of that name.
"""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path
from typing import Any

from quizzes.bank import loader
from quizzes.errors import QuizError
from quizzes.marking import closed_quizzes
from quizzes.notebook.quiz import Quiz


def load(
    name: str,
    *,
    student: str = "",
    folder: str | os.PathLike[str] | None = None,
    banks: str | os.PathLike[str] | None = None,
) -> Quiz:
    """Return the quiz called ``name``, with what this learner has done of it so far.

    Args:
        name: such as ``"ch05"``.
        student: who takes it; the login if left out.
        folder: where attempts are kept; the current folder if left out.
        banks: a folder of banks, for an author's own; if left out, the folder's question sheets
            and the banks of the package.

    Raises:
        BankError: there is no such quiz (the message names the ones there are), or its bank is
            not sound.
        QuizError: ``student`` is no name, or ``folder`` or ``banks`` is no path.
    """
    place = None if folder is None else _folder_path("folder", folder)
    if banks is not None:
        bank = loader.load_bank(name, _folder_path("banks", banks))
    else:
        sheets = closed_quizzes.find_sheets(place or Path.cwd())
        path = sheets.get(str(name))
        bank = (
            closed_quizzes.read_sheet(path, name) if path else loader.load_bank(name, others=sheets)
        )
    return Quiz(bank, student=student, folder=place)


def _folder_path(argument: str, given: Any) -> Path:
    try:
        path = Path(given)
        with suppress(OSError):
            path.stat()  # refuses what no system takes for a name
    except (TypeError, ValueError):
        raise QuizError(
            f"{argument}={given!r} is no folder: give its path, such as {argument}='my-quizzes'."
        ) from None
    return path
