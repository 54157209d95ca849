"""The database under nbgrader: what is wrong with it, and what changed in it."""

from __future__ import annotations

import errno
import sqlite3
import tempfile
from collections.abc import Callable, Iterable
from contextlib import closing
from datetime import timedelta
from functools import cache
from pathlib import Path
from typing import Any

from alembic.config import Config as AlembicConfig
from alembic.script import ScriptDirectory
from nbgrader import api, dbutil
from nbgrader.api import (
    Assignment,
    BaseCell,
    Comment,
    Grade,
    Notebook,
    SubmittedAssignment,
    SubmittedNotebook,
)
from sqlalchemy import inspect, text
from sqlalchemy.engine import Engine
from sqlalchemy.orm import Session

from course.errors import CourseError

Rows = list[list[Any]]


class GradebookUnusable(CourseError):  # noqa: N818 - a state of the gradebook, not of one student
    """Nothing can be entered into the gradebook: the whole run has to stop."""


class DiskFullError(GradebookUnusable):
    """There is no room for the gradebook or for what nbgrader writes."""


class GradebookLockedError(GradebookUnusable):
    """Another program holds the gradebook."""


class OldGradebookError(GradebookUnusable):
    """The gradebook has the tables of another version of nbgrader."""


FULL = ("disk is full", "No space left on device", "Disk quota exceeded", "File too large")
MIN_FREE_BYTES = 8 * 1024 * 1024
"""Bytes for which there is room on a disk that is not full: far more than one student needs."""


def disk_full_error(said: str, root: Path, folders: Iterable[Path]) -> DiskFullError | None:
    """Return the sentence for a full disk, if something failed for want of room.

    Args:
        said: a log that seems to say so; as a student may have written what it quotes, it is also
            looked whether there is room.
        root: the course root.
        folders: where was written.
    """
    failed = any(words in said for words in (*FULL, "disk I/O error"))
    return _full_disk_error(root) if failed and not all(map(_has_room, folders)) else None


def _has_room(folder: Path) -> bool:
    try:
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(bytes(MIN_FREE_BYTES))
    except OSError as error:
        return error.errno not in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
    return True


def is_locked(said: str) -> bool:
    """Whether an error's text says that another program holds the database."""
    return "database is locked" in said or "database table is locked" in said


def unusable_error(said: str, root: Path) -> GradebookUnusable | None:
    """Return the sentence for an error of the database that concerns everybody, if it is one.

    ``said`` is what the database itself raised: never a log, in which a student's words may stand.
    """
    if any(words in said for words in FULL):
        return _full_disk_error(root)
    if is_locked(said):
        return GradebookLockedError(
            f"Another program holds the gradebook of {root}: wait until it is done, or end it, and "
            "run the same command again; what was graded so far is kept."
        )
    if "no such column" in said or "no such table" in said:
        return _old_gradebook_error(root)
    if "readonly database" in said or "unable to open database file" in said:
        return GradebookUnusable(
            f"The gradebook of {root} cannot be written: make its file and folder writable for "
            "you, and run the same command again; what was graded so far is kept."
        )
    if any(words in said for words in ("malformed", "not a database", "disk I/O error")):
        return GradebookUnusable(
            f"The gradebook of {root} is damaged or its disk fails: put back a copy that is sound "
            "and run the same command again; what was run so far is kept."
        )
    return None


def require_this_schema(engine: Engine, root: Path) -> None:
    """Look whether a gradebook, if there is one, has the tables that this nbgrader uses.

    The ``engine`` for it is closed in the end, and opens again when needed.

    Raises:
        OldGradebookError: it has not.
        SQLAlchemyError: it cannot be read.
    """
    try:
        tables = inspect(engine).get_table_names()
        if not tables:
            return
        found = None
        if "alembic_version" in tables:
            with engine.connect() as connection:
                found = connection.execute(text("SELECT version_num FROM alembic_version")).scalar()
        if found != _this_schema():
            raise _old_gradebook_error(root)
    finally:
        engine.dispose()


def copy_database(db_url: str, root: Path, copy: Path) -> str:
    """Return the URL of a gradebook to try something with: a copy, or a new one for other kinds.

    Raises:
        GradebookUnusable: the gradebook of ``root`` cannot be read.
    """
    file = Path(db_url.removeprefix("sqlite:///"))
    if db_url.startswith("sqlite:///") and file.is_file():
        try:
            with closing(sqlite3.connect(file)) as old, closing(sqlite3.connect(copy)) as new:
                old.backup(new)
        except sqlite3.Error as error:
            raise unusable_error(str(error), root) or GradebookUnusable(
                f"The gradebook of {root} cannot be read ({error}): put a copy back that was sound."
            ) from error
    return f"sqlite:///{copy}"


