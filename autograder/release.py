"""Make the student version of an assignment with nbgrader, and prove that nothing leaks."""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path

import nbformat
from nbformat import NotebookNode

from autograder import cells
from autograder.submission import grade_id, metadata
from course.errors import CourseError


class ReleaseError(CourseError):
    """An assignment that cannot be released; the message says why and what to do."""


def release(root: Path, assignment: str) -> Path:
    """Write the student version of ``assignment`` to ``release/``; return its folder.

    The release holds the notebooks, the questions of closed quizzes, and nothing else. One that
    would give away a solution or a hidden test is removed again.

    Args:
        root: the nbgrader course root.
        assignment: a folder name under ``source``.

    Raises:
        ReleaseError: no such assignment, files in it that students must not get, or a leak.
        QuizMarksError, QuizSheetError: a quiz that it uses is not sound, or cannot be handed out.
        GradebookError: nbgrader could not do it.
    """
    from autograder.gradebook import CourseGradebook

    source, released = root / "source" / assignment, root / "release" / assignment
    beside = _check_source(root, assignment)
    CourseGradebook(root).generate_assignment(assignment)
    if found := leaks(source, released, beside):
        _remove(released)
        raise ReleaseError(
            f"The release of '{assignment}' was removed again, because {found[0]}: correct "
            f"authoring/assignments/{assignment}, then build and release again."
        )
    return released


def leaks(source: Path, released: Path, beside: Mapping[Path, bytes] | None = None) -> list[str]:
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
        notebook = _read(released / name)
        secret = _secret_lines(_read(source / name))
        found += [f"{name}, {phrase}" for phrase in _notebook_leaks(notebook, secret)]
    return found


def _read(path: Path) -> NotebookNode:
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
        data = metadata(cell)
        # nbgrader replaces the whole of a solution cell that marks no region.
        whole = bool(data.get("solution")) and not cells.has_marker(cell.source)
        for marker, line in cells.regions(cell.source):
            (secret if whole or marker else given).add(line.strip())
    return secret - given - {""}


def _check_source(root: Path, assignment: str) -> dict[Path, bytes]:
    """Return what belongs beside the notebooks of an assignment that can be released."""
    from autograder import quiz_sheets

    folder = root / "source" / assignment
    known = sorted({p.parent.name for p in (root / "source").glob("*/*.ipynb")})
    authored = {p.parent.name for p in (root / "authoring" / "assignments").glob("*/*.py")}
    if assignment in authored and assignment not in known:
        raise ReleaseError(
            f"The assignment '{assignment}' has not been built: run `autograder build` first."
        )
    if assignment not in known:
        raise ReleaseError(
            f"There is no assignment '{assignment}' in {root}: there are "
            f"{', '.join(sorted(authored | set(known))) or 'none yet'}."
        )
    notebooks = [_read(path) for path in sorted(folder.glob("*.ipynb"))]
    beside = quiz_sheets.of_notebooks(root, notebooks)
    for name, content in beside.items():
        if not (folder / name).is_file() or (folder / name).read_bytes() != content:
            raise ReleaseError(
                f"{folder / name} is not in step with the quiz: run `autograder build` first."
            )
    # nbgrader would hand out whatever else lies there.
    for path in sorted(folder.rglob("*")):
        if path.is_file() and path.suffix != ".ipynb" and path.relative_to(folder) not in beside:
            raise ReleaseError(
                f"{path} would be handed out to students: move it out of {folder}, which is for "
                "notebooks only."
            )
    return beside


def _remove(folder: Path) -> None:
    try:
        if folder.exists():
            shutil.rmtree(folder)
    except OSError as error:
        raise ReleaseError(
            f"{folder} cannot be replaced ({error.strerror or error}): remove it by hand."
        ) from error
