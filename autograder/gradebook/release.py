"""Make the student version of an assignment with nbgrader, and prove that nothing leaks."""

from __future__ import annotations

import shutil
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import nbformat
from nbformat import NotebookNode

from autograder.assignments import cells
from autograder.assignments.submission import grade_id, nbgrader_metadata
from autograder.util import exercise_folders
from autograder.util.work_files import NOT_COUNTED
from course.errors import CourseError
from course.util.files import PARTIAL

_OLD_S = 600.0
"""Seconds after which a folder that a release was made in belongs to nobody."""


class ReleaseError(CourseError):
    """An assignment that cannot be released; the message says why and what to do."""


def make_release(root: Path, assignment: str) -> Path:
    """Write the student version of ``assignment`` to ``release/``; return its folder.

    The release holds the notebooks, the pictures of their exercises, the questions of closed
    quizzes, the exams of the course's own exercises, and nothing else. It is made beside the
    earlier one, with a copy of the gradebook, and takes its place before the gradebook itself is
    changed; if that fails after all, the earlier one stands again. So a release that fails leaves
    everything as it was.

    Args:
        root: the nbgrader course root.
        assignment: a folder name under ``source``.

    Raises:
        ReleaseError: no such assignment, files in it that students must not get, a leak, or
            nbgrader cannot make it.
        QuizMarksError, QuizSheetError: a quiz that it uses is not sound, or cannot be handed out.
        ExerciseError: an exercise of the course is not sound.
        GradebookError: there is no course at ``root``.
        GradebookUnusable: its gradebook cannot be used.
    """
    from autograder.gradebook.course_gradebook import CourseGradebook, GradebookError

    source, released = root / "source" / assignment, root / "release" / assignment
    with exercise_folders.of_course(root):
        beside = _check_source(root, assignment)
    with _place_beside(released) as place:
        try:
            # First with a copy of the gradebook: nbgrader changes it notebook by notebook.
            CourseGradebook(root, trial=place).generate_assignment(assignment)
            if found := find_leaks(source, place / assignment, beside):
                raise ReleaseError(
                    f"'{assignment}' is not released, because in the release {found[0]}: correct "
                    "the text that it is built from, then build and release again."
                    f"{_as_before(released)}"
                )
            with _in_place(place / assignment, released, place):
                # For the gradebook: nbgrader enters an assignment only by making its release.
                CourseGradebook(root, released=place).generate_assignment(assignment)
        except GradebookError as error:
            if not error.reason:
                raise
            raise ReleaseError(
                f"'{assignment}' is not released, because nbgrader says: {error.reason.rstrip('.')}"
                f": {_way_out(error.reason, assignment)}{_as_before(released)}"
            ) from error
    return released


def find_leaks(
    source: Path, released: Path, beside: Mapping[Path, bytes] | None = None
) -> list[str]:
    """Return what a released assignment gives away or lacks, one phrase each; empty if sound.

    Args:
        source: folder of the instructor's notebooks.
        released: folder of the students' notebooks.
        beside: {path in it: content} of what else belongs there.
    """
    names = {path.name for path in source.glob("*.ipynb")}
    files = {str(path.relative_to(released)) for path in released.rglob("*") if path.is_file()}
    changed = []
    for path, content in (beside or {}).items():
        if str(path) not in files:
            names.add(str(path))
            continue
        files.remove(str(path))
        if (released / path).read_bytes() != content:
            changed.append(f"{path} in it is not what was built")
    found = changed + [f"it holds the file {name}" for name in sorted(files - names)]
    found += [f"{name} is missing from it" for name in sorted(names - files)]
    for name in sorted(names & files):
        notebook = _read_notebook(released / name)
        secret = _secret_lines(_read_notebook(source / name))
        found += [f"{name}, {phrase}" for phrase in _notebook_leaks(notebook, secret)]
    return found


def _read_notebook(path: Path) -> NotebookNode:
    try:
        notebook: NotebookNode = nbformat.read(path, as_version=4)  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:
        raise ReleaseError(
            f"{path} is not a notebook that can be read ({str(error)[:120]}): build it again with "
            "`autograder build`."
        ) from error
    return notebook


def _notebook_leaks(notebook: NotebookNode, secret: set[str]) -> Iterator[str]:
    for number, cell in enumerate(notebook.cells, start=1):
        where = f"cell {number} '{grade_id(cell)}'"
        if cells.has_marker(cell.source):
            yield f"{where} still marks a solution or hidden tests"
        for line in cell.source.splitlines():
            if line.strip() in secret:
                yield f"{where} shows the line {line.strip()!r} of a solution or hidden test"
        if cell.get("outputs"):
            yield f"{where} has outputs"


