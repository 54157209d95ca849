"""The class report as one HTML page that needs nothing else: no script, no font, no request.

This module says what stands on the page, ``templates/page.html.jinja`` how it is marked up.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path

from markupsafe import Markup

from autograder.assignments import questions
from autograder.class_report import report_plots
from autograder.class_report.class_report import ClassReport
from autograder.class_report.feedback import FeedbackGroup
from autograder.class_report.figures import FEW, CheckFigures
from autograder.class_report.means import Mean
from autograder.class_report.similarity.alike_pairs import (
    MOST_PAIRS,
    AlikeSubmissions,
    side_by_side,
)
from course.messages.yaml_text import format_count
from quizzes.text.html_pages import fill_template

CHECK_COLUMNS = (
    "check", "points", "passed", "failed", "not checked", "not handed in", "grader error", "n",
    "failure rate", "discrimination", "remark",
)  # fmt: skip
MEAN_COLUMNS = ("mean", "of it", "n", "waiting")
MOST_NAMES = 12
"""Students named in a table's cell; the rest stands behind a disclosure."""
MOST_GROUPS = 20
MAX_NAME_CHARS = 500
"""Characters of a line that is shown side by side with another."""

_TEMPLATE = Path(__file__).parent / "templates" / "page.html.jinja"
_MARKS = {"same": "", "changed": "≠", "cut": ""}


@dataclass(frozen=True)
class ReportPlot:
    """A plot and its caption; ``drawing`` is what follows its ``<svg``, which the page begins."""

    drawing: Markup
    caption: str


@dataclass(frozen=True)
class Summary:
    """A sentence on figures, and their plot."""

    said: str
    plot: ReportPlot


@dataclass(frozen=True)
class Names:
    """Students: the ``first``, and ``more_count`` ``more`` that stand behind a disclosure."""

    first: str
    more: str = ""
    more_count: int = 0


@dataclass(frozen=True)
class TableRow:
    """What figures are of, the figures, and what is remarked on them."""

    names: tuple[str, ...]
    numbers: tuple[str, ...]
    texts: tuple[str, ...] = ()


@dataclass(frozen=True)
class Table:
    """A table of figures."""

    caption: str
    columns: tuple[str, ...]
    rows: tuple[TableRow, ...]


@dataclass(frozen=True)
class FeedbackGroups:
    """The most common feedback, and who got it."""

    caption: str
    groups: list[tuple[FeedbackGroup, Names]]


@dataclass(frozen=True)
class ComparedLine:
    """Two lines side by side; ``kind`` is the class that they have on the page."""

    kind: str
    left: str
    mark: str
    right: str


@dataclass(frozen=True)
class AlikePair:
    """Two students whose work is alike, by name, and their work."""

    where: str
    left: str
    right: str
    similarity: str
    lines: list[ComparedLine]


@dataclass(frozen=True)
class Alike:
    """The pairs of students whose work is alike."""

    said: str
    caption: str
    pairs: list[AlikePair]


def render_page(report: ClassReport) -> str:
    """Return the report as one HTML page."""
    return fill_template(
        _TEMPLATE,
        title=f"{report.data.assignment}: class report",
        scores=_summarise_scores(report),
        needs=[(need, _list_names(report, need.students)) for need in report.needs],
        missing=list(_find_missing(report)),
        means=list(_tabulate_means(report)),
        checks=list(_tabulate_checks(report)),
        too_few=FEW if report.examined_count < FEW else 0,
        feedback=_list_feedback(report),
        times=_summarise_times(report),
        alike=_show_alike(report),
        notes=report.notes,
    )


def _summarise_scores(report: ClassReport) -> Summary:
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
    drawn = report_plots.plot_scores([grade.score for grade in grades], most)
    return Summary(said, _caption_plot(drawn, "How many students have how many points."))


def _find_missing(report: ClassReport) -> Iterator[tuple[str, Names]]:
    """Yield what was not handed in, and by whom."""
    absent, left_out = report.data.absent, report.data.left_out
    if absent:
        number = format_count(len(absent), "student")
        yield f"Nothing, by {number}", _list_names(report, absent)
    for notebook in sorted({name for names in left_out.values() for name in names}):
        who = [student for student, names in sorted(left_out.items()) if notebook in names]
        title = questions.title_of_notebook(notebook)
        number = format_count(len(who), "more student")
        yield f"{title}, by {number}", _list_names(report, who)


