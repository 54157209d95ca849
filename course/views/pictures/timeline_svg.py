"""A timeline as an SVG document, from the frame that its view sends to the browser."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from course.views.pictures.svg_text import make_document, make_element

_LANES_PX, _LABEL_PX, _LANE_PX, _PLOT_PX, _SPACE_PX = 640, 190, 20, 40, 12
_COLOURS = ("#1565c0", "#2e7d32", "#ef6c00")
_STYLE = """
text { font: 11px sans-serif; fill: #616161; }
.end { text-anchor: end; }
.title { font: 13px sans-serif; fill: #212121; }
.axis { stroke: #bdbdbd; }
.gap { fill: #c62828; opacity: 0.18; }
.drop { fill: #c62828; }
polyline { fill: none; stroke: #212121; stroke-width: 1.4; }
.rate { stroke: #1565c0; }
.p95 { stroke: #c62828; stroke-dasharray: 4 2; }
"""


def draw_timeline_svg(frame: dict[str, Any]) -> str:
    """Return the lanes and plots of a frame of the timeline's view."""
    parts: list[str] = []
    top = 0.0
    for topic in frame["topics"]:
        parts += _draw_topic(topic, frame, top)
        top += _topic_height(topic)
    title = "; ".join(f"{topic['name']}: {topic['text']}" for topic in frame["topics"])
    return make_document(_STYLE, title, (0, 0, _LABEL_PX + _LANES_PX + 10, top), *parts)


def _topic_height(topic: dict[str, Any]) -> float:
    return 24 + len(topic["lanes"]) * _LANE_PX + 2 * (_PLOT_PX + _SPACE_PX) + 26


def _draw_topic(topic: dict[str, Any], frame: dict[str, Any], top: float) -> Iterator[str]:
    yield _text(4, top + 16, f"{topic['name']} {topic['text']}", "title")
    top += 24
    lanes_end = top + len(topic["lanes"]) * _LANE_PX
    for begin, end in topic["gaps"]:
        x = _place(begin)
        width = max(1.0, _place(end) - x)
        shape = {"x": x, "y": top, "width": width, "height": lanes_end - top}
        yield make_element("rect", {"class": "gap", **shape})
    for row, lane in enumerate(topic["lanes"]):
        yield from _draw_lane(lane, row, top + row * _LANE_PX, frame["columns"])
    rate = [("rate", topic["rate"])]
    yield from _draw_plot("rate", "Hz", rate, lanes_end + _SPACE_PX)
    latency = [("p50", topic["p50"]), ("p95", topic["p95"])]
    plot_top = lanes_end + 2 * _SPACE_PX + _PLOT_PX
    yield from _draw_plot("latency p50, p95", "ms", latency, plot_top)
    yield _text(_LABEL_PX, plot_top + _PLOT_PX + 16, f"-{frame['window']:g} s")
    yield _text(_LABEL_PX + _LANES_PX, plot_top + _PLOT_PX + 16, "now", "end")


def _draw_lane(lane: dict[str, Any], row: int, top: float, columns: int) -> Iterator[str]:
    base, most = top + _LANE_PX - 2, max([1, *lane["counts"]])
    yield _text(_LABEL_PX - 8, top + 14, lane["label"][-32:], "end")
    yield _axis(base)
    strokes = " ".join(
        f"M{_place((place + 0.5) / columns):.1f},{base:g} "
        f"v{-(0.35 + 0.65 * count / most) * (_LANE_PX - 5):.1f}"
        for place, count in enumerate(lane["counts"])
        if count
    )
    colour = _COLOURS[min(row, len(_COLOURS) - 1)]
    yield make_element("path", {"d": strokes, "stroke": colour, "stroke-width": 1.6})
    for place, _ in lane["drops"]:
        path = f"M{_place(place):.1f},{top:g} m-4,0 h8 l-4,7 Z"
        yield make_element("path", {"class": "drop", "d": path})


def _draw_plot(
    name: str, unit: str, lines: list[tuple[str, list[float | None]]], top: float
) -> Iterator[str]:
    """Draw lines over one axis from 0 to the largest value."""
    values = [value for _, line in lines for value in line if value is not None]
    most = max([0.01, *values])
    yield _text(_LABEL_PX - 8, top + 12, name, "end")
    said = f"up to {most:.3g} {unit}" if values else "nothing yet"
    yield _text(_LABEL_PX - 8, top + 26, said, "end")
    yield _axis(top + _PLOT_PX)
    for kind, line in lines:
        points = " ".join(
            f"{_place((place + 0.5) / len(line)):.1f},"
            f"{top + _PLOT_PX - value / most * (_PLOT_PX - 4):.1f}"
            for place, value in enumerate(line)
            if value is not None
        )
        yield make_element("polyline", {"class": kind, "points": points})


def _place(share: float) -> float:
    """Return the x of a moment, given as a share of the window."""
    return _LABEL_PX + min(1.0, max(0.0, share)) * _LANES_PX


def _axis(y: float) -> str:
    ends = {"x1": _LABEL_PX, "x2": _LABEL_PX + _LANES_PX, "y1": y, "y2": y}
    return make_element("line", {"class": "axis", **ends})


def _text(x: float, y: float, text: str, kind: str = "") -> str:
    return make_element("text", {"class": kind, "x": x, "y": y}, text=text)
