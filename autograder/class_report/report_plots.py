"""The plots of the class report, as SVG to stand inside the page: no file, script or request.

Each plot states its n itself, so that nobody reads more out of it than is in it.
"""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

from autograder.class_report.figures import FLAT, CheckFigures
from quizzes.insight.svg import new_axes, svg_of

# Colours that people with any colour vision can tell apart (Okabe and Ito), each with a pattern.
_PARTS = (
    ("passed", "#009e73", ""),
    ("failed", "#d55e00", "//"),
    ("not checked", "#bbbbbb", ".."),
    ("grader error", "#cc79a7", "xx"),
)
_STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",  # text stays text: it can be read aloud, searched and zoomed
    "svg.hashsalt": "autograder",  # the same figures give the same page
    "text.parse_math": False,  # a dollar in a title is a dollar
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "hatch.linewidth": 0.6,
    "hatch.color": "white",
}


def plot_scores(earned: Sequence[float], most: float) -> str:
    """Return how many students have how many points, in at most twenty steps up to ``most``."""
    steps = max(1, min(20, round(most)))
    with mpl.rc_context(_STYLE):
        figure, axes = new_axes(8.0, 2.8)
        top = max([most, *earned]) or 1.0
        axes.hist(earned, bins=steps, range=(0, top), color="#0072b2", edgecolor="white")
        axes.set(xlim=(0, top), xlabel=f"points (n = {len(earned)})", ylabel="students")
        axes.yaxis.get_major_locator().set_params(integer=True)
        return svg_of(figure, "scores")


def plot_times(seconds: Sequence[float]) -> str:
    """Return how many submissions took how long, in seconds."""
    with mpl.rc_context(_STYLE):
        figure, axes = new_axes(8.0, 2.4)
        top = max(seconds) or 1.0
        axes.hist(seconds, bins=20, range=(0, top), color="#56b4e9", edgecolor="white")
        taken = f"seconds that a submission took (n = {len(seconds)})"
        axes.set(xlim=(0, top), xlabel=taken, ylabel="submissions")
        axes.yaxis.get_major_locator().set_params(integer=True)
        return svg_of(figure, "times")


def plot_checks(shown: Sequence[CheckFigures], name: str) -> str:
    """Return what came of each check, beside its discrimination, both with the n of each row.

    Args:
        shown: the checks of one notebook, from top to bottom.
        name: begins the ids inside the SVG, so that several can stand on one page.
    """
    places = range(len(shown))
    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=(9.0, 1.6 + 0.5 * len(shown)), layout="constrained")
        left, right = figure.subplots(1, 2, sharey=True, width_ratios=[3, 2])
        _draw_bars(left, shown)
        _say_n(left, [sum(_outcome_counts(c)) for c in shown])
        left.set_yticks(places, [textwrap.fill(c.title, 40) for c in shown], fontsize=8)
        left.set(xlim=(0, 100), xlabel="% of the submissions", ylim=(len(shown) - 0.4, -0.6))
        left.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4, fontsize=8,
                    frameon=False)  # fmt: skip
        known = [(place, c.discrimination) for place, c in zip(places, shown, strict=True)
                 if c.discrimination is not None]  # fmt: skip
        right.axvspan(-1, FLAT, color="#d55e00", alpha=0.08, linewidth=0)
        right.axvline(0, color="#666666", linewidth=0.8)
        right.hlines([place for place, _ in known], 0, [r for _, r in known], color="#0072b2")
        right.scatter([r for _, r in known], [place for place, _ in known], color="#0072b2", s=36)
        right.set(xlim=(-1.05, 1.05), xlabel="discrimination")
        right.tick_params(axis="y", length=0)
        _say_n(right, [c.examined_count for c in shown])
        return svg_of(figure, name)


def _outcome_counts(check: CheckFigures) -> tuple[int, ...]:
    return check.passed, check.failed, check.not_checked, check.grader_errors


def _say_n(axes: Any, numbers: Sequence[int]) -> None:
    """Write at the end of each row of how many it is."""
    for place, number in enumerate(numbers):
        axes.annotate(f"n = {number}", (1, place), xycoords=("axes fraction", "data"),
                      xytext=(4, 0), textcoords="offset points", va="center",
                      fontsize=8)  # fmt: skip


def _draw_bars(axes: Any, shown: Sequence[CheckFigures]) -> None:
    counts = [_outcome_counts(c) for c in shown]
    starts = [0.0] * len(shown)
    for number, (label, colour, hatch) in enumerate(_PARTS):
        widths = [100 * row[number] / (sum(row) or 1) for row in counts]
        axes.barh(range(len(shown)), widths, left=starts, color=colour, hatch=hatch, height=0.62,
                  label=label)  # fmt: skip
        starts = [start + width for start, width in zip(starts, widths, strict=True)]