def _tabulate_means(report: ClassReport) -> Iterator[Table]:
    found = report.means
    if not found.exercises:
        return
    yield Table(
        "By exercise", ("exercise", *MEAN_COLUMNS),
        tuple(TableRow((mean.about,), _mean_numbers(mean)) for mean in found.exercises),
    )  # fmt: skip
    yield Table(
        "By question", ("exercise", "question", *MEAN_COLUMNS),
        tuple(TableRow((mean.about, mean.title), _mean_numbers(mean)) for mean in found.questions),
    )  # fmt: skip
    if found.objectives:
        yield Table(
            "By learning objective: the share of its points that students have, of those that are "
            "given so far", ("objective", *MEAN_COLUMNS[1:]),
            tuple(TableRow((mean.title,), _mean_numbers(mean)[1:]) for mean in found.objectives),
        )  # fmt: skip


def _mean_numbers(mean: Mean) -> tuple[str, ...]:
    """Return the figures for the `MEAN_COLUMNS`."""
    return (
        "" if mean.mean is None else f"{mean.mean:.2f} of {mean.max_points:g}",
        "" if mean.share is None else f"{100 * mean.share:.0f} %",
        str(mean.n),
        str(mean.waiting or ""),
    )


def _tabulate_checks(report: ClassReport) -> Iterator[tuple[ReportPlot, Table]]:
    for number, (notebook, found) in enumerate(groupby(report.checks, key=lambda c: c.notebook)):
        shown = list(found)
        caption = f"What came of the checks of {notebook}, and whether they tell who does well."
        yield (
            _caption_plot(report_plots.plot_checks(shown, f"checks-{number}"), caption),
            Table(
                f"Figures of the checks of {notebook}", CHECK_COLUMNS,
                tuple(TableRow((check.title,), _check_numbers(check), (check.advice,))
                      for check in shown),
            ),
        )  # fmt: skip


def _check_numbers(check: CheckFigures) -> tuple[str, ...]:
    return (
        f"{check.max_points:g}", str(check.passed), str(check.failed), str(check.not_checked),
        str(check.not_handed_in), str(check.grader_errors), str(check.examined_count),
        "" if check.failure_rate is None else f"{100 * check.failure_rate:.0f} %",
        "" if check.discrimination is None else f"{check.discrimination:+.2f}",
    )  # fmt: skip


def _list_feedback(report: ClassReport) -> FeedbackGroups:
    shown = report.feedback[:MOST_GROUPS]
    caption = (
        f"What was observed where a check failed: the {len(shown)} most common of "
        f"{len(report.feedback)}; # stands for a number, … for a name"
    )
    return FeedbackGroups(
        caption, [(group, _list_names(report, group.students)) for group in shown]
    )


def _summarise_times(report: ClassReport) -> Summary | None:
    seconds = report.times.seconds
    if not seconds:
        return None
    slowest = ", ".join(
        f"{report.data.display_name(who)} {taken:.1f} s"
        for who, taken in report.times.slowest_submissions
    )
    said = (
        f"Median {report.times.median_seconds:.1f} s (n = {len(seconds)}), all together "
        f"{sum(seconds.values()) / 60:.1f} min one after another. The slowest: {slowest}."
    )
    drawn = report_plots.plot_times(list(seconds.values()))
    return Summary(said, _caption_plot(drawn, "How long the submissions took to run."))


def _show_alike(report: ClassReport) -> Alike:
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
    caption = "Where, who, and how much of it" + (
        f"; the {MOST_PAIRS} most alike" if found.found > MOST_PAIRS else ""
    )
    return Alike(said, caption, [_show_pair(report, pair) for pair in found.pairs])


def _show_pair(report: ClassReport, pair: AlikeSubmissions) -> AlikePair:
    texts = report.texts[pair.where]
    rows = side_by_side(texts[pair.left], texts[pair.right])
    return AlikePair(
        pair.where, report.data.display_name(pair.left), report.data.display_name(pair.right),
        f"{100 * pair.similarity:.0f} %", [_show_line(report, *row) for row in rows],
    )  # fmt: skip


def _show_line(report: ClassReport, kind: str, left: str, right: str) -> ComparedLine:
    given = kind == "same" and report.given.is_given(left)
    return ComparedLine(
        "given" if given else kind, left[:MAX_NAME_CHARS], _MARKS[kind], right[:MAX_NAME_CHARS]
    )


def _caption_plot(svg: str, caption: str) -> ReportPlot:
    # It is safe as it is: matplotlib has escaped every text that it has drawn.
    return ReportPlot(Markup(svg.removeprefix("<svg")), caption)


def _list_names(report: ClassReport, students: Sequence[str]) -> Names:
    called = [report.data.display_name(student) for student in students]
    first, more = called[:MOST_NAMES], called[MOST_NAMES:]
    return Names(_join_names(first), _join_names(more), len(more))


def _join_names(names: Iterable[str]) -> str:
    return ", ".join(names)
