"""The item report: one HTML file that needs nothing else, and its figures as CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path

from quizzes.attempts.sharing import CANNOT_KNOW
from quizzes.errors import QuizError
from quizzes.insight import plots
from quizzes.insight.analysis import FEW, Analysis, ItemFigures

ITEM_COLUMNS = ("item", "kind", "learners", "difficulty", "discrimination", "advice")
BELIEF_COLUMNS = ("misconception", "belief", "holders", "met", "share")

_STYLE = """
:root { color-scheme: light dark; }
body { font: 1rem/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; }
figure { margin: 1rem 0; background: #fff; color: #000; border-radius: .4rem; padding: .5rem; }
figure svg { width: 100%; height: auto; }
table { border-collapse: collapse; width: 100%; }
th, td { text-align: left; padding: .25rem .6rem; border-bottom: 1px solid #8888; }
td.number { text-align: right; font-variant-numeric: tabular-nums; }
th { font-weight: normal; white-space: nowrap; }
thead th, tr.concept > * { font-weight: 600; }
caption { text-align: left; padding: .4rem .6rem; }
.scroll { overflow-x: auto; }
"""


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
    bank, learners = analysis.bank, analysis.learners
    parts = [
        f"<h1>{escape(bank.title)}</h1>",
        f"<p>{escape(bank.chapter)}. First attempts of {learners} "
        f"{'learner' if learners == 1 else 'learners'}; {analysis.passed} passed "
        f"({escape(bank.pass_text)}).</p>",
    ]
    if learners < FEW:
        few = f"With fewer than {FEW} learners these figures say little."
        parts.append(f"<p><strong>{few}</strong></p>")
    if learners:
        parts.append(
            _render_figure(plots.plot_scores(analysis), "How many learners have which score.")
        )
    parts += ["<h2>Questions</h2>", _EXPLAINED]
    if any(v.discrimination is not None for v in analysis.variants):
        caption = "Each mark is a variant, numbered within its concept; the table has the figures."
        parts.append(_render_figure(plots.plot_items(analysis), caption))
    parts.append(_render_table("Figures of each concept and of its variants", ITEM_COLUMNS,
                        item_rows(analysis), numbers=(2, 3, 4)))  # fmt: skip
    parts += _render_beliefs(analysis) if analysis.beliefs else []
    if analysis.notes:
        items = "".join(f"<li>{escape(note)}</li>" for note in analysis.notes)
        parts.append(f"<h2>Notes</h2><ul>{items}</ul>")
    parts.append(f"<h2>What a quiz cannot know</h2><p>{escape(CANNOT_KNOW)}</p>")
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(bank.title)}</title><style>{_STYLE}</style></head>\n"
        f"<body><main>{''.join(parts)}</main></body></html>\n"
    )


def _render_beliefs(analysis: Analysis) -> list[str]:
    parts = ["<h2>What the class believes</h2>"]
    if drawn := plots.plot_beliefs(analysis):
        caption = "The most common misconceptions among those whom a question tempted with them."
        parts.append(_render_figure(drawn, caption))
    parts.append(_render_table("All misconceptions of the bank", BELIEF_COLUMNS,
                        belief_rows(analysis), numbers=(2, 3, 4)))  # fmt: skip
    return parts


_EXPLAINED = (
    "<p><em>Difficulty</em> is the mean credit, from 0 (nobody) to 1 (everybody). "
    "<em>Discrimination</em> is the correlation of the credit with the score on the other "
    "questions: above 0.3 a question tells well who knows, near 0 it does not, and below 0 "
    "something is wrong with it. Learners get one variant of each concept, so a variant has "
    "fewer learners than its concept.</p>"
)


def _render_figure(svg: str, caption: str) -> str:
    described = svg.replace("<svg", f'<svg role="img" aria-label="{escape(caption)}"', 1)
    return f"<figure>{described}<figcaption>{escape(caption)}</figcaption></figure>"


def _render_table(
    caption: str, columns: Sequence[str], rows: Iterable[Sequence[str]], numbers: Sequence[int]
) -> str:
    head = "".join(f'<th scope="col">{escape(column)}</th>' for column in columns)
    body = "".join(_render_row(row, numbers) for row in rows)
    return (
        f'<div class="scroll"><table><caption>{escape(caption)}</caption>'
        f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>"
    )


def _render_row(row: Sequence[str], numbers: Sequence[int]) -> str:
    cells = "".join(
        f'<td class="{"number" if place in numbers else "text"}">{escape(value)}</td>'
        for place, value in enumerate(row)
        if place
    )
    kind = ' class="concept"' if row[1] == "concept" else ""
    return f'<tr{kind}><th scope="row">{escape(row[0])}</th>{cells}</tr>'


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
