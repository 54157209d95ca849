"""The database under nbgrader."""

from __future__ import annotations

import sqlite3
import subprocess
from pathlib import Path

import pytest
from nbgrader.api import Gradebook
from nbgrader.dbutil import _temp_alembic_ini

import autograder.gradebook.database  # noqa: F401 - which tells nbgrader


def test_a_new_gradebook_has_the_newest_schema_and_starts_no_process_for_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "gradebook.db"
    with _temp_alembic_ini(f"sqlite:///{file}") as settings:
        said = subprocess.check_output(["alembic", "-c", settings, "heads"], text=True)
    with monkeypatch.context() as without_programs:
        without_programs.setenv("PATH", "")
        Gradebook(f"sqlite:///{file}").close()
    with sqlite3.connect(file) as opened:
        ((version,),) = opened.execute("SELECT version_num FROM alembic_version")
    assert version == said.split()[0]
