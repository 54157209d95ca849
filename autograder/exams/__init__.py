"""The exams. Each is a module of this package with an ``EXAM``; adding a file adds an exam."""

from __future__ import annotations

import difflib
import importlib
import pkgutil
from typing import Any

from autograder.exam import Exam, ExamError


def names() -> list[str]:
    """Return the names of the exams there are."""
    return sorted(module.name for module in pkgutil.iter_modules(__path__))


def load(name: str) -> Exam[Any]:
    """Return the exam called ``name``.

    Raises:
        ExamError: there is none; the message names the ones there are.
    """
    if name not in names():
        close = difflib.get_close_matches(name, names(), n=1)
        guess = f" Did you mean '{close[0]}'?" if close else ""
        raise ExamError(f"There is no exam '{name}': there are {', '.join(names())}.{guess}")
    exam: Exam[Any] = importlib.import_module(f"autograder.exams.{name}").EXAM
    return exam