@cache
def _this_schema() -> str | None:
    """Return the name of the newest schema that the installed nbgrader knows."""
    config = AlembicConfig()
    config.set_main_option("script_location", dbutil.ALEMBIC_DIR)
    return ScriptDirectory.from_config(config).get_current_head()


# For every new gradebook nbgrader 0.9 starts `alembic heads`, which takes seconds, to hear that.
api.get_alembic_version = _this_schema


def _full_disk_error(root: Path) -> DiskFullError:
    return DiskFullError(
        f"The disk of {root} is full: make room there and run the same command again; what was "
        "graded so far is kept."
    )


def _old_gradebook_error(root: Path) -> OldGradebookError:
    return OldGradebookError(
        f"The gradebook of {root} was made by another version of nbgrader: run `nbgrader db "
        "upgrade` there, which keeps a copy of it, and then the same command again."
    )


def standing_rows(db: Session, assignment: str, student: str = "") -> dict[str, tuple[Rows, Rows]]:
    """Return {student: (what grading found and goes by, what people set)} of an assignment.

    Grading goes by the due date, an extension, and what a cell is worth. What is taken off for
    lateness may depend on the whole score, so where somebody is late, it goes by people's marks.

    Args:
        db: the gradebook's session.
        assignment: its name.
        student: only this one, if given.
    """
    submitted = SubmittedAssignment
    rows: dict[str, tuple[Rows, Rows]] = {}

    def chosen(query: Any) -> Any:
        query = query.filter(Assignment.name == assignment)
        return query.filter(submitted.student_id == student) if student else query

    late = set()
    whole = db.query(
        submitted.student_id, submitted.timestamp, submitted.extension, Assignment.duedate
    )
    for name, time, extension, due in chosen(whole.join(Assignment)):
        rows[name] = ([[str(time), str(extension), str(due)]], [])
        if time is not None and due is not None and time > due + (extension or timedelta()):
            late.add(name)
    penalties = db.query(
        submitted.student_id, Notebook.name, SubmittedNotebook.late_submission_penalty
    )
    of_notebooks = penalties.select_from(SubmittedNotebook).join(Notebook).join(
        submitted, SubmittedNotebook.assignment_id == submitted.id
    )  # fmt: skip
    for name, *penalty in chosen(
        of_notebooks.join(Assignment, submitted.assignment_id == Assignment.id)
    ):
        rows[name][0].append(penalty)
    for name, notebook, cell, auto, kind, worth, *by_hand in chosen(of_cells(db, Grade,
            Grade.auto_score, BaseCell.type, Grade.max_score, Grade.manual_score,
            Grade.extra_credit, Grade.needs_manual_grade)):  # fmt: skip
        marks = by_hand[:2] if name in late else []
        rows[name][0].append([notebook, cell, auto, kind, worth, *marks])
        rows[name][1].append([notebook, cell, *by_hand])
    for name, notebook, cell, auto, by_hand in chosen(
        of_cells(db, Comment, Comment.auto_comment, Comment.manual_comment)
    ):
        rows[name][0].append([notebook, cell, auto])
        rows[name][1].append([notebook, cell, by_hand])
    return rows


def of_cells(db: Session, what: Callable[..., Any], *columns: Any) -> Any:
    """Return a query for columns of grades or comments, with student, notebook and cell.

    Args:
        db: the gradebook's session.
        what: `Grade` or `Comment`.
        columns: columns of it, or of what is joined: they follow the three names.
    """
    kind: Any = what
    query = db.query(SubmittedAssignment.student_id, Notebook.name, BaseCell.name, *columns)
    return (
        query.select_from(kind)
        .join(BaseCell, kind.cell_id == BaseCell.id)
        .join(SubmittedNotebook, kind.notebook_id == SubmittedNotebook.id)
        .join(Notebook, SubmittedNotebook.notebook_id == Notebook.id)
        .join(SubmittedAssignment, SubmittedNotebook.assignment_id == SubmittedAssignment.id)
        .join(Assignment, SubmittedAssignment.assignment_id == Assignment.id)
    )
