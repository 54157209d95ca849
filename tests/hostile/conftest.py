"""The table of attacks, at the end of ``pytest tests/hostile -v``: from what was just seen."""

from __future__ import annotations

import pytest
from rich.console import Console
from rich.table import Table
from rich.text import Text

TITLES = (
    "attack", "what the grade says", "points got / deserved", "neighbour's points",
    "neighbour's time",
)  # fmt: skip


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    reports = terminalreporter.getreports("passed") + terminalreporter.getreports("failed")
    rows = [dict(report.user_properties) for report in reports]
    rows = [row for row in rows if row.keys() >= set(TITLES)]
    if not rows or not terminalreporter.config.option.verbose:
        return
    table = Table(*TITLES, title="Attacks", show_lines=True)
    for row in sorted(rows, key=lambda row: str(row["attack"])):
        table.add_row(*(Text(str(row[title])) for title in TITLES))
    console = Console(width=160)
    with console.capture() as text:
        console.print(table)
    terminalreporter.ensure_newline()
    terminalreporter.write(text.get())
