"""The class report as one HTML page that needs nothing else: no script, no font, no request.

Everything that a student could have written is escaped, and a content security policy forbids the
page to load or run anything, should that ever fail.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from itertools import groupby

from autograder.insight import plots
from autograder.insight.figures import FEW, CheckFigures
from autograder.insight.report import ClassReport
from autograder.insight.similarity import MOST_PAIRS, Pair, side_by_side
from course.plain import counted

CHECK_COLUMNS = (
    "check", "points", "passed", "failed", "not checked", "grader error", "failure rate",
    "discrimination", "remark",
)  # fmt: skip
MOST_NAMES = 12
"""Students named in a table's cell; the rest stands behind a disclosure."""
MOST_GROUPS = 20

_STYLE = """
:root { color-scheme: light dark; }
body { font: 1rem/1.5 system-ui, sans-serif; max-width: 66rem; margin: 2rem auto; padding: 0 1rem; }
figure { margin: 1rem 0; background: #fff; color: #000; border-radius: .4rem; padding: .5rem; }
figure svg { width: 100%; height: auto; }
table { border-collapse: collapse; width: 100%; }
th, td { text-align: left; padding: .25rem .6rem; border-bottom: 1px solid #8888;
  vertical-align: top; }
td.number { text-align: right; font-variant-numeric: tabular-nums; }
th { font-weight: normal; }
thead th { font-weight: 600; overflow-wrap: normal; }
caption { text-align: left; padding: .4rem .6rem; }
td, th { overflow-wrap: anywhere; }
.scroll { overflow-x: auto; }
.urgent { font-weight: 600; }
details { margin: .4rem 0; }
summary { cursor: pointer; }
.diff td { font: .82rem/1.35 ui-monospace, monospace; white-space: pre-wrap; border: 0;
  padding: 0 .5rem; width: 49%; }
.diff td.mark { width: 2%; text-align: center; }
.diff tr.changed td { background: #d55e0026; }
.diff tr.given td { opacity: .55; }
"""


def page(report: ClassReport) -> str:
    """Return the report as one HTML page."""
    title = f"{report.data.assignment}: class report"
    parts = [
        f"<h1>{escape(title)}</h1>",
        *_scores(report),
        *_needs(report),
        *_checks(report),
        *_feedback(report),
        *_times(report),
        *_alike(report),
        *_left_out(report),
    ]
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta http-equiv="Content-Security-Policy" '
        "content=\"default-src 'none'; style-src 'unsafe-inline'\">"
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}</title><style>{_STYLE}</style></head>\n"
        f"<body><main>{''.join(parts)}</main></body></html>\n"
    )


def _scores(report: ClassReport) -> list[str]:
    grades, most = report.data.grades, report.data.max_score
    waiting = sum(grade.needs_manual_grade for grade in grades)
    said = (
        f"{counted(len(grades), 'student')} with a grade, of {most:g} points; "
        f"median {report.median:g}, mean {report.mean:.1f}."
    )
    if waiting:
        said += (
            f" {counted(waiting, 'grade')} still {'waits' if waiting == 1 else 'wait'} for a "
            "person: points that are not given yet count as 0 here."
        )
    drawn = plots.scores([grade.score for grade in grades], most)
    return [f"<p>{escape(said)}</p>", _figure(drawn, "How many students have how many points.")]


def _needs(report: ClassReport) -> list[str]:
    parts = ["<h2>What needs a person</h2>"]
    if not report.needs:
        return [*parts, "<p>Nothing.</p>"]
    rows = "".join(
        f'<tr><td class="{"urgent" if need.urgent else "text"}">{escape(need.why)}</td>'
        f'<td class="number">{len(need.students)}</td><td>{_names(need.students)}</td></tr>'
        for need in report.needs
    )
    caption = "Reasons, and whom they hold for; without a mark from you these grades are not final"
    return [*parts, _table(caption, ("why", "how many", "students"), rows)]


def _checks(report: ClassReport) -> list[str]:
    parts = ["<h2>Checks</h2>"]
    if not report.checks:
        return [*parts, "<p>No check was run on any submission.</p>"]
    parts.append(_EXPLAINED)
    if report.examined < FEW:
        few = f"With fewer than {FEW} submissions these figures say little."
        parts.append(f"<p><strong>{few}</strong></p>")
    for number, (notebook, found) in enumerate(groupby(report.checks, key=lambda c: c.notebook)):
        shown = list(found)
        caption = f"What came of the checks of {notebook}, and whether they tell who does well."
        parts.append(_figure(plots.checks(shown, f"checks-{number}"), caption))
        rows = "".join(_check_row(check) for check in shown)
        parts.append(_table(f"Figures of the checks of {notebook}", CHECK_COLUMNS, rows))
    return parts


_EXPLAINED = (
    "<p>The <em>failure rate</em> counts submissions on which the check was examined; it is "
    "<em>not checked</em> where something that it needs had failed. <em>Discrimination</em> is the "
    "correlation of passing with the points on all other checks: above 0.3 a check tells well who "
    "can do it, near 0 it does not, and below 0 something is wrong with it or with the task. "
    "Submissions that could not be run are left out.</p>"
)


