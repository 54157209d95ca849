"""How a verdict looks to a student: the same content as text and as HTML, everything escaped."""

from __future__ import annotations

from html import escape

from autograder.examination.pictures.drawing import draw_picture
from autograder.examination.pictures.wording import describe_picture
from autograder.examination.verdict import CheckResult, Verdict

MARKS = {"passed": "✔", "failed": "✘", "not_checked": "-", "not_examined": "?", "grader_error": "!"}
WORDS = {
    "passed": "passed",
    "failed": "not yet",
    "not_checked": "not checked",
    "not_examined": "not examined here",
    "grader_error": "the grader failed",
}
NEEDED = "needed for others, earns nothing by itself"
"""What stands in place of the points of a check that has none: why it was made all the same."""

SEEN_DETAILS = 2
"""Details of a failed check after which its picture stands: what was needed, and observed."""

COLOURS = {
    "passed": "#1a7f37",
    "failed": "#b35900",
    "not_checked": "#6e7781",
    "not_examined": "#8250df",
    "grader_error": "#8250df",
}


class Report:
    """A verdict with as many hints as were asked for."""

    def __init__(self, verdict: Verdict, *, hints: int = 1, now: str = "") -> None:
        """Show ``verdict``.

        Args:
            verdict: all results, or those so far.
            hints: how many of each failed check's hints to give.
            now: what goes on, as a sentence, if the examination is not over.
        """
        self._verdict = verdict
        self._hints = hints
        self._now = now

    def __repr__(self) -> str:
        """Return the report as plain text."""
        verdict = self._verdict
        lines = [f"{verdict.exam}: {self._total}"]
        lines += [f"  note: {note}" for note in verdict.notes]
        for check in verdict.checks:
            lines.append(f"{MARKS[check.status]} {check.title} ({_describe_outcome(check)})")
            details = self._check_details(check)
            if check.picture is not None:
                details.insert(SEEN_DETAILS, ("picture", describe_picture(check.picture)))
            lines += [f"    {label}: {text}" for label, text in details]
        return "\n".join([*lines, self._now] if self._now else lines)

    @property
    def _total(self) -> str:
        if self._now:
            return f"{_format_points(self._verdict.score)} points so far"
        return (
            f"{_format_points(self._verdict.score)} of "
            f"{_format_points(self._verdict.max_score)} points"
        )

    def _repr_html_(self) -> str:
        verdict = self._verdict
        head = f"<p><strong>{escape(verdict.exam)}: {self._total}</strong></p>"
        now = f'<p role="status"><em>{escape(self._now)}</em></p>' if self._now else ""
        notes = "".join(f"<p>{escape(note)}</p>" for note in verdict.notes)
        items = "".join(self._item_html(check) for check in verdict.checks)
        return f'{head}{notes}<ul style="list-style:none;padding-left:0">{items}</ul>{now}'

    def _item_html(self, check: CheckResult) -> str:
        details = [
            f'<div style="margin-left:1.6em"><em>{escape(label)}:</em> '
            f'<span style="white-space:pre-wrap">{escape(text)}</span></div>'
            for label, text in self._check_details(check)
        ]
        if check.picture is not None:
            shown = f'<div style="margin:.5em 0 .5em 1.6em">{draw_picture(check.picture)}</div>'
            details.insert(SEEN_DETAILS, shown)
        return (
            f'<li style="margin:.4em 0"><span style="color:{COLOURS[check.status]}" '
            f'aria-hidden="true">{MARKS[check.status]}</span> '
            f"<strong>{escape(check.title)}</strong> "
            f"({_describe_outcome(check)}){''.join(details)}</li>"
        )

    def _check_details(self, check: CheckResult) -> list[tuple[str, str]]:
        if check.passed:
            return [("note", check.note)] if check.note else []
        details = [
            ("needed", check.expected),
            ("observed", check.actual),
            ("why it matters", check.rationale),
        ]
        if check.status == "failed":
            shown = check.hints[: self._hints]
            details += [(f"hint {n}", hint) for n, hint in enumerate(shown, start=1)]
            if len(shown) < len(check.hints):
                part = "" if self._verdict.part == "visible" else f', part="{self._verdict.part}"'
                more = f'check("{self._verdict.exam}"{part}, hint={len(shown) + 1})'
                details.append(("more help", more))
            details.append(("read", check.read))
        return [(label, text) for label, text in details if text]


def _describe_outcome(check: CheckResult) -> str:
    if not check.max_points:
        return f"{WORDS[check.status]}; {NEEDED}"
    return (
        f"{WORDS[check.status]}, {_format_points(check.points)}/{_format_points(check.max_points)}"
    )


def _format_points(value: float) -> str:
    return f"{value:g}"
