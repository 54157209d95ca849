"""A picture as a small SVG: the same in a notebook and on a feedback page, light and dark.

What is drawn is told by shapes, and by colours only besides. Lines and texts have the colour of the
text around them. Nothing in it has an id, so that many of them can stand on a page.
"""

from __future__ import annotations

import math
from html import escape
from itertools import pairwise
from statistics import median
from typing import NamedTuple

from autograder.examination.pictures.picture import SPAN_KINDS, Lane, Picture, Series, Timeline
from autograder.examination.pictures.wording import describe_picture

WIDTH, HEIGHT = 640, 160
LEFT, RIGHT = 184, 622
"""Where time begins and ends (px): labels are before it."""
TITLE_PX, AXIS_PX, LEGEND_PX, LANE_PX = 22, 22, 18, 26
CHAR_PX, SAMPLE_PX, GAP_PX = 6.6, 22, 14
"""About how wide a character is, a sample in the legend, and the room between two of these."""
MOST_TICKS, MOST_VALUES = 7, 4
PLOT_LEFT, PLOT_TOP, PLOT_BOTTOM = 64.0, 40.0, 124.0
"""The room (px) for the points of a series: values are before it, and rounds below."""

GOOD, BAD = "#2b9348", "#d1600a"
"""Colours of which each has a contrast of 3 to 1 and more on white and on nearly black."""


def draw_picture(picture: Picture) -> str:
    """Return an SVG of a picture, of at most 640 x 160 px, with its words as a description."""
    if isinstance(picture, Series):
        body, height = _draw_series(picture), HEIGHT
    else:
        body, height = _draw_timeline(picture)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" '
        f'width="{WIDTH}" height="{height}" role="img" '
        f'aria-label="{escape(describe_picture(picture))}" '
        'style="max-width:100%;height:auto;display:block" '
        'font-family="system-ui, sans-serif" font-size="12" fill="currentColor">'
        f"<title>{escape(picture.title)}</title><desc>{escape(describe_picture(picture))}</desc>"
        f"{_text(0, 13, picture.title, weight='bold')}{body}</svg>"
    )


def _draw_timeline(timeline: Timeline) -> tuple[str, int]:
    """Return the rows, the axis and the legend, and the height of all."""
    items = _place_legend(timeline)
    legend_rows = max((row for row, _, _, _ in items), default=-1) + 1
    room = HEIGHT - TITLE_PX - AXIS_PX - legend_rows * LEGEND_PX
    lane_px = min(LANE_PX, room // len(timeline.lanes))
    axis_y = TITLE_PX + lane_px * len(timeline.lanes)
    parts = [_draw_axis(timeline.seconds, axis_y)]
    for number, lane in enumerate(timeline.lanes):
        y = TITLE_PX + lane_px * number + lane_px / 2
        parts.append(_draw_lane(lane, y, lane_px, timeline.seconds))
    for row, x, kind, words in items:
        y = axis_y + AXIS_PX + row * LEGEND_PX + LEGEND_PX / 2
        parts.append(_draw_sample(kind, x, y) + _text(x + SAMPLE_PX, y + 4, words))
    return "".join(parts), axis_y + AXIS_PX + legend_rows * LEGEND_PX


def _place_legend(timeline: Timeline) -> list[tuple[int, float, str, str]]:
    """Return (row, x, kind, words) of what the legend explains."""
    items: list[tuple[int, float, str, str]] = []
    row, x = 0, 0.0
    seen = timeline.kinds()
    for kind, words in timeline.legend:
        if kind not in seen:
            continue
        wide = SAMPLE_PX + len(words) * CHAR_PX + GAP_PX
        if x and x + wide > WIDTH + GAP_PX:
            row, x = row + 1, 0.0
        items.append((row, x, kind, words))
        x += wide
    return items


def _draw_sample(kind: str, x: float, y: float) -> str:
    if kind in SPAN_KINDS:
        return _span(x + 1, x + 17, y, 11, kind)
    return _mark(x + 9, y, 4.0, kind)


def _draw_axis(seconds: float, y: float) -> str:
    step = tick_step(seconds, MOST_TICKS)
    parts = [_line(LEFT, y, RIGHT, y), _text(0, y + 16, "time")]
    count = math.floor(seconds / step + 1e-9)
    for number in range(count + 1):
        x = _x_of(number * step, seconds)
        unit = " s" if number == count else ""
        parts.append(_line(x, y, x, y + 4))
        parts.append(_text(x, y + 16, f"{number * step:g}{unit}", anchor="middle"))
    return "".join(parts)


def tick_step(length: float, most: int) -> float:
    """Return a round step of which at most so many are in a length.

    Example:
        >>> tick_step(1.6, 7), tick_step(11, 7)
        (0.5, 2.0)
    """
    step = 10.0 ** math.floor(math.log10(length / most))
    for factor in (1, 2, 5, 10):
        if length / (step * factor) <= most:
            return step * factor
    return step * 10


def _x_of(at: float, seconds: float) -> float:
    return LEFT + (RIGHT - LEFT) * min(max(at / seconds, 0.0), 1.0)


def _draw_lane(lane: Lane, y: float, height: float, seconds: float) -> str:
    places = [_x_of(at, seconds) for at, _ in lane.marks]
    gaps = [b - a for a, b in pairwise(places) if b > a] or [WIDTH]
    radius = min(4.5, max(1.5, median(gaps) * 0.42), height / 2 - 3)
    parts = [_line(LEFT, y, RIGHT, y, opacity=0.25), _text(0, y + 4, lane.label)]
    for begin, end, kind in lane.spans:
        parts.append(_span(_x_of(begin, seconds), _x_of(end, seconds), y, height - 8, kind))
    parts += [_mark(x, y, radius, kind) for x, (_, kind) in zip(places, lane.marks, strict=True)]
    return "".join(parts)


def _span(left: float, right: float, y: float, height: float, kind: str) -> str:
    place = (
        f'x="{left:.1f}" y="{y - height / 2:.1f}" width="{max(right - left, 2):.1f}" '
        f'height="{height:.1f}" rx="2"'
    )
    look = {
        "busy": 'fill="currentColor" fill-opacity="0.16"',
        "allowed": f'fill="{GOOD}" fill-opacity="0.16" stroke="{GOOD}"',
    }[kind]
    return f"<rect {place} {look}/>"


def _mark(x: float, y: float, radius: float, kind: str) -> str:
    if kind == "done":
        return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius:.1f}" fill="{GOOD}"/>'
    if kind == "lost":
        return (
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{max(radius - 0.5, 1):.1f}" fill="none" '
            'stroke="currentColor"/>'
        )
    if kind == "event":
        r = radius * 1.2
        sides = f"l{r:.1f} {r:.1f}l{-r:.1f} {r:.1f}l{-r:.1f} {-r:.1f}z"
        return f'<path d="M{x:.1f} {y - r:.1f}{sides}"/>'
    if kind == "due":
        return _line(x, y - 7, x, y + 7, opacity=0.7)
    r = radius * 0.9
    return (
        f'<path d="M{x - r:.1f} {y - r:.1f}l{2 * r:.1f} {2 * r:.1f}m0 {-2 * r:.1f}'
        f'l{-2 * r:.1f} {2 * r:.1f}" stroke="{BAD}" stroke-width="2" fill="none"/>'
    )