def _check_row(check: CheckFigures) -> str:
    numbers = (
        f"{check.max_points:g}", str(check.passed), str(check.failed), str(check.not_checked),
        str(check.grader_errors),
        "" if check.failure_rate is None else f"{100 * check.failure_rate:.0f} %",
        "" if check.discrimination is None else f"{check.discrimination:+.2f}",
    )  # fmt: skip
    cells = "".join(f'<td class="number">{value}</td>' for value in numbers)
    return (
        f'<tr><th scope="row">{escape(check.title)}</th>{cells}<td>{escape(check.advice)}</td></tr>'
    )


def _feedback(report: ClassReport) -> list[str]:
    parts = ["<h2>Most common feedback</h2>"]
    if not report.feedback:
        return [*parts, "<p>No check failed.</p>"]
    rows = "".join(
        f'<tr><td class="number">{len(group.students)}</td><td>{escape(group.about)}</td>'
        f"<td>{escape(group.text)}</td><td>{_names(group.students)}</td></tr>"
        for group in report.feedback[:MOST_GROUPS]
    )
    shown = min(MOST_GROUPS, len(report.feedback))
    caption = (
        f"What was observed where a check failed: the {shown} most common of "
        f"{len(report.feedback)}; # stands for a number, … for a name"
    )
    return [*parts, _table(caption, ("students", "about", "observed", "who"), rows)]


def _times(report: ClassReport) -> list[str]:
    seconds = report.times.seconds
    if not seconds:
        return []
    slowest = ", ".join(f"{who} {taken:.1f} s" for who, taken in report.times.slowest)
    said = (
        f"Median {report.times.median:.1f} s, all together {sum(seconds.values()) / 60:.1f} min "
        f"one after another. The slowest: {slowest}."
    )
    drawn = plots.times(list(seconds.values()))
    return [
        "<h2>Time</h2>",
        _figure(drawn, "How long the submissions took to run."),
        f"<p>{escape(said)}</p>",
    ]


def _alike(report: ClassReport) -> list[str]:
    found = report.likeness
    said = (
        f"{counted(found.compared, 'submission')} compared; "
        f"{counted(found.found, 'pair')} at least {100 * report.threshold:.0f} % alike in what the "
        "students wrote themselves. The assignment's own lines, lines that a good part of the "
        "class has, comments and chosen names do not count."
    )
    if found.too_short:
        said += f" Too little to compare: {counted(len(found.too_short), 'submission')}."
    hint = (
        "This is a hint where to look, never a verdict: people who learn together, or from the "
        "same example, write alike."
    )
    parts = [f"<h2>Alike</h2><p><strong>{escape(hint)}</strong></p><p>{escape(said)}</p>"]
    if found.found > MOST_PAIRS:
        parts.append(f"<p>The {MOST_PAIRS} most alike are shown.</p>")
    return [*parts, *(_pair(report, pair) for pair in found.pairs)]


def _pair(report: ClassReport, pair: Pair) -> str:
    rows = side_by_side(report.texts[pair.left], report.texts[pair.right])
    head = "".join(f'<th scope="col">{escape(who)}</th>' for who in (pair.left, "", pair.right))
    body = "".join(_diff_row(report, *row) for row in rows)
    return (
        f"<details><summary>{escape(pair.left)} and {escape(pair.right)}: "
        f"{100 * pair.similarity:.0f} % alike</summary>"
        f'<div class="scroll"><table class="diff"><thead><tr>{head}</tr></thead>'
        f"<tbody>{body}</tbody></table></div></details>"
    )


def _diff_row(report: ClassReport, kind: str, left: str, right: str) -> str:
    given = kind == "same" and report.given.is_given(left)
    mark = {"same": "", "changed": "≠", "cut": ""}[kind]
    return (
        f'<tr class="{"given" if given else kind}"><td>{escape(left[:500])}</td>'
        f'<td class="mark">{mark}</td><td>{escape(right[:500])}</td></tr>'
    )


def _left_out(report: ClassReport) -> list[str]:
    if not report.notes:
        return []
    items = "".join(f"<li>{escape(note)}</li>" for note in report.notes)
    return [f"<h2>Left out</h2><ul>{items}</ul>"]


def _figure(svg: str, caption: str) -> str:
    described = svg.replace("<svg", f'<svg role="img" aria-label="{escape(caption)}"', 1)
    return f"<figure>{described}<figcaption>{escape(caption)}</figcaption></figure>"


def _table(caption: str, columns: Sequence[str], rows: str) -> str:
    head = "".join(f'<th scope="col">{escape(column)}</th>' for column in columns)
    return (
        f'<div class="scroll"><table><caption>{escape(caption)}</caption>'
        f"<thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>"
    )


def _names(students: Sequence[str]) -> str:
    if len(students) <= MOST_NAMES:
        return _listed(students)
    return (
        f"{_listed(students[:MOST_NAMES])}<details><summary>and {len(students) - MOST_NAMES} more"
        f"</summary>{_listed(students[MOST_NAMES:])}</details>"
    )


def _listed(students: Iterable[str]) -> str:
    return escape(", ".join(students))
