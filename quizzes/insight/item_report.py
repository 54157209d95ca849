"""The item report: one HTML file that needs nothing else, and its figures as CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from markupsafe import Markup

from quizzes.attempts.sharing import CANNOT_KNOW
from quizzes.errors import QuizError
from quizzes.insight import item_plots
from quizzes.insight.analysis import FEW, Analysis, ItemFigures
from quizzes.text.html_pages import fill_template

ITEM_COLUMNS = ("item", "kind", "learners", "difficulty", "discrimination", "advice")
BELIEF_COLUMNS = ("misconception", "belief", "holders", "met", "share")

_TEMPLATE = Path(__file__).with_name("report.html.jinja")


@dataclass(frozen=True)
class Plot:
    """A plot and its caption; ``drawing`` is what follows its ``<svg``, which the page begins."""

    drawing: Markup
    caption: str


class ReportError(QuizError):
    """The report cannot be written; the message says where and why."""


def write_report(analysis: Analysis, folder: Path) -> list[Path]:
    """Write ``quiz-NAME-report.html``, ``-items.csv`` and ``-misconceptions.csv``; return them.

    The last one only if the bank names misconceptions.

    Raises:
        ReportError: the folder cannot be written.
    """
    name = f"quiz-{analysis.bank.quiz}"
    contents = {
        folder / f"{name}-report.html": render_page(analysis),
        folder / f"{name}-items.csv": _format_csv(ITEM_COLUMNS, item_rows(analysis)),
    }
    if analysis.beliefs:
        rows = belief_rows(analysis)
        contents[folder / f"{name}-misconceptions.csv"] = _format_csv(BELIEF_COLUMNS, rows)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for path, content in contents.items():
            path.write_text(content, encoding="utf-8")
    except OSError as error:
        raise ReportError(
            f"The report cannot be written in {folder} ({error.strerror or error}): make the "
            "folder writable, or name another one."
        ) from None
    return list(contents)


def item_rows(analysis: Analysis) -> list[tuple[str, ...]]:
    """Return the item table's rows: each concept, followed by its variants."""
    rows = []
    for concept in analysis.concepts:
        rows.append(_item_row(concept))
        rows += [_item_row(v) for v in analysis.variants if v.concept == concept.id]
    return rows


def belief_rows(analysis: Analysis) -> list[tuple[str, ...]]:
    """Return the misconception table's rows, the most common first."""
    return [
        (f.id, f.belief, str(f.holders), str(f.met), f"{f.share:.2f}" if f.met else "")
        for f in analysis.beliefs
    ]


def render_page(analysis: Analysis) -> str:
    """Return the report as one HTML page."""
    return fill_template(
        _TEMPLATE,
        title=analysis.bank.title,
        bank=analysis.bank,
        learners=analysis.learners,
        passed=analysis.passed,
        too_few=FEW if analysis.learners < FEW else 0,
        scores=_plot_scores(analysis),
        items=_plot_items(analysis),
        item_columns=ITEM_COLUMNS,
        item_rows=item_rows(analysis),
        beliefs=_plot_beliefs(analysis),
        belief_columns=BELIEF_COLUMNS,
        belief_rows=belief_rows(analysis),
        notes=analysis.notes,
        cannot_know=CANNOT_KNOW,
    )


def _plot_scores(analysis: Analysis) -> Plot | None:
    if not analysis.learners:
        return None
    return _caption_plot(item_plots.plot_scores(analysis), "How many learners have which score.")


def _plot_items(analysis: Analysis) -> Plot | None:
    if all(variant.discrimination is None for variant in analysis.variants):
        return None
    caption = "Each mark is a variant, numbered within its concept; the table has the figures."
    return _caption_plot(item_plots.plot_items(analysis), caption)


def _plot_beliefs(analysis: Analysis) -> Plot | None:
    drawn = item_plots.plot_beliefs(analysis) if analysis.beliefs else ""
    caption = "The most common misconceptions among those whom a question tempted with them."
    return _caption_plot(drawn, caption) if drawn else None


def _caption_plot(svg: str, caption: str) -> Plot:
    # It is safe as it is: matplotlib has escaped every text that it has drawn.
    return Plot(Markup(svg.removeprefix("<svg")), caption)


def _item_row(figures: ItemFigures) -> tuple[str, ...]:
    return (
        figures.id,
        figures.kind,
        str(figures.learners),
        "" if figures.difficulty is None else f"{figures.difficulty:.2f}",
        "" if figures.discrimination is None else f"{figures.discrimination:+.2f}",
        figures.advice,
    )


def _format_csv(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(rows)
    return buffer.getvalue()
