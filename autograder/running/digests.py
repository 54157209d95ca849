"""What a verdict depends on beside the submission: digests of the code that comes to it.

An exam's verdict depends on its module, on the instruments that it imports, and on whatever runs a
subject and an examiner. So a digest covers the modules that these import, directly or not, and a
change of one exam lets the outcomes of the others stand. What is imported for annotations alone
changes nothing, and of the names that a package imports on demand only those count that are used.
Of an exercise's folder its text, its corpus and its design note change no verdict.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterable, Iterator
from functools import cache, lru_cache
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path

from autograder.examination import points
from autograder.util import exercise_folders
from autograder.util.exercise_folders import COURSE_PACKAGE, Exercises

PACKAGES = ("autograder", "course", "quizzes")
_RUNNING = (
    "autograder.running.runner",
    "autograder.examination.subject.process",
    "autograder.running.examiner",
)
"""Where the processes of a run begin; what they import is behind every verdict."""

GRADING = ("autograder.grading.submission_intake",)
"""Where outcomes become points and feedback."""

_EXERCISES = "autograder.exercises."

RUN_DATA = (".xml",)
"""Files beside the code that decide how a run goes: the settings of DDS."""

GRADING_DATA = (".yaml",)
"""The same for points: the banks of the quizzes."""


def of_exams(names: tuple[str, ...], root: Path | None = None) -> str:
    """Return a digest of everything that decides the verdicts of these exams.

    Args:
        names: sorted names of exams; none for a program that sits no exam.
        root: a folder with copies of the packages; the installed ones if left out.
    """
    return _of_exams(names, root, exercise_folders.current_exercises())


@lru_cache(maxsize=64)
def _of_exams(names: tuple[str, ...], root: Path | None, exercises: Exercises) -> str:
    worth = {
        name: points.read_points(file).parts for name, file in _points_files(names, root, exercises)
    }
    more = json.dumps(worth, sort_keys=True)
    return _Code(root, exercises).modules_digest(_of_run(names, exercises), RUN_DATA, more)


def _points_files(
    names: Iterable[str], root: Path | None, exercises: Exercises
) -> Iterator[tuple[str, Path]]:
    """Yield (exam, its table of points) for those of these exams that have one."""
    for name in names:
        if name in exercises.folders:
            folder = exercises.folders[name]
            if root and name not in exercises.own:
                folder = root / "autograder" / exercise_folders.FOLDER / name
            if (folder / exercise_folders.POINTS).is_file():
                yield name, folder / exercise_folders.POINTS


def of_grading(names: tuple[str, ...], root: Path | None = None) -> str:
    """Return a digest of what decides these exams' verdicts and turns them into grades."""
    return f"{of_exams(names, root)} {_of_grading(root)}"


@cache
def _of_grading(root: Path | None) -> str:
    return _Code(root).modules_digest(GRADING, GRADING_DATA)


def forget_code() -> None:
    """Read the code again for the next digest."""
    _of_exams.cache_clear()
    _of_grading.cache_clear()


def modules_of_exams(names: Iterable[str]) -> set[str]:
    """Return the modules that decide the verdicts of these exams."""
    exercises = exercise_folders.current_exercises()
    return _Code(None, exercises).import_closure(_of_run(names, exercises))


def _of_run(names: Iterable[str], exercises: Exercises) -> list[str]:
    """Return where the code of a run begins: of a course root's exercise, with all its modules."""
    begins = list(_RUNNING)
    for name in names:
        if name in exercises.own:
            begins += _own_modules(name, exercises)
        else:
            begins.append(f"autograder.exercises.{name}.exam")
    return begins


def _own_modules(name: str, exercises: Exercises) -> dict[str, Path]:
    folder = exercises.folders[name]
    return {
        f"{COURSE_PACKAGE}.{name}.{file.removesuffix('.py')}": folder / file
        for file in exercise_folders.exam_files(folder)
        if file.endswith(".py")
    }


