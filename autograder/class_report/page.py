"""The class report as one HTML page that needs nothing else: no script, no font, no request.

Everything that a student could have written is escaped, and a content security policy forbids the
page to load or run anything, should that ever fail.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from itertools import groupby

from autograder.assignments import questions
from autograder.class_report import plots
from autograder.class_report.class_report import ClassReport
from autograder.class_report.figures import FEW, CheckFigures
from autograder.class_report.means import Mean
from autograder.class_report.similarity import MOST_PAIRS, Pair, side_by_side
from course.messages.yaml_text import format_count

CHECK_COLUMNS = (
    "check", "points", "passed", "failed", "not checked", "not handed in", "grader error", "n",
    "failure rate", "discrimination", "remark",
)  # fmt: skip
MEAN_COLUMNS = ("mean", "of it", "n", "waiting")
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


def render_page(report: ClassReport) -> str:
    """Return the report as one HTML page."""
    title = f"{report.data.assignment}: class report"
    parts = [
        f"<h1>{escape(title)}</h1>",
        *_scores_section(report),
        *_needs_section(report),
        *_absent_section(report),
        *_means_section(report),
        *_checks_section(report),
        *_feedback_section(report),
        *_times_section(report),
        *_alike_section(report),
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


def _scores_section(report: ClassReport) -> list[str]:
    grades, most = report.data.grades, report.data.max_score
    waiting = sum(grade.needs_manual_grade for grade in grades)
    said = (
        f"{format_count(len(grades), 'student')} with a grade, of {most:g} points; "
        f"median {report.median_score:g}, mean {report.mean_score:.1f} (n = {len(grades)})."
    )
    if waiting:
        said += (
            f" {format_count(waiting, 'grade')} still {'waits' if waiting == 1 else 'wait'} for a "
            "person: points that are not given yet count as 0 here."
        )
    drawn = plots.plot_scores([grade.score for grade in grades], most)
    return [
        f"<p>{escape(said)}</p>",
        _figure_html(drawn, "How many students have how many points."),
    ]


def _needs_section(report: ClassReport) -> list[str]:
    parts = ["<h2>What needs a person</h2>"]
    if not report.needs:
        return [*parts, "<p>Nothing.</p>"]
    rows = "".join(
        f'<tr><td class="{"urgent" if need.urgent else "text"}">{escape(need.why)}</td>'
        f'<td class="number">{len(need.students)}</td>'
        f"<td>{_names_html(report, need.students)}</td></tr>"
        for need in report.needs
    )
    caption = "Reasons, and whom they hold for; without a mark from you these grades are not final"
    return [*parts, _table_html(caption, ("why", "how many", "students"), rows)]


def _absent_section(report: ClassReport) -> list[str]:
    absent, left_out = report.data.absent, report.data.left_out
    parts = ["<h2>What was not handed in</h2>"]
    if absent:
        number = format_count(len(absent), "student")
        parts.append(f"<p>Nothing, by {number}: {_names_html(report, absent)}</p>")
    for notebook in sorted({name for names in left_out.values() for name in names}):
        who = [student for student, names in sorted(left_out.items()) if notebook in names]
        title = questions.title_of_notebook(notebook)
        number = format_count(len(who), "more student")
        parts.append(f"<p>{escape(title)}, by {number}: {_names_html(report, who)}</p>")
    return parts if len(parts) > 1 else []


def _means_section(report: ClassReport) -> list[str]:
    found = report.means
    if not found.exercises:
        return []
    return [
        "<h2>Means</h2><p><em>n</em> is how many students are in a mean: who has not handed in an "
        "exercise, or still waits for a mark in it, is not. What lateness takes off is left out."
        "</p>",
        _table_html(
            "By exercise", ("exercise", *MEAN_COLUMNS), _mean_rows(found.exercises, "about"),
        ),
        _table_html(
            "By question", ("exercise", "question", *MEAN_COLUMNS),
            _mean_rows(found.questions, "about", "title"),
        ),
        *([_table_html(
            "By learning objective: the share of its points that students have, of those that are "
            "given so far", ("objective", *MEAN_COLUMNS[1:]),
            _mean_rows(found.objectives, "title", points=False),
        )] if found.objectives else []),
    ]  # fmt: skip


def _mean_rows(found: Iterable[Mean], *texts: str, points: bool = True) -> str:
    rows = []
    for mean in found:
        names = "".join(f'<th scope="row">{escape(getattr(mean, text))}</th>' for text in texts)
        value = "" if mean.mean is None else f"{mean.mean:.2f} of {mean.max_points:g}"
        share = "" if mean.share is None else f"{100 * mean.share:.0f} %"
        numbers = [value] if points else []
        numbers += [share, str(mean.n), str(mean.waiting or "")]
        cells = "".join(f'<td class="number">{number}</td>' for number in numbers)
        rows.append(f"<tr>{names}{cells}</tr>")
    return "".join(rows)


def _checks_section(report: ClassReport) -> list[str]:
    parts = ["<h2>Checks</h2>"]
    if not report.checks:
        return [*parts, "<p>No check was run on any submission.</p>"]
    parts.append(_EXPLAINED)
    if report.examined_count < FEW:
        few = f"With fewer than {FEW} submissions these figures say little."
        parts.append(f"<p><strong>{few}</strong></p>")
    for number, (notebook, found) in enumerate(groupby(report.checks, key=lambda c: c.notebook)):
        shown = list(found)
        caption = f"What came of the checks of {notebook}, and whether they tell who does well."
        parts.append(_figure_html(plots.plot_checks(shown, f"checks-{number}"), caption))
        rows = "".join(_check_row(check) for check in shown)
        parts.append(_table_html(f"Figures of the checks of {notebook}", CHECK_COLUMNS, rows))
    return parts


_EXPLAINED = (
    "<p>The <em>failure rate</em> counts submissions on which the check was examined; it is "
    "<em>not checked</em> where something that it needs had failed, and <em>not handed in</em> by "
    "those whose notebook is missing. <em>n</em> is how many it was examined on: failure rate and "
    "<em>discrimination</em> are of these. Discrimination is the "
    "correlation of passing with the points on all other checks: above 0.3 a check tells well who "
    "can do it, near 0 it does not, and below 0 something is wrong with it or with the task. "
    "Submissions that could not be run are left out.</p>"
)


def _check_row(check: CheckFigures) -> str:
    numbers = (
        f"{check.max_points:g}", str(check.passed), str(check.failed), str(check.not_checked),
        str(check.not_handed_in), str(check.grader_errors), str(check.examined_count),
        "" if check.failure_rate is None else f"{100 * check.failure_rate:.0f} %",
        "" if check.discrimination is None else f"{check.discrimination:+.2f}",
    )  # fmt: skip
    cells = "".join(f'<td class="number">{value}</td>' for value in numbers)
    return (
        f'<tr><th scope="row">{escape(check.title)}</th>{cells}<td>{escape(check.advice)}</td></tr>'
    )


def _feedback_section(report: ClassReport) -> list[str]:
    parts = ["<h2>Most common feedback</h2>"]
    if not report.feedback:
        return [*parts, "<p>No check failed.</p>"]
    rows = "".join(
        f'<tr><td class="number">{len(group.students)}</td><td>{escape(group.about)}</td>'
        f"<td>{escape(group.text)}</td><td>{_names_html(report, group.students)}</td></tr>"
        for group in report.feedback[:MOST_GROUPS]
    )
    shown = min(MOST_GROUPS, len(report.feedback))
    caption = (
        f"What was observed where a check failed: the {shown} most common of "
        f"{len(report.feedback)}; # stands for a number, … for a name"
    )
    return [*parts, _table_html(caption, ("students", "about", "observed", "who"), rows)]


def _times_section(report: ClassReport) -> list[str]:
    seconds = report.times.seconds
    if not seconds:
        return []
    slowest = ", ".join(
        f"{report.data.display_name(who)} {taken:.1f} s"
        for who, taken in report.times.slowest_submissions
    )
    said = (
        f"Median {report.times.median_seconds:.1f} s (n = {len(seconds)}), all together "
        f"{sum(seconds.values()) / 60:.1f} min one after another. The slowest: {slowest}."
    )
    drawn = plots.plot_times(list(seconds.values()))
    return [
        "<h2>Time</h2>",
        _figure_html(drawn, "How long the submissions took to run."),
        f"<p>{escape(said)}</p>",
    ]


def _alike_section(report: ClassReport) -> list[str]:
    found = report.alike
    said = (
        f"{found.compared} programs and answers compared, each exercise and each "
        f"question by itself; {format_count(found.found, 'pair')} at least "
        f"{100 * report.threshold:.0f} % alike in what the students wrote themselves. The "
        "assignment's own lines and its model answers, lines that a good part of the class has, "
        "comments and chosen names do not count."
    )
    if found.too_short:
        said += f" Too short to compare: {len(found.too_short)}."
    hint = (
        "This is a hint where to look, never a verdict: people who learn together, or from the "
        "same example, write alike."
    )
    parts = [f"<h2>Alike</h2><p><strong>{escape(hint)}</strong></p><p>{escape(said)}</p>"]
    if not found.pairs:
        return parts
    rows = "".join(_pair_rows(report, pair) for pair in found.pairs)
    caption = "Where, who, and how much of it" + (
        f"; the {MOST_PAIRS} most alike" if found.found > MOST_PAIRS else ""
    )
    return [*parts, _table_html(caption, ("exercise", "one", "the other", "alike"), rows)]


def _pair_rows(report: ClassReport, pair: Pair) -> str:
    names = [escape(report.data.display_name(who)) for who in (pair.left, pair.right)]
    texts = report.texts[pair.where]
    rows = side_by_side(texts[pair.left], texts[pair.right])
    head = "".join(f'<th scope="col">{name}</th>' for name in (names[0], "", names[1]))
    body = "".join(_diff_row(report, *row) for row in rows)
    return (
        f"<tr><td>{escape(pair.where)}</td><td>{names[0]}</td><td>{names[1]}</td>"
        f'<td class="number">{100 * pair.similarity:.0f} %</td>'
        '</tr><tr><td colspan="4"><details><summary>side by side</summary>'
        f'<div class="scroll"><table class="diff"><thead><tr>{head}</tr></thead>'
        f"<tbody>{body}</tbody></table></div></details></td></tr>"
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


def _figure_html(svg: str, caption: str) -> str:
    described = svg.replace("<svg", f'<svg role="img" aria-label="{escape(caption)}"', 1)
    return f"<figure>{described}<figcaption>{escape(caption)}</figcaption></figure>"


def _table_html(caption: str, columns: Sequence[str], rows: str) -> str:
    head = "".join(f'<th scope="col">{escape(column)}</th>' for column in columns)
    return (
        f'<div class="scroll"><table><caption>{escape(caption)}</caption>'
        f"<thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>"
    )


def _names_html(report: ClassReport, students: Sequence[str]) -> str:
    called = [report.data.display_name(student) for student in students]
    if len(called) <= MOST_NAMES:
        return _join_names(called)
    return (
        f"{_join_names(called[:MOST_NAMES])}<details><summary>and {len(called) - MOST_NAMES} more"
        f"</summary>{_join_names(called[MOST_NAMES:])}</details>"
    )


def _join_names(students: Iterable[str]) -> str:
    return escape(", ".join(students))
