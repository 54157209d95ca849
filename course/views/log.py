"""What all nodes of a session log and print, live."""

from __future__ import annotations

import time

from course.runtime.session import Session
from course.views.live import Frame, LiveView

SHOWN = 200
"""Lines that a frame has; the filters in the browser choose among them."""

LONGEST_LINE = 500


class LogPanel(LiveView):
    """The latest lines of all nodes, with filters for level and text.

    As text it is the table of `Session.logs`.
    """

    label = "Log panel"
    script = "log"
    shared = ("forms",)
    period = 0.25  # s: nobody reads faster

    def __init__(self, session: Session, level: str = "DEBUG") -> None:
        """Show lines of at least ``level``."""
        super().__init__(session, level)
        self._level = level
        session.logs(level=level, last=1)  # an unknown level is an error at once

    def frame(self) -> Frame:
        """Return the latest lines: time, level, node, text."""
        table = self.session.logs(level=self._level, last=SHOWN)
        return {
            "rows": [
                [_moment(row.stamp), row.level, row.node, row.message[:LONGEST_LINE]]
                for row in table
            ],
            "total": len(table) + table.left_out,
        }

    def words(self) -> str:
        """Return the last lines as a table."""
        return repr(self.session.logs(level=self._level, last=20))


def _moment(stamp: float) -> str:
    return f"{time.strftime('%H:%M:%S', time.localtime(stamp))}.{int(stamp % 1 * 1000):03d}"
