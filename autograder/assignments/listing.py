"""What each assignment of a course is made of: a few lines of TOML list its exercises and quizzes.

``authoring/assignments/NAME.toml`` says::

    exercises = ["qos", "patterns"]
    quizzes = ["quiz"]

Exercises are those of the package and those of the course root's ``exercises/``; the text of a quiz
is ``authoring/quizzes/NAME.py``. Notebooks that only one assignment has may also be texts in
``authoring/assignments/NAME/``; a folder of them needs no TOML.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from autograder.assignments.cells import AssignmentBuildError
from autograder.examination import points
from autograder.util import exercise_folders
from course.util.close_matches import did_you_mean

ASSIGNMENTS = Path("authoring") / "assignments"
QUIZZES = Path("authoring") / "quizzes"


@dataclass(frozen=True)
class Assignment:
    """An assignment: {notebook's name: its text}, in order, and the names of its exercises."""

    name: str
    texts: Mapping[str, Path]
    exercises: tuple[str, ...] = ()


def of_course(root: Path) -> dict[str, Assignment]:
    """Return {name: assignment} of the course at ``root``, whose exercises must be in use.

    Raises:
        AssignmentBuildError: a list is not sound, or names what there is not.
        ExerciseError: a table of points is not sound, or an exercise has no text.
    """
    return {name: read_assignment(root, name) for name in sorted(assignment_names(root))}


def exam_files(assignment: Assignment) -> dict[Path, bytes]:
    """Return {path in the assignment's folder: content} of exams that only the course root has.

    Students get them with the notebooks, so that a ``check("...")`` in these finds its exam.
    """
    files = exercise_folders.own_exam_files(assignment.exercises)
    return {Path(name): content for name, content in files.items()}


def picture_files(assignment: Assignment) -> dict[Path, bytes]:
    """Return {path in the assignment's folder: content} of its exercises' pictures.

    Each lies beside its exercise's notebook, under the notebook's name: ``NAME.svg``.

    Raises:
        ExerciseError: one of them cannot be read.
    """
    table = points.table()
    found = {
        Path(f"{table[exercise].notebook}.svg"): exercise_folders.read_picture(exercise)
        for exercise in assignment.exercises
    }
    return {path: content for path, content in found.items() if content is not None}


def assignment_names(root: Path) -> set[str]:
    """Return the names of the assignments that the course at ``root`` has texts for."""
    return _listed_names(root / ASSIGNMENTS)


def _listed_names(folder: Path) -> set[str]:
    lists = {path.stem for path in folder.glob("*.toml")}
    return lists | {path.parent.name for path in folder.glob("*/*.py")}


def write_list(root: Path, name: str, exercises: list[str]) -> None:
    """Write the list of an assignment of these exercises into the course at ``root``."""
    folder = root / ASSIGNMENTS
    folder.mkdir(parents=True, exist_ok=True)
    listed = ", ".join(f'"{exercise}"' for exercise in exercises)
    (folder / f"{name}.toml").write_text(f"exercises = [{listed}]\n", encoding="utf-8")


def add_exercise(root: Path, name: str, exercise: str) -> None:
    """Add an exercise to the list of an assignment, which is new or not; comments in it stay.

    Raises:
        AssignmentBuildError: its list is not sound.
        OSError: it cannot be written.
    """
    file = root / ASSIGNMENTS / f"{name}.toml"
    if not file.is_file():
        write_list(root, name, [exercise])
        return
    wanted = [*_read_list(file)["exercises"], exercise]
    text = file.read_text(encoding="utf-8")
    begin = re.search(r"^exercises\s*=\s*\[", text, re.MULTILINE)
    if begin is None:
        text = f'exercises = ["{exercise}"]\n{text}'
    else:
        end = text.index("]", begin.end())
        listed = text[begin.end() : end].rstrip()
        comma = "" if not listed or listed.endswith(",") else ","
        space = " " if listed else ""
        text = f'{text[: begin.end()]}{listed}{comma}{space}"{exercise}"{text[end:]}'
    try:
        added = tomllib.loads(text).get("exercises") == wanted
    except tomllib.TOMLDecodeError:
        added = False
    if not added:
        raise AssignmentBuildError(f"Please add '{exercise}' to the exercises in {file} yourself.")
    file.write_text(text, encoding="utf-8")


def read_assignment(root: Path, name: str) -> Assignment:
    """Return an assignment that the course has texts for; raises as `of_course`."""
    file = root / ASSIGNMENTS / f"{name}.toml"
    data = _read_list(file) if file.is_file() else {"exercises": [], "quizzes": []}
    texts: dict[str, Path] = {}
    for exercise in data["exercises"]:
        _require_known(
            exercise,
            list(exercise_folders.current_exercises().folders),
            f"{file} lists the exercise",
        )
        text = exercise_folders.exercise_file(exercise, exercise_folders.TASK)
        exercise_folders.exercise_file(exercise, exercise_folders.POINTS)
        _add_text(texts, points.table()[exercise].notebook, text, file)
    quizzes = {path.stem: path for path in sorted((root / QUIZZES).glob("*.py"))}
    for quiz in data["quizzes"]:
        _require_known(quiz, list(quizzes), f"{file} lists the quiz")
        _add_text(texts, quiz, quizzes[quiz], file)
    for path in sorted((root / ASSIGNMENTS / name).glob("*.py")):
        _add_text(texts, path.stem, path, path)
    if not texts:
        raise AssignmentBuildError(
            f"{file} lists nothing: exercises = ['…'] names what the assignment has."
        )
    return Assignment(name, texts, tuple(data["exercises"]))


def _read_list(file: Path) -> dict[str, list[str]]:
    try:
        data: dict[str, Any] = tomllib.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise AssignmentBuildError(f"{file} is no TOML: {error}.") from error
    listed = {"exercises": data.pop("exercises", []), "quizzes": data.pop("quizzes", [])}
    for key, names in listed.items():
        if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
            raise AssignmentBuildError(
                f"{file}: {key} must be a list of names, as in {key} = ['…']."
            )
    if data:
        raise AssignmentBuildError(
            f"{file} has a '{next(iter(data))}', which an assignment has not: it has lists of "
            "exercises and quizzes."
        )
    return listed


def _require_known(name: str, known: list[str], who: str) -> None:
    if name not in known:
        raise AssignmentBuildError(
            f"{who} '{name}', which does not exist. There is {', '.join(known) or 'none'}."
            f"{did_you_mean(name, known)}"
        )


def _add_text(texts: dict[str, Path], notebook: str, text: Path, file: Path) -> None:
    if notebook in texts:
        raise AssignmentBuildError(
            f"{file}: the notebook '{notebook}' would be there twice, from {texts[notebook]} and "
            f"from {text}: leave one of them out, or give it another name."
        )
    texts[notebook] = text
