"""The plots of the item report, as SVG to stand inside the page: no file, no script, no request.

Each plot states its n itself, so that nobody reads more out of it than is in it.
"""

from __future__ import annotations

import textwrap
from typing import Any

import matplotlib as mpl

from quizzes.insight.analysis import EASY, FLAT, HARD, Analysis
from quizzes.insight.svg import new_axes, svg_of

# Colours that people with any colour vision can tell apart (Okabe and Ito), with a marker each.
_LOOKS = [
    ("#0072b2", "o"),
    ("#d55e00", "s"),
    ("#009e73", "^"),
    ("#cc79a7", "D"),
    ("#8a6d00", "v"),
    ("#444444", "P"),
]
_STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",  # text stays text: it can be read aloud, searched and zoomed
    "svg.hashsalt": "quizzes",  # the same figures give the same page
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
}
_BARS = 15
"""Most misconceptions in the plot; the table has them all."""


def plot_items(analysis: Analysis) -> str:
    """Return difficulty against discrimination, a mark for each variant that has both."""
    with mpl.rc_context(_STYLE):
        figure, axes = new_axes(8.0, 4.8)
        axes.axhline(0, color="#666666", linewidth=0.8)
        axes.axhspan(-1, FLAT, color="#d55e00", alpha=0.08, linewidth=0)
        for bound in (HARD, EASY):
            axes.axvline(bound, color="#666666", linewidth=0.8, linestyle=":")
        for number, concept in enumerate(analysis.bank.concepts):
            shown = [
                (figures, figures.difficulty, figures.discrimination)
                for figures in analysis.variants
                if figures.concept == concept.id
                and figures.difficulty is not None
                and figures.discrimination is not None
            ]
            colour, marker = _LOOKS[number % len(_LOOKS)]
            axes.scatter(
                [p for _, p, _ in shown], [r for _, _, r in shown],
                color=colour, marker=marker, s=45, label=concept.id, zorder=3,
            )  # fmt: skip
            for figures, p, r in shown:
                variant = figures.id.removeprefix(f"{concept.id}-")
                label = f"{variant} (n = {figures.learners})"
                axes.annotate(label, (p, r), xytext=(6, 3), textcoords="offset points", fontsize=8)
        axes.set(
            xlim=(-0.03, 1.06), ylim=(-1.05, 1.05),
            xlabel="difficulty p: mean credit (further right is easier)",
            ylabel="discrimination: correlation with the rest",
        )  # fmt: skip
        axes.legend(loc="lower left", fontsize=8, title="concept", title_fontsize=8)
        return svg_of(figure, "items")


def plot_beliefs(analysis: Analysis) -> str:
    """Return the most common misconceptions as bars; "" if nobody has shown one."""
    shown = [figures for figures in analysis.beliefs if figures.holders][:_BARS][::-1]
    if not shown:
        return ""
    with mpl.rc_context(_STYLE):
        figure, axes = new_axes(8.0, 0.9 + 0.46 * len(shown))
        places = range(len(shown))
        axes.barh(places, [100 * f.share for f in shown], color="#d55e00", height=0.62)
        axes.set_yticks(places, [textwrap.fill(f.belief, 52) for f in shown], fontsize=8)
        for place, figures in zip(places, shown, strict=True):
            text = f"{figures.holders} of {figures.met}"
            axes.annotate(text, (100 * figures.share, place), xytext=(4, -3),
                          textcoords="offset points", fontsize=8)  # fmt: skip
        axes.set(xlim=(0, 112), xlabel="% of the learners whom a question tempted")
        return svg_of(figure, "beliefs")


def plot_scores(analysis: Analysis) -> str:
    """Return how many learners have which score, to the nearest half point."""
    most = len(analysis.bank.concepts)
    steps = [half / 2 for half in range(2 * most + 1)]
    halves = [round(2 * score) / 2 for score in analysis.scores]
    attempts = f"points in the first attempt (n = {len(halves)})"
    with mpl.rc_context(_STYLE):
        figure, axes = new_axes(8.0, 2.6)
        axes.bar(steps, [halves.count(step) for step in steps], width=0.42, color="#0072b2")
        axes.set(xlim=(-0.4, most + 0.4), xticks=range(most + 1),
                 xlabel=attempts, ylabel="learners")  # fmt: skip
        axes.yaxis.get_major_locator().set_params(integer=True)
        return svg_of(figure, "scores")
