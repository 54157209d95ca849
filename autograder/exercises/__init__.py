"""The exercises, a folder each: text, exam, points, corpus, and the instruments of this exam only.

A folder of this package, or of a course root's ``exercises/``, is an exercise: adding it adds one
(see `autograder.util.exercise_folders`). Modules of a course root's are imported as
``course_exercises.NAME.MODULE``; nothing of a course root is on Python's path.
"""

from __future__ import annotations

import importlib
import importlib.util
import sys
import threading
import traceback
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType
from typing import Any

from autograder.examination import points
from autograder.examination.exam import Exam, ExamError
from autograder.util import exercise_folders
from autograder.util.exercise_folders import COURSE_PACKAGE, FOLDER, Exercises
from course.util.close_matches import did_you_mean

_importing = threading.Lock()
_imported: Exercises | None = None


def exercise_names() -> list[str]:
    """Return the names of the exercises there are."""
    return list(exercise_folders.current_exercises().folders)


def own_names() -> frozenset[str]:
    """Return the names of those that the course root in use has of its own."""
    return exercise_folders.current_exercises().own


def load_exam(name: str) -> Exam[Any]:
    """Return the exam of the exercise called ``name``.

    Raises:
        ExamError: there is none, and the message names the ones there are; or it has none, or its
            module cannot be loaded.
        ExerciseError: it has no ``exam.py``.
    """
    exercises = exercise_folders.current_exercises()
    require_exercise(name)
    exercise_folders.exercise_file(name, exercise_folders.EXAM)
    if name not in exercises.own:
        exam: Exam[Any] = importlib.import_module(f"autograder.exercises.{name}.exam").EXAM
        return exam
    with _importing:
        _stand_for(exercises)
        return _exam_of_module(_import_own(f"{COURSE_PACKAGE}.{name}.exam", exercises), name)


def require_sound(name: str) -> None:
    """Require that an exercise has an exam which its points fit, unless people alone grade it.

    Raises:
        ExamError, ExerciseError: it has none, or that does not load, or they do not fit.
    """
    if points.table()[name].parts:
        load_exam(name).require_points()


def where_to_read(name: str) -> dict[str, str]:
    """Return where each check of an exercise's exam says to read on; {} if it has no checks."""
    if not points.table()[name].parts:
        return {}
    return {check.name: check.read for check in load_exam(name).checks.values()}


def require_exercise(name: str) -> None:
    """Raise ExamError if there is no exercise called ``name``; it names the ones there are."""
    if name not in exercise_names():
        nowhere = exercise_folders.current_exercises().root is None
        own = " No folder exercises/ of a course's own is here." if nowhere else ""
        raise ExamError(
            f"There is no exam '{name}': there are {', '.join(exercise_names())}."
            f"{did_you_mean(name, exercise_names())}{own}"
        )


def _import_own(module: str, exercises: Exercises) -> ModuleType:
    """Import a module of the course root's, of which the author is not one of ours."""
    try:
        return importlib.import_module(module)
    except ExamError:
        raise
    except Exception as error:
        where = [
            f"{frame.filename}, line {frame.lineno}"
            for frame in traceback.extract_tb(error.__traceback__)
            if Path(frame.filename).is_relative_to(exercises.root or "")
        ]
        said = str(error)
        if isinstance(error, SyntaxError):  # its text says where, too
            said = error.msg
            where.append(f"{error.filename}, line {error.lineno}")
        raise ExamError(
            f"The exam cannot be loaded: {type(error).__name__}: {said}, in "
            f"{where[-1] if where else module}. Mend it there."
        ) from error


def _exam_of_module(module: Any, name: str) -> Exam[Any]:
    exam = getattr(module, "EXAM", None)
    if not isinstance(exam, Exam) or exam.name != name:
        raise ExamError(f"{module.__file__} must make its exam with EXAM = Exam('{name}', ...).")
    return exam


def _stand_for(exercises: Exercises) -> None:
    """Have `COURSE_PACKAGE` be the folder of these, and forget modules of another one."""
    global _imported
    if _imported is exercises:
        return
    for module in [m for m in sys.modules if f"{m}.".startswith(f"{COURSE_PACKAGE}.")]:
        del sys.modules[module]
    assert exercises.root is not None
    spec = ModuleSpec(COURSE_PACKAGE, None, is_package=True)
    spec.submodule_search_locations = [str(exercises.root / FOLDER)]
    importlib.invalidate_caches()
    sys.modules[COURSE_PACKAGE] = importlib.util.module_from_spec(spec)
    _imported = exercises
