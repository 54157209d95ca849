"""Build the notebooks from their text sources (jupytext py:percent), always byte for byte alike.

``authoring/chapters/NAME.py`` becomes ``chapters/NAME.ipynb``, and each text of an assignment (see
`autograder.assignments.listing`) becomes ``source/ASSIGNMENT/NAME.ipynb``, with what belongs beside
it. What is built is committed, so `build` with ``check=True`` proves that it is in step.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import jupytext
import nbformat
from nbformat import NotebookNode

from autograder.assignments import cells, listing
from autograder.assignments.cells import AssignmentBuildError
from autograder.assignments.submission import grade_id
from autograder.util import exercise_folders
from course.util.files import replace_file

SOLUTIONS_TAG = "solutions"
"""Tag of the chapters' cells that only an instructor's build keeps."""

_METADATA = {
    "kernelspec": {"display_name": "Python 3 (ipykernel)", "language": "python", "name": "python3"},
    "language_info": {
        "file_extension": ".py",
        "mimetype": "text/x-python",
        "name": "python",
        "pygments_lexer": "ipython3",
    },
}

__all__ = ["AssignmentBuildError", "build", "build_assignment", "build_chapter", "to_text"]


def build(
    root: Path,
    *,
    check: bool = False,
    with_solutions: bool = False,
    points: Mapping[str, float] | None = None,
) -> list[Path]:
    """Build every chapter and assignment of the course at ``root``; return the files.

    Args:
        root: the nbgrader course root, with the text sources in ``authoring``.
        check: write nothing, only compare.
        with_solutions: keep the chapters' cells tagged "solutions".
        points: points by grade id, in place of the exercises' ``points.toml`` and of quizzes.

    Raises:
        AssignmentBuildError: a source is not sound, there is none, a file cannot be written, or
            (``check``) some are not in step, or have no source. A source that is not sound leaves
            all as it was.
        ExerciseError: an exercise of the course is not sound.
        QuizMarksError, QuizSheetError: a quiz that it uses is not sound, or cannot be handed out.
    """
    with exercise_folders.of_course(root):
        if points is None:
            from autograder.assignments import quiz_cells
            from autograder.examination import points as exams

            points = exams.of_grade_cells() | quiz_cells.of_grade_cells(root)
        built = dict(_build_files(root, points, with_solutions))
    if not built:
        raise AssignmentBuildError(
            f"There is nothing to build: no chapters and assignments in {root / 'authoring'}."
        )
    stale = [path for path, content in built.items() if _read_content(path) != content]
    if check:
        _require_in_step(root, stale, find_orphans(root, built))
    for path in stale:
        _write_file(path, built[path])
    return list(built)


PLACES = (
    "chapters/*.ipynb", "source/*/*.ipynb", "release/*/*.ipynb", "source/*/exercises/*/*",
    "release/*/exercises/*/*", "source/*/*.svg", "release/*/*.svg",
)  # fmt: skip
"""Where a course has what is built, and what was released of it."""


def find_orphans(root: Path, built: Iterable[Path]) -> list[Path]:
    """Return the notebooks, exams and pictures of a course that are none of those ``built``.

    They lost their source.

    Of the releases, too: students would still get an exercise that is gone.
    """
    made = {path.relative_to(root) for path in built}
    made |= {Path("release", *path.parts[1:]) for path in made if path.parts[0] == "source"}
    found = (path for pattern in PLACES for path in sorted(root.glob(pattern)) if path.is_file())
    return [path for path in found if path.relative_to(root) not in made]


def _require_in_step(root: Path, stale: list[Path], orphaned: list[Path]) -> None:
    problems = []
    if stale:
        problems.append(
            f"Not in step with the sources in {root / 'authoring'}: {_list_paths(root, stale)}; "
            "run `autograder build`."
        )
    if orphaned:
        problems.append(
            f"Without a source in {root / 'authoring'} or an exercise: "
            f"{_list_paths(root, orphaned)}; "
            "remove what is no part of the course any more, or put its source back."
        )
    if problems:
        raise AssignmentBuildError(" ".join(problems))


def _list_paths(root: Path, paths: Iterable[Path]) -> str:
    return ", ".join(str(path.relative_to(root)) for path in paths)


def build_assignment(
    source: str, points: Mapping[str, float], *, name: str = "the assignment"
) -> NotebookNode:
    """Return the instructor's version of an assignment, solutions and hidden tests included.

    Args:
        source: py:percent text whose cells carry nbgrader's metadata.
        points: points by grade id; they always win over what the source says.
        name: what errors call the source.

    Raises:
        AssignmentBuildError: the metadata are not what nbgrader needs; names ``name`` and the cell.
    """
    notebook = _parse_source(source, name)
    cells.fill_points(notebook, points)
    cells.validate_assignment(notebook, name)
    return _finish_notebook(notebook, name)


def build_chapter(
    source: str, *, with_solutions: bool = False, name: str = "the chapter"
) -> NotebookNode:
    """Return a chapter's notebook from its py:percent text.

    Raises:
        AssignmentBuildError: ``source`` is not py:percent text; names ``name``.
    """
    notebook = _parse_source(source, name)
    if not with_solutions:
        notebook.cells = [
            cell for cell in notebook.cells if SOLUTIONS_TAG not in cell.metadata.get("tags", [])
        ]
    return _finish_notebook(notebook, name)


def to_text(notebook: NotebookNode) -> str:
    """Return the text of a notebook's file, the same for equal notebooks."""
    text: str = nbformat.writes(notebook)  # type: ignore[no-untyped-call]
    return text.rstrip("\n") + "\n"


