"""The student version of an assignment: what nbgrader releases, made without a gradebook."""

from __future__ import annotations

import logging
import warnings
from pathlib import Path

import nbformat
from nbformat import NotebookNode
from traitlets.config import Config
from traitlets.config.loader import PyFileConfigLoader

from course.workspace.content import CONFIG, ContentError


def student_versions(root: Path) -> dict[Path, str]:
    """Return {ASSIGNMENT/NAME.ipynb: text} of every assignment built at ``root``.

    Args:
        root: the nbgrader course root, with the instructor's notebooks in ``source``.

    Raises:
        ContentError: an instructor's notebook cannot be read, or nbgrader refuses it.
    """
    paths = sorted((root / "source").glob("*/*.ipynb"))
    if not paths:
        return {}
    config = _read_config(root)
    return {path.relative_to(root / "source"): _student_version(path, config) for path in paths}


def _read_config(root: Path) -> Config:
    try:
        return Config(PyFileConfigLoader(CONFIG, path=str(root)).load_config())
    except OSError as error:
        raise ContentError(
            f"{root / CONFIG} cannot be read ({error}): install ros2-course again."
        ) from error


def _student_version(path: Path, config: Config) -> str:
    from nbgrader.converters import GenerateAssignment
    from nbgrader.preprocessors import SaveCells

    with warnings.catch_warnings(), _quiet():
        warnings.simplefilter("ignore")  # nbgrader's own deprecations are no news for a student
        try:
            notebook: NotebookNode = nbformat.read(path, as_version=4)  # type: ignore[no-untyped-call]
            resources = {"unique_key": path.stem}
            for step in GenerateAssignment().preprocessors:
                if step is not SaveCells:  # it writes to the gradebook, which students do not have
                    notebook, resources = step(config=config).preprocess(notebook, resources)
        except (OSError, ValueError, RuntimeError, nbformat.ValidationError) as error:
            raise ContentError(
                f"The student version of {path} cannot be made ({str(error)[:160]}): build the "
                "notebooks again with `autograder build`, or install ros2-course again."
            ) from error
    text: str = nbformat.writes(notebook)  # type: ignore[no-untyped-call]
    return text.rstrip("\n") + "\n"


class _quiet:  # noqa: N801 - a context manager, read like a function
    """Keep the log of nbgrader's steps off the screen: our own error says what matters."""

    def __enter__(self) -> None:
        self._level = logging.root.manager.disable
        logging.disable(logging.CRITICAL)

    def __exit__(self, *_: object) -> None:
        logging.disable(self._level)
