"""The exercises, a folder each: its exam, and the instruments that only this exam needs.

A folder of this package whose module ``exam`` has an ``EXAM`` is an exercise: adding it adds one.
"""

from __future__ import annotations

import difflib
import importlib
import pkgutil
from typing import Any

from autograder.examination.exam import Exam, ExamError


def names() -> list[str]:
    """Return the names of the exercises there are."""
    return sorted(module.name for module in pkgutil.iter_modules(__path__) if module.ispkg)


def load(name: str) -> Exam[Any]:
    """Return the exam of the exercise called ``name``.

    Raises:
        ExamError: there is none; the message names the ones there are.
    """
    if name not in names():
        close = difflib.get_close_matches(name, names(), n=1)
        guess = f" Did you mean '{close[0]}'?" if close else ""
        raise ExamError(f"There is no exam '{name}': there are {', '.join(names())}.{guess}")
    exam: Exam[Any] = importlib.import_module(f"autograder.exercises.{name}.exam").EXAM
    return exam
