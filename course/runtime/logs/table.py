"""LogTable: what a session's nodes logged, to read as a table."""

from __future__ import annotations

import html
import time
from collections.abc import Iterator, Sequence
from typing import overload

from course.errors import SessionError
from course.runtime.logs.log_store import SEVERITIES, LogRow, store


class LogTable(Sequence[LogRow]):
    """Rows of a log, oldest first; prints as a table, in a notebook too."""

    def __init__(self, rows: Sequence[LogRow], left_out: int = 0) -> None:
        """Show `rows`; `left_out` older ones were not asked for."""
        self.rows = list(rows)
        self.left_out = left_out

    @property
    def messages(self) -> list[str]:
        """The texts alone."""
        return [row.message for row in self.rows]

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.rows)

    def __iter__(self) -> Iterator[LogRow]:
        """Iterate over the rows."""
        return iter(self.rows)

    @overload
    def __getitem__(self, index: int) -> LogRow: ...
    @overload
    def __getitem__(self, index: slice) -> list[LogRow]: ...
    def __getitem__(self, index: int | slice) -> LogRow | list[LogRow]:
        """Return a row, or several."""
        return self.rows[index]

    def __repr__(self) -> str:
        """Return the table as text."""
        if not self.rows:
            return "(nothing logged)"
        cells = [_row_cells(row) for row in self.rows]
        width = [max(len(row[column]) for row in cells) for column in range(3)]
        lines = []
        for stamp, level, node, message in cells:
            start = f"{stamp:{width[0]}}  {level:{width[1]}}  {node:{width[2]}}  "
            lines.append(start + message.replace("\n", "\n" + " " * len(start)))
        return "\n".join([*self._left_out_lines(), *lines])

    def _repr_html_(self) -> str:
        if not self.rows:
            return "<i>nothing logged</i>"
        head = "".join(f"<th>{title}</th>" for title in ("time", "level", "node", "message"))
        body = "".join(
            "<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in _row_cells(row)[:3])
            + f'<td style="text-align:left;white-space:pre-wrap">{html.escape(row.message)}</td>'
            "</tr>"
            for row in self.rows
        )  # fmt: skip
        older = "".join(f"<p><i>{html.escape(line)}</i></p>" for line in self._left_out_lines())
        return f"{older}<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"

    def _left_out_lines(self) -> list[str]:
        return [f"({self.left_out} earlier rows: ask for more with last=...)"] * bool(self.left_out)


def make_table(
    home: object, since: float, names: Sequence[str] | None, level: str, last: int | None
) -> LogTable:
    """Return the rows of `home` since `since` (s): of these nodes, of at least this level.

    Raises:
        SessionError: there is no such level.
    """
    name = level.upper() if isinstance(level, str) else ""
    lowest = SEVERITIES.get({"WARNING": "WARN"}.get(name, name))
    if lowest is None:
        raise SessionError(
            f"There is no log level {level!r}: choose DEBUG, INFO, WARN, ERROR or FATAL."
        )
    rows = [
        row
        for severity, row in store.rows_of(home, since)
        if severity >= lowest and (names is None or row.node in names)
    ]
    kept = rows if last is None else rows[max(0, len(rows) - last) :]
    return LogTable(kept, left_out=len(rows) - len(kept))


def _row_cells(row: LogRow) -> tuple[str, str, str, str]:
    moment = time.strftime("%H:%M:%S", time.localtime(row.stamp))
    return f"{moment}.{int(row.stamp % 1 * 1000):03d}", row.level, row.node, row.message
