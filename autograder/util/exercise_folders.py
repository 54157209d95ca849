"""Where the exercises are: a folder each, in the package and in a course root's ``exercises/``.

A folder is an exercise if it has one of the first three of these, and its name is the exercise's:

- ``task.py``: the notebook as text, with solutions, hidden tests and answer keys;
- ``exam.py``: the checks; other modules beside it are what only they need;
- ``points.toml``: what each check and each written answer is worth;
- ``objectives.toml``: what each of them shows about a learner;
- ``picture.svg``: what its notebook shows at the top;
- ``corpus/``: submissions with known verdicts; ``design.md``: what the checks are for.

One course root at a time has its exercises among them: `use_course` and `of_course` say which.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from course.errors import CourseError

TASK, EXAM, POINTS = "task.py", "exam.py", "points.toml"
OBJECTIVES, PICTURE, CORPUS = "objectives.toml", "picture.svg", "corpus"
FOLDER = "exercises"
"""The folder of a course root, and of an assignment that is handed out, with exercises."""

COURSE_PACKAGE = "course_exercises"
"""The Python package that stands for that folder of the course root in use."""

PACKAGE = Path(__file__).resolve().parents[1]
EVERY = PACKAGE / "corpus" / "every"
"""The cases that are in each exercise's corpus."""

TABLE = PACKAGE / "corpus" / "README.md"
"""Which cases each check must catch, and which designs are right."""

DEMO_CLASS = PACKAGE / "commands" / "demo_class.toml"
"""What the class of ``autograder demo`` hands in."""

NEW_EXERCISE = PACKAGE / "commands" / "new_exercise"
"""What ``autograder new exercise`` makes one of, with its solution."""


class ExerciseError(CourseError):
    """An exercise's folder that cannot be used; the message says what to change."""


class Exercises:
    """The exercises there are: those of the package, and those of one course root.

    Attributes:
        root: the course root, if it has some of its own.
        folders: {name: folder}, in the order of the names.
        own: the names of the course root's own.
    """

    def __init__(self, root: Path | None) -> None:
        """Look for them.

        Raises:
            ExerciseError: one of the course root has a name that it cannot have.
        """
        packaged = _find_exercises(PACKAGE / FOLDER)
        try:
            found = _find_exercises(root / FOLDER) if root else {}
            self._state = [(name, _changed_ns(folder)) for name, folder in sorted(found.items())]
        except OSError as error:
            raise _unreadable_error(error) from None
        for name, folder in found.items():
            if not name.isidentifier():
                raise ExerciseError(
                    f"The exercise {folder} cannot be called '{name}': give its folder a name of "
                    "letters, digits and underscores, as a Python module has."
                )
            if name in packaged:
                raise ExerciseError(
                    f"The exercise {folder} has the name of one that comes with the course: give "
                    "its folder another name."
                )
        self.root = root if found else None
        self.own = frozenset(found)
        self.folders: Mapping[str, Path] = dict(sorted({**packaged, **found}.items()))

    def is_like(self, other: Exercises) -> bool:
        """Whether these are the same folders, with the same files as they were read."""
        return (self.root, self._state) == (other.root, other._state)


_current: Exercises | None = None


def current_exercises() -> Exercises:
    """Return the exercises of the package and of the course root in use.

    What is read of them may be kept for as long as this is the same object.
    """
    global _current
    if _current is None:
        _current = Exercises(None)
    return _current


def packaged_names() -> frozenset[str]:
    """Return the names of those that come with the course."""
    exercises = current_exercises()
    return frozenset(exercises.folders.keys() - exercises.own)


def use_course(root: Path | None) -> None:
    """Have the exercises of the course at ``root`` among them, in place of another course's.

    Raises:
        ExerciseError: one of them has a name that it cannot have.
    """
    global _current
    found = Exercises(root.resolve() if root else None)
    if not found.is_like(current_exercises()):
        _current = found


@contextmanager
def of_course(root: Path) -> Iterator[None]:
    """Have the exercises of the course at ``root`` among them for the block.

    It raises as `use_course`.
    """
    global _current
    before = current_exercises()
    use_course(root)
    try:
        yield
    finally:
        _current = before


def exercise_file(name: str, part: str) -> Path:
    """Return a file of an exercise that there is.

    Raises:
        ExerciseError: it does not have it.
    """
    path = current_exercises().folders[name] / part
    if not path.is_file():
        raise ExerciseError(f"The exercise '{name}' has no {part}: write {path}.")
    return path


def exam_files(folder: Path) -> dict[str, bytes]:
    """Return {file name: content} of what an exercise's exam needs: modules and points.

    It is what students may have: no text of the notebook, and no corpus.

    Raises:
        ExerciseError: one of them cannot be read.
    """
    paths = [path for path in (*sorted(folder.glob("*.py")), folder / POINTS) if _is_needed(path)]
    try:
        return {path.name: path.read_bytes() for path in paths if path.is_file()}
    except OSError as error:
        raise _unreadable_error(error) from None


def _is_needed(path: Path) -> bool:
    """Whether an exam needs a file: no copy that an editor has made, which no import names."""
    is_module = path.suffix == ".py" and path.stem.isidentifier() and path.name != TASK
    return is_module or path.name == POINTS


def own_exam_files(names: Iterable[str]) -> dict[str, bytes]:
    """Return {path in a course root: content} of what those of these exams need that are its own.

    A folder with these files can be used as a course root.
    """
    exercises = current_exercises()
    return {
        f"{FOLDER}/{name}/{file}": content
        for name in sorted(exercises.own.intersection(names))
        for file, content in exam_files(exercises.folders[name]).items()
    }


def kept_from_students(package: Path = PACKAGE) -> Iterator[Path]:
    """Yield the files and folders of the package that no submission may see.

    Of an exercise's folder these are all but what its exam needs, and what it is worth, also if it
    has no exam yet. An installer may have compiled the text of a notebook, too.
    """
    folders = (package / FOLDER).iterdir()
    for folder in sorted(path for path in folders if path.is_dir() and path.name != "__pycache__"):
        for entry in sorted(folder.iterdir()):
            if entry.name == "__pycache__":
                yield from sorted(entry.glob("task.*"))
            elif not _is_needed(entry) and entry.name != OBJECTIVES:
                yield entry
    kept = (EVERY, TABLE, DEMO_CLASS, NEW_EXERCISE)
    yield from (package / path.relative_to(PACKAGE) for path in kept)


def read_picture(name: str) -> bytes | None:
    """Return the picture of an exercise that there is, as SVG; None if it has none.

    Raises:
        ExerciseError: it cannot be read.
    """
    try:
        return (current_exercises().folders[name] / PICTURE).read_bytes()
    except FileNotFoundError:
        return None
    except OSError as error:
        raise _unreadable_error(error) from None


def _unreadable_error(error: OSError) -> ExerciseError:
    return ExerciseError(
        f"{error.filename} cannot be read ({error.strerror}): mend its permissions."
    )


def _find_exercises(folder: Path) -> dict[str, Path]:
    return {
        entry.name: entry
        for entry in (sorted(folder.iterdir()) if folder.is_dir() else ())
        if entry.is_dir() and not entry.name.startswith((".", "_")) and _is_exercise(entry)
    }


def _is_exercise(folder: Path) -> bool:
    return any((folder / part).is_file() for part in (EXAM, POINTS, TASK))


def _changed_ns(folder: Path) -> list[tuple[str, int]]:
    files = (path for path in sorted(folder.iterdir()) if path.is_file())
    return [(path.name, path.stat().st_mtime_ns) for path in files]