def _secret_lines(source: NotebookNode) -> set[str]:
    """Return the lines that only solutions and hidden tests have in the instructor's notebook."""
    secret: set[str] = set()
    given: set[str] = set()
    for cell in source.cells:
        data = nbgrader_metadata(cell)
        # nbgrader replaces the whole of a solution cell that marks no region.
        whole = bool(data.get("solution")) and not cells.has_marker(cell.source)
        for marker, line in cells.marked_lines(cell.source):
            (secret if whole or marker else given).add(line.strip())
    return secret - given - {""}


def _check_source(root: Path, assignment: str) -> dict[Path, bytes]:
    """Return what belongs beside the notebooks of an assignment that can be released."""
    from autograder.assignments import listing, quiz_sheets

    folder = root / "source" / assignment
    known = sorted({p.parent.name for p in (root / "source").glob("*/*.ipynb")})
    authored = listing.assignment_names(root)
    if assignment in authored and assignment not in known:
        raise ReleaseError(
            f"The assignment '{assignment}' has not been built: run `autograder build` first."
        )
    if assignment not in known:
        raise ReleaseError(
            f"There is no assignment '{assignment}' in {root}: there are "
            f"{', '.join(sorted(authored | set(known))) or 'none yet'}."
        )
    paths = sorted(folder.glob("*.ipynb"))
    listed = listing.read_assignment(root, assignment) if assignment in authored else None
    orphans = [path for path in paths if listed is not None and path.stem not in listed.texts]
    if orphans:
        raise ReleaseError(
            f"{orphans[0]} is none of the notebooks of '{assignment}' in "
            f"{root / listing.ASSIGNMENTS}: remove it, or list its exercise there, then build and "
            "release again."
        )
    notebooks = [_read_notebook(path) for path in paths]
    exams = listing.exam_files(listed) if listed is not None else {}
    for name, content in exams.items():
        if cells.has_marker(content.decode(errors="replace")):
            raise ReleaseError(
                f"{name} marks a solution or hidden tests, and students would get it with the exam "
                f"of its exercise: move it out of the folder {root / name.parent}."
            )
    pictures = listing.picture_files(listed) if listed is not None else {}
    beside = quiz_sheets.of_notebooks(root, notebooks) | exams | pictures
    for name, content in beside.items():
        if not (folder / name).is_file() or (folder / name).read_bytes() != content:
            of_what = "exercise" if name in exams or name in pictures else "quiz"
            raise ReleaseError(
                f"{folder / name} is not in step with the {of_what}: run `autograder build` first."
            )
    # nbgrader would hand out whatever else lies there.
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder)
        if NOT_COUNTED.intersection(name.parts):
            continue  # nor does nbgrader
        if path.is_file() and path.suffix != ".ipynb" and name not in beside:
            raise ReleaseError(
                f"{path} would be handed out to students: move it out of {folder}, which is for "
                "notebooks only."
            )
    return beside


def _as_before(released: Path) -> str:
    return " The earlier release stands as it was." if released.exists() else ""


def _way_out(reason: str, assignment: str) -> str:
    """Return what to do about something that nbgrader says."""
    if "submissions associated with it" in reason:
        return (
            "notebooks and graded cells stay as they are once work has been graded, so undo that "
            f"change, or release it as an assignment of another name; `nbgrader db assignment "
            f"remove {assignment} --force` would also do, but loses its marks and due date."
        )
    return "correct the texts of the assignment, then build and release again."


@contextmanager
def _place_beside(released: Path) -> Iterator[Path]:
    """Give a hidden folder beside a release for the block, and remove it afterwards."""
    prefix, suffix = f".{released.name}.", PARTIAL
    try:
        released.parent.mkdir(parents=True, exist_ok=True)
        for left in released.parent.glob(f"{prefix}*{suffix}"):  # by a killed process
            if time.time() - left.stat().st_mtime > _OLD_S:
                shutil.rmtree(left, ignore_errors=True)
        folder = tempfile.TemporaryDirectory(suffix, prefix, released.parent)
    except OSError as error:
        raise _cannot_write(released.parent, error) from error
    with folder as name:
        yield Path(name)


@contextmanager
def _in_place(made: Path, released: Path, aside: Path) -> Iterator[None]:
    """Have a release that was ``made`` take the place of the earlier one.

    If the block fails, the earlier one stands there again: what was there is kept ``aside``.
    """
    earlier = aside / "earlier"
    try:
        if released.exists():
            released.rename(earlier)
        try:
            made.rename(released)
        except OSError:
            if earlier.exists():
                earlier.rename(released)
            raise
    except OSError as error:
        raise _cannot_write(released, error) from error
    try:
        yield
    except BaseException:
        released.rename(aside / "withdrawn")
        if earlier.exists():
            earlier.rename(released)
        raise


def _cannot_write(path: Path, error: OSError) -> ReleaseError:
    return ReleaseError(
        f"{path} cannot be replaced ({error.strerror or error}): make it writable, or make room "
        "there, then release again."
    )
