"""What all nodes of a domain log, and those of the session print, live."""

from __future__ import annotations

import json
import time
from typing import Any

from course.runtime.core_session import CoreSession
from course.runtime.logs.log_store import SEVERITIES, LogRow
from course.runtime.logs.table import LogTable
from course.views.shared import truncate
from course.views.shared.live_view import Frame, LiveView
from course.watch.rosout import Rosout

SHOWN = 200
"""Lines that a frame has."""

MAX_LINE_CHARS = 500
"""Characters of a line that are shown."""

MOST_BYTES = 100_000
"""Bytes of JSON that the lines of a frame may have, whatever language they are in."""


class LogPanel(LiveView):
    """The latest lines of all nodes that the filters for level and text let through.

    Nodes of other programs on the session's domain are among them, with what they log; what they
    print is not to be seen from here. It begins with what is INFO or more. As text it is a table
    like that of `Session.logs`.
    """

    label = "Log panel"
    script = "log"
    shared = ("forms",)
    period = 0.25  # s: nobody reads faster

    def __init__(self, session: CoreSession, level: str = "DEBUG") -> None:
        """Show lines of at least ``level``."""
        session.logs(level=level, last=1)  # an unknown level is an error at once
        super().__init__(session, level)
        self._elsewhere = Rosout(session)
        self.resources.callback(self._elsewhere.stop)
        self._least = level
        self._level = (
            _canonical_level(level)
            if SEVERITIES[_canonical_level(level)] > SEVERITIES["INFO"]
            else "INFO"
        )
        self._search = ""

    def filter(self, level: str, search: str = "") -> None:
        """Show lines of at least ``level`` that have the text ``search`` in them, in any case.

        Raises:
            SessionError: there is no such level.
        """
        self.session.logs(level=level, last=1)
        self._level, self._search = _canonical_level(level), search[:MAX_LINE_CHARS].lower()

    def handle_control(self, message: dict[str, Any]) -> None:
        """Filter as chosen."""
        asked = message.get("filter")
        if isinstance(asked, dict) and str(asked.get("level")) in SEVERITIES:
            self.filter(str(asked["level"]), str(asked.get("search", "")))

    def make_frame(self) -> Frame:
        """Return the latest lines that pass the filters: time, level, node, text."""
        return self._as_frame(*self._filtered_rows())

    def look(self) -> tuple[Frame, str]:
        """Return both from one look at the log."""
        found, total = self._filtered_rows()
        return self._as_frame(found, total), _format_table(found)

    def words(self) -> str:
        """Return the last lines as a table."""
        return _format_table(self._filtered_rows()[0])

    def _as_frame(self, found: list[LogRow], total: int) -> Frame:
        rows: list[list[str]] = []
        left = MOST_BYTES
        for row in reversed(found[-SHOWN:]):
            shown = _shortened_cells(row)
            left -= len(json.dumps(shown))
            if left < 0:
                break
            rows.insert(0, shown)
        return {
            "rows": rows, "found": len(found), "total": total,
            "level": self._level, "search": self._search,
        }  # fmt: skip

    def _filtered_rows(self) -> tuple[list[LogRow], int]:
        """Return the rows that pass, and how many there are in all."""
        rows = self.session.logs(level=self._least, last=None).rows
        least = SEVERITIES[_canonical_level(self._least)]
        rows += [r for r in self._elsewhere.latest_rows if SEVERITIES.get(r.level, 0) >= least]
        rows.sort(key=lambda row: row.stamp)
        lowest = SEVERITIES[self._level]
        return [
            row
            for row in rows
            if SEVERITIES.get(row.level, 0) >= lowest
            and (not self._search or self._search in " ".join(_row_cells(row)).lower())
        ], len(rows)


def _format_table(found: list[LogRow]) -> str:
    last = [
        row._replace(message=truncate.cut_text(row.message, MAX_LINE_CHARS)) for row in found[-20:]
    ]
    return repr(LogTable(last, left_out=len(found) - len(last)))


def _canonical_level(level: str) -> str:
    return {"WARNING": "WARN"}.get(level.upper(), level.upper())


def _shortened_cells(row: LogRow) -> list[str]:
    return [truncate.cut_text(cell, MAX_LINE_CHARS) for cell in _row_cells(row)]


def _row_cells(row: LogRow) -> tuple[str, str, str, str]:
    moment = time.strftime("%H:%M:%S", time.localtime(row.stamp))
    return f"{moment}.{int(row.stamp % 1 * 1000):03d}", row.level, row.node, row.message
