"""Writes the folder with a hub's configuration."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

from autograder.hub import hub_settings
from course.errors import CourseError

TEMPLATE = Path(__file__).parent / "files"
"""The folder's files: each ends in .txt, as none of them is a module here."""

EXCHANGE = Path("/srv/nbgrader/exchange")
"""Where the exchange of a hub is, unless its instructor says otherwise."""

_PRIVATE = 0o600
"""Rights of ``hub.toml``: who takes a course is nobody else's business."""


class NewHubError(CourseError):
    """A hub's folder that cannot be made; the message says why, and what to do."""


def make_hub(folder: Path, exchange: Path = EXCHANGE, python: Path | None = None) -> Path:
    """Write a JupyterHub configuration into a folder that is new or empty; return it.

    Args:
        folder: where to; everybody must be able to enter it.
        exchange: nbgrader's exchange of this hub; it is not made here.
        python: the Python that users work with; this one if left out.

    Raises:
        NewHubError: there is something in the folder, or it cannot be written.
    """
    values = {
        "@EXCHANGE@": str(exchange.expanduser().absolute()),
        "@PYTHON@": str(python or Path(sys.executable).absolute()),
    }
    try:
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise NewHubError(f"{folder} is not empty: choose a folder that is not there yet.")
        for file in sorted(TEMPLATE.rglob("*.txt")):
            target = folder / file.relative_to(TEMPLATE).with_suffix("")
            target.parent.mkdir(parents=True, exist_ok=True)
            text = file.read_text(encoding="utf-8")
            for name, value in values.items():
                text = text.replace(name, value)
            target.write_text(text, encoding="utf-8")
        (folder / hub_settings.FILE).chmod(_PRIVATE)
        shutil.copyfile(hub_settings.__file__, folder / "hub_settings.py")
    except OSError as error:
        raise NewHubError(
            f"{folder} cannot be written ({error.strerror or error}): make room there, or choose "
            "another folder."
        ) from error
    return folder.resolve()
