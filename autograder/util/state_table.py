"""What the engine knows of a course from one run to the next: rows of one SQLite file.

A row has a kind, an assignment, a name within it, and a text. It is there as a whole or not at all,
whenever a process is killed, and several processes may use the file at a time.
"""

from __future__ import annotations

import errno
import json
import os
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

from autograder.util.work_files import PRIVATE
from course.errors import CourseError

FILE = "state.db"
LOCK_TIMEOUT_S = 60.0
"""Seconds for which another process may be writing."""

_SCHEMA = """
    CREATE TABLE IF NOT EXISTS state (
        revision INTEGER PRIMARY KEY AUTOINCREMENT,
        kind TEXT NOT NULL,
        assignment TEXT NOT NULL,
        name TEXT NOT NULL,
        text TEXT NOT NULL,
        UNIQUE (kind, assignment, name)
    )
"""
_ERRNO = {
    sqlite3.SQLITE_FULL: errno.ENOSPC,
    sqlite3.SQLITE_READONLY: errno.EROFS,
    sqlite3.SQLITE_CANTOPEN: errno.EACCES,
    sqlite3.SQLITE_BUSY: errno.EBUSY,
}


class StateError(CourseError):
    """The file is no sound one; the message says what to do."""


class StateTable:
    """The rows of one kind and one assignment.

    A name is a list of texts, such as a student and a notebook. Whatever is written has a revision,
    an int above 0 that is higher than that of all that was written before.

    Example:
        >>> table = StateTable(root / ".autograder", "extension", "ch05")
        >>> table.put("24.0", "ada")
        >>> table.get("ada")
        '24.0'
    """

    def __init__(self, work: Path, kind: str, assignment: str = "") -> None:
        """Keep them in the engine's folder ``work``, which need not be there yet."""
        self._path = work / FILE
        self._kind, self._assignment = kind, assignment

    def get(self, *name: str, since: int = 0) -> str | None:
        """Return a row's text, or None if there is none whose revision is above ``since``.

        Raises:
            OSError: the file cannot be read.
            StateError: it is damaged.
        """
        found = self._select("text", "AND name = ? AND revision > ?", json.dumps(name), since)
        return str(found[0][0]) if found else None

    def revision(self, *name: str) -> int:
        """Return a row's revision, or 0 if there is none; raises as `get` does."""
        found = self._select("revision", "AND name = ?", json.dumps(name))
        return int(found[0][0]) if found else 0

    def rows(self) -> dict[tuple[str, ...], str]:
        """Return {name: text} in the order of names; raises as `get` does."""
        found = self._select("name, text", "ORDER BY name")
        return {tuple(json.loads(name)): text for name, text in found}

    def put(self, text: str, *name: str) -> None:
        """Write a row, in place of one with the same name.

        Raises:
            OSError: it cannot be written, as the disk is full, say; what stood there still does.
            StateError: the file is damaged.
        """
        self._path.parent.mkdir(parents=True, exist_ok=True)
        # Only the owner may read grades. SQLite gives its journal the same mode as the file.
        os.close(os.open(self._path, os.O_RDWR | os.O_CREAT, PRIVATE))
        # Text of a submission may hold half a character, which is no UTF-8.
        text = text.encode(errors="replace").decode()
        with self._open() as database:
            database.execute(_SCHEMA)
            database.execute(
                "REPLACE INTO state (kind, assignment, name, text) VALUES (?, ?, ?, ?)",
                (self._kind, self._assignment, json.dumps(name), text),
            )

    def remove(self, *name: str) -> None:
        """Remove a row if it is there; raises as `put` does."""
        if self.revision(*name):
            with self._open() as database:
                database.execute(
                    "DELETE FROM state WHERE kind = ? AND assignment = ? AND name = ?",
                    (self._kind, self._assignment, json.dumps(name)),
                )

    def _select(self, columns: str, condition: str, *values: object) -> list[tuple[Any, ...]]:
        if not self._path.exists():
            return []
        with self._open() as database:
            if not database.execute("SELECT 1 FROM sqlite_schema WHERE name = 'state'").fetchall():
                return []  # a first row was not written to its end
            rows = f"SELECT {columns} FROM state WHERE kind = ? AND assignment = ? {condition}"
            return database.execute(rows, (self._kind, self._assignment, *values)).fetchall()

    @contextmanager
    def _open(self) -> Iterator[sqlite3.Connection]:
        """Open the file for one transaction: no connection outlives a fork, or changes threads."""
        try:
            with closing(sqlite3.connect(self._path, timeout=LOCK_TIMEOUT_S)) as database, database:
                yield database
        except sqlite3.DatabaseError as error:
            # Extended codes say more in their higher bytes.
            code = getattr(error, "sqlite_errorcode", sqlite3.SQLITE_ERROR) & 0xFF
            if code in (sqlite3.SQLITE_NOTADB, sqlite3.SQLITE_CORRUPT):
                raise StateError(
                    f"{self._path} is damaged ({error}): put a copy of it back, or move it away. "
                    "Without it everything is graded again, and extensions of students who have "
                    "not handed in yet must be granted again."
                ) from error
            if isinstance(error, sqlite3.OperationalError):
                raise OSError(_ERRNO.get(code, errno.EIO), str(error), str(self._path)) from error
            raise
