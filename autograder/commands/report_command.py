"""``autograder report``: makes the class report, writes it, and shows the gist in a terminal."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.table import Table

from autograder.class_report import report_files
from autograder.class_report.class_report import ClassReport
from autograder.class_report.platforms import exports

MOST_NAMES = 20
"""Students that are named on one line; the page names them all."""


@dataclass(frozen=True)
class Made:
    """A report that was written: its files, and remarks on the exports."""

    report: ClassReport
    files: list[Path]
    remarks: list[str]

    def as_data(self) -> dict[str, Any]:
        """Return the report for machines."""
        files = [str(path) for path in self.files]
        return {**self.report.as_data(), "remarks": self.remarks, "files": files}

    def as_tables(self) -> list[Table]:
        """Return the checks, and what needs a person, for a terminal."""
        checks = Table("Check", "n", "Fails", "r", "Remark", padding=(0, 0))
        checks.caption = (
            "n: submissions on which it was examined; Fails: of these; r: discrimination, "
            "correlation with the rest"
        )
        for check in self.report.checks:
            rate = "" if check.failure_rate is None else f"{100 * check.failure_rate:.0f} %"
            r = "" if check.discrimination is None else f"{check.discrimination:+.2f}"
            checks.add_row(check.title, str(check.examined_count), rate, r, check.advice)
        means = Table("Exercise", "Mean", "n", "Waiting", padding=(0, 1))
        for mean in self.report.means.exercises:
            value = "" if mean.mean is None else f"{mean.mean:.1f} of {mean.max_points:g}"
            means.add_row(mean.about, value, str(mean.n), str(mean.waiting or ""))
        needs = Table("Needs a person", "How many", "Who")
        for need in self.report.needs:
            named = [self.report.data.display_name(student) for student in need.students[:5]]
            who = ", ".join(named) + (", …" if len(need.students) > 5 else "")
            style = "bold" if need.urgent else None
            needs.add_row(need.why, str(len(need.students)), who, style=style)
        return [table for table in (means, checks, needs) if table.row_count]


def make_report(
    root: Path,
    assignment: str,
    *,
    column: str,
    provisional: bool,
    threshold: float,
    zero_absent: bool = False,
) -> Made:
    """Make the report of an assignment and write it; arguments as in `exports` and `alike_pairs`.

    Raises:
        ClassReportError: no such assignment, nothing graded, or a folder that cannot be written.
    """
    made = report_files.make_report(root, assignment, threshold)
    chosen = {"provisional": provisional, "zero_absent": zero_absent}
    files = report_files.write_report(made, column, **chosen)
    export = exports.export_canvas(made.data, column, **chosen)
    remarks = [*_absence_remarks(made), *made.notes, *report_files.export_remarks(export)]
    return Made(made, files, remarks)


def _absence_remarks(made: ClassReport) -> list[str]:
    absent = [made.data.display_name(student) for student in made.data.absent]
    more = f" and {len(absent) - MOST_NAMES} more" if len(absent) > MOST_NAMES else ""
    return [f"Nothing handed in: {', '.join(absent[:MOST_NAMES])}{more}."] if absent else []
