"""The modules of a package, without texts that only end like one."""

from __future__ import annotations

from pathlib import Path

from autograder.util import exercise_folders


def modules_of(package: Path) -> list[Path]:
    """Return the files of a package's modules: no text of a notebook, no submission of a corpus."""
    return [
        path for path in sorted(package.rglob("*.py"))
        if (path.parent / "__init__.py").is_file() and path.name != exercise_folders.TASK
    ]  # fmt: skip