class _Code:
    """The source of some packages, and what of them imports what."""

    def __init__(self, root: Path | None, exercises: Exercises | None = None) -> None:
        self._files: dict[str, Traversable] = {}
        self._data: list[Traversable] = []
        for name in PACKAGES:
            self._walk_package(name, root / name if root else resources.files(name))
        for name in exercises.own if exercises else ():
            self._files.update(_own_modules(name, exercises))  # type: ignore[arg-type]

    def modules_digest(self, modules: Iterable[str], data: tuple[str, ...], more: str = "") -> str:
        """Return a digest of these modules, of all that they import, of data, and of ``more``."""
        state = hashlib.sha256(more.encode())
        for name in sorted(self.import_closure(modules)):
            state.update(name.encode() + b"\0" + self._files[name].read_bytes())
        for file in (file for file in self._data if file.name.endswith(data)):
            state.update(file.name.encode() + b"\0" + file.read_bytes())
        return state.hexdigest()

    def import_closure(self, modules: Iterable[str]) -> set[str]:
        """Return these modules and all that they import, directly or not."""
        found: set[str] = set()
        waiting = list(modules)
        while waiting:
            name = waiting.pop()
            if name in found:
                continue
            if name in self._files:
                found.add(name)
                waiting += _imported_modules(name, self._files[name].read_bytes())
                continue
            package = name.rpartition(".")[0]
            if package in self._files:
                waiting += _on_demand(package, self._files[package].read_bytes()).get(name, ())
        return found

    def _walk_package(self, package: str, folder: Traversable) -> None:
        for entry in sorted(folder.iterdir(), key=lambda entry: entry.name):
            if entry.is_dir():
                if entry.name == exercise_folders.CORPUS and package.startswith(_EXERCISES):
                    continue
                self._walk_package(f"{package}.{entry.name}", entry)
            elif entry.name == "__init__.py":
                self._files[package] = entry
            elif entry.name.endswith(".py"):
                self._files[f"{package}.{entry.name[:-3]}"] = entry
            elif entry.name.endswith((*RUN_DATA, *GRADING_DATA)):
                self._data.append(entry)


_FROM = re.compile(r"^[ \t]*from[ \t]+([\w.]+)[ \t]+import[ \t]+(\([^)]*\)|.*)", re.MULTILINE)
_IMPORT = re.compile(r"^[ \t]*import[ \t]+(.*)", re.MULTILINE)
_NAME = re.compile(r"[\w.]+")
_BLOCK = r".*\n(?:[ \t].*\n|\n)*"
_FOR_TYPES = re.compile(rf"^if TYPE_CHECKING:{_BLOCK}", re.MULTILINE)
_GETATTR = re.compile(rf"^def __getattr__\({_BLOCK}", re.MULTILINE)


@cache
def _imported_modules(name: str, source: bytes) -> frozenset[str]:
    """Return what a module may import, its own packages included; too many names do no harm.

    Read from its lines: a syntax tree would keep each `autograder grade` from starting for longer.
    """
    text = _GETATTR.sub("", _FOR_TYPES.sub("", source.decode(errors="replace")))
    found = {name}
    for package, names in _FROM.findall(text):
        found |= {package, *(f"{package}.{imported}" for imported in _NAME.findall(names))}
    for names in _IMPORT.findall(text):
        found |= set(_NAME.findall(names))
    return frozenset(found | {parent for module in found for parent in _parent_packages(module)})


@cache
def _on_demand(package: str, source: bytes) -> dict[str, tuple[str, ...]]:
    """Return {name: what is imported for it} of the names that a package imports when asked."""
    text = source.decode(errors="replace")
    if not _GETATTR.search(text):
        return {}
    declared = _FROM.findall("".join(_FOR_TYPES.findall(text)))
    return {
        f"{package}.{name}": (module, f"{module}.{name}")
        for module, names in declared
        for name in _NAME.findall(names)
        if name != "as"
    }


def _parent_packages(name: str) -> Iterator[str]:
    while "." in name:
        name = name.rpartition(".")[0]
        yield name