def _build_files(
    root: Path, points: Mapping[str, float], with_solutions: bool
) -> Iterator[tuple[Path, bytes]]:
    from autograder.assignments import quiz_sheets

    for path in sorted((root / "authoring" / "chapters").glob("*.py")):
        name = _relative_name(root, path)
        notebook = build_chapter(_read_source(path), with_solutions=with_solutions, name=name)
        yield root / "chapters" / f"{path.stem}.ipynb", to_text(notebook).encode()
    for assignment in listing.of_course(root).values():
        folder = root / "source" / assignment.name
        for file_name, path in assignment.texts.items():
            notebook = build_assignment(_read_source(path), points, name=_relative_name(root, path))
            yield folder / f"{file_name}.ipynb", to_text(notebook).encode()
            for file, content in quiz_sheets.of_notebooks(root, [notebook]).items():
                yield folder / file, content
        files = listing.exam_files(assignment) | listing.picture_files(assignment)
        for file, content in files.items():
            yield folder / file, content


def _relative_name(root: Path, path: Path) -> str:
    return str(path.relative_to(root) if path.is_relative_to(root) else path)


def _read_source(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeError) as error:
        raise AssignmentBuildError(f"{path} cannot be read as UTF-8 text: {error}.") from error


def _read_content(path: Path) -> bytes | None:
    try:
        return path.read_bytes()
    except FileNotFoundError:
        return None
    except OSError as error:
        raise AssignmentBuildError(f"{path} cannot be read: {error}.") from error


def _write_file(path: Path, content: bytes) -> None:
    """Replace a file's content in one step: a full disk must not leave half a notebook."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with replace_file(path) as file:
            file.write(content)
    except OSError as error:
        raise AssignmentBuildError(
            f"{path} cannot be written ({error.strerror or error}): make room there, or name a "
            "folder of your own with --root."
        ) from error


def _parse_source(source: str, name: str) -> NotebookNode:
    try:
        notebook: NotebookNode = jupytext.reads(source, fmt="py:percent")
    except (ValueError, SyntaxError) as error:
        raise AssignmentBuildError(f"{name} is not a py:percent notebook: {error}.") from error
    if not notebook.cells:
        raise AssignmentBuildError(
            f"{name} has no cells: it must begin its cells with `# %%` lines."
        )
    return notebook


def _finish_notebook(notebook: NotebookNode, name: str) -> NotebookNode:
    """Return a clean notebook: our cell ids, our metadata, nothing of jupytext's."""
    seen: dict[str, int] = {}
    finished_cells = [_finish_cell(cell, seen) for cell in notebook.cells]
    data = {"cells": finished_cells, "metadata": _METADATA, "nbformat": 4, "nbformat_minor": 5}
    finished: NotebookNode = nbformat.from_dict(data)  # type: ignore[no-untyped-call]
    try:
        nbformat.validate(finished)
    except nbformat.ValidationError as error:
        raise AssignmentBuildError(
            f"{name} makes no valid notebook: {str(error).splitlines()[0]}"
        ) from error
    return finished


def _finish_cell(cell: NotebookNode, seen: dict[str, int]) -> dict[str, Any]:
    kept = {key: value for key, value in cell.metadata.items() if key != "lines_to_next_cell"}
    finished = {
        "cell_type": cell.cell_type,
        "id": _cell_id(cell, seen),
        "metadata": kept,
        "source": cell.source,
    }
    if cell.cell_type == "code":
        finished |= {"execution_count": None, "outputs": []}
    return finished


def _cell_id(cell: NotebookNode, seen: dict[str, int]) -> str:
    """Return the grade id, or a digest of the content: adding a cell changes no other's id."""
    if name := grade_id(cell):
        return name
    digest = hashlib.sha256(f"{cell.cell_type}\0{cell.source}".encode()).hexdigest()[:12]
    seen[digest] = seen.get(digest, 0) + 1
    return digest if seen[digest] == 1 else f"{digest}-{seen[digest]}"
