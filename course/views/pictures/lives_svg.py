"""What a process holds over lives of a node, as a small SVG: a plot for each kind of thing."""

from __future__ import annotations

from collections.abc import Sequence

from course.views.pictures.svg_text import make_element
from course.watch.lives import Held

WIDTH, HEIGHT = 660, 140
_PLOT_PX, _GAP_PX, _LEFT_PX, _TOP_PX, _BOTTOM_PX = 170, 50, 34, 34, 104
_FLAT, _GROWN = "#2b9348", "#d1600a"
"""Colours of which each has a contrast of 3 to 1 and more on white and on nearly black."""


def draw_lives(held: Sequence[Held], names: Sequence[str], words: str) -> str:
    """Return an SVG of what was held before the lives (0) and after each; ``words`` describe it."""
    plots = (
        _draw_plot(name, list(values), number * (_PLOT_PX + _GAP_PX) + _LEFT_PX)
        for number, (name, values) in enumerate(zip(names, zip(*held, strict=True), strict=True))
    )
    return make_element(
        "svg",
        {
            "xmlns": "http://www.w3.org/2000/svg", "viewBox": f"0 0 {WIDTH} {HEIGHT}",
            "width": WIDTH, "height": HEIGHT, "role": "img", "aria-label": words,
            "style": "max-width:100%;height:auto;display:block", "font-size": 12,
            "font-family": "system-ui, sans-serif", "fill": "currentColor",
        },
        *plots,
    )  # fmt: skip


def _draw_plot(name: str, values: list[int], left: float) -> str:
    """Return one plot: squares where a life has left something, joined dots else."""
    low, high = min(values), max(max(values), min(values) + 4)
    right = left + _PLOT_PX

    def place(life: int) -> tuple[float, float]:
        share = (values[life] - low) / (high - low)
        x = left + _PLOT_PX * life / (len(values) - 1)
        return x, _BOTTOM_PX - (_BOTTOM_PX - _TOP_PX) * share

    dots = [place(life) for life in range(len(values))]
    grown = values[-1] - values[0]
    colour = _GROWN if grown > 0 else _FLAT
    last = len(values) - 1
    return "".join([
        _text(left, 14, f"{name}: {grown:+d}" if grown else f"{name}: none left", "start", "bold"),
        _line(left, _BOTTOM_PX + 8, right),
        _text(left - 8, dots[0][1] + 4, str(values[0]), "end"),
        *([_text(left - 8, dots[-1][1] + 4, str(values[-1]), "end")] if grown else []),
        make_element("polyline", {
            "points": " ".join(f"{x:.1f},{y:.1f}" for x, y in dots),
            "fill": "none", "stroke": colour, "stroke-width": 1.5,
        }),
        *(_mark(x, y, colour, is_square=grown > 0) for x, y in dots),
        _text(left, HEIGHT - 8, "before", "start"),
        _text(right, HEIGHT - 8, f"life {last}", "end"),
    ])  # fmt: skip


def _mark(x: float, y: float, colour: str, *, is_square: bool) -> str:
    if is_square:
        place = {"x": f"{x - 3.5:.1f}", "y": f"{y - 3.5:.1f}", "width": 7, "height": 7}
        return make_element("rect", {**place, "fill": colour})
    return make_element("circle", {"cx": f"{x:.1f}", "cy": f"{y:.1f}", "r": 3.5, "fill": colour})


def _line(left: float, y: float, right: float) -> str:
    ends = {"x1": left, "y1": y, "x2": right, "y2": y}
    return make_element("line", {**ends, "stroke": "currentColor", "stroke-opacity": 0.3})


def _text(x: float, y: float, text: str, anchor: str, weight: str = "normal") -> str:
    place = {"x": f"{x:.1f}", "y": f"{y:.1f}", "text-anchor": anchor, "font-weight": weight}
    return make_element("text", place, text=text)