class _Plot(NamedTuple):
    """Where the points of a series are: its least round and value, and how far both go."""

    low_x: float
    wide: float
    low_y: float
    high_y: float
    step_y: float

    def place(self, x: float, y: float) -> tuple[float, float]:
        """Return the place (px) of a point."""
        return (
            PLOT_LEFT + (RIGHT - PLOT_LEFT) * (x - self.low_x) / self.wide,
            PLOT_BOTTOM - (PLOT_BOTTOM - PLOT_TOP) * (y - self.low_y) / (self.high_y - self.low_y),
        )


def _plot_of(series: Series) -> _Plot:
    xs = [x for x, _ in series.points]
    ys = [y for _, y in series.points]
    wide = max(xs) - min(xs)
    step = tick_step(max(max(ys) - min(ys), 1.0), MOST_VALUES)
    low, high = math.floor(min(ys) / step) * step, math.ceil(max(ys) / step) * step
    return _Plot(min(xs), wide if wide > 1e-6 else 1.0, low, max(high, low + step), step)


def _draw_series(series: Series) -> str:
    """Return points that are joined by a line, over an axis of rounds."""
    plot = _plot_of(series)
    parts = _draw_grid(plot)
    dots = [plot.place(x, y) for x, y in series.points]
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in dots)
    parts.append(f'<polyline points="{path}" fill="none" stroke="{BAD}" stroke-width="1.5"/>')
    parts += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{BAD}"/>' for x, y in dots]
    parts.append(_text((PLOT_LEFT + RIGHT) / 2, HEIGHT - 4, series.x_label, anchor="middle"))
    parts.append(_text(0, PLOT_TOP - 6, series.y_label))
    return "".join(parts)


def _draw_grid(plot: _Plot) -> list[str]:
    parts = []
    for number in range(round((plot.high_y - plot.low_y) / plot.step_y) + 1):
        value = plot.low_y + number * plot.step_y
        _, y = plot.place(plot.low_x, value)
        parts.append(_line(PLOT_LEFT, y, RIGHT, y, opacity=0.25))
        parts.append(_text(PLOT_LEFT - 6, y + 4, f"{value:g}", anchor="end"))
    step = max(1.0, tick_step(plot.wide, MOST_TICKS))  # there is no half of a round
    for number in range(math.floor(plot.wide / step + 1e-9) + 1):
        value = plot.low_x + number * step
        x, _ = plot.place(value, plot.low_y)
        parts.append(_line(x, PLOT_BOTTOM, x, PLOT_BOTTOM + 4))
        parts.append(_text(x, PLOT_BOTTOM + 16, f"{value:g}", anchor="middle"))
    return parts


def _line(x: float, y: float, to_x: float, to_y: float, *, opacity: float = 1.0) -> str:
    faint = f' stroke-opacity="{opacity:g}"' if opacity < 1 else ""
    return (
        f'<line x1="{x:.1f}" y1="{y:.1f}" x2="{to_x:.1f}" y2="{to_y:.1f}" '
        f'stroke="currentColor"{faint}/>'
    )


def _text(x: float, y: float, text: str, *, anchor: str = "", weight: str = "") -> str:
    more = (f' text-anchor="{anchor}"' if anchor else "") + (
        f' font-weight="{weight}"' if weight else ""
    )
    return f'<text x="{x:.1f}" y="{y:.1f}"{more}>{escape(text)}</text>'
