"""The ROS graph as an SVG document, from the frame that its view sends to the browser."""

from __future__ import annotations

from typing import Any

from course.graph.labels import LINE_PX
from course.views.pictures.svg_text import make_document, make_element

WIDEST_PX = 900
"""A drawing that is wider flows downwards, as in a narrow window."""

_STYLE = """
text { font: 13px sans-serif; fill: #212121; text-anchor: middle; }
.note, .label { font-size: 11px; fill: #616161; }
.label { paint-order: stroke; stroke: #fff; stroke-width: 4px; }
.box { fill: #fff; stroke: #616161; }
.node { fill: #eee; stroke: #1565c0; stroke-width: 1.5; }
.line { fill: none; stroke: #616161; marker-end: url(#good); }
.box.bad { stroke: #c62828; stroke-width: 2; }
.line.bad { stroke: #c62828; stroke-dasharray: 5 3; marker-end: url(#bad); }
.label.bad { fill: #c62828; }
.reason { font-weight: bold; }
"""
_MARKER = {
    "viewBox": "0 0 8 8", "refX": 8, "refY": 4, "markerWidth": 8, "markerHeight": 8,
    "orient": "auto",
}  # fmt: skip
_ARROW = {"d": "M0,0 L8,4 L0,8 Z", "fill": "#616161"}
_CROSS = {"d": "M1,1 L7,7 M7,1 L1,7", "stroke": "#c62828", "fill": "none"}


def draw_graph_svg(frame: dict[str, Any]) -> str:
    """Return the drawing of a frame of the graph's view; empty if the frame has none."""
    drawing = frame if frame["width"] <= WIDEST_PX else frame.get("tall", frame)
    if not drawing["boxes"]:
        return ""
    markers = make_element(
        "defs", {},
        make_element("marker", {"id": "good", **_MARKER}, make_element("path", _ARROW)),
        make_element("marker", {"id": "bad", **_MARKER}, make_element("path", _CROSS)),
    )  # fmt: skip
    lines = [
        make_element("path", {"class": f"line{_bad(line)}", "d": line["path"]})
        for line in drawing["lines"]
    ]
    boxes = [part for box in drawing["boxes"] for part in _draw_box(box)]
    labels = [part for line in drawing["lines"] for part in _draw_labels(line)]
    size = (drawing["left"], 0, drawing["width"], drawing["height"])
    return make_document(_STYLE, frame["title"], size, markers, *lines, *boxes, *labels)


def _draw_box(box: dict[str, Any]) -> list[str]:
    middle, note = box["x"] + box["width"] / 2, box["note"]
    parts = [
        make_element("path", {"class": f"box {box['kind']}{_bad(box)}", "d": box["outline"]}),
        make_element(
            "text", {"x": middle, "y": box["y"] + (17 if note else 24)}, text=box["label"]
        ),
    ]
    if note:
        parts.append(
            make_element("text", {"class": "note", "x": middle, "y": box["y"] + 31}, text=note)
        )
    return parts


def _draw_labels(line: dict[str, Any]) -> list[str]:
    texts = [("label", line["qos"])] if line["qos"] else []
    texts += [("label reason", reason) for reason in line["reasons"]]
    return [
        make_element(
            "text",
            {"class": kind + _bad(line), "x": line["x"], "y": line["y"] + LINE_PX * row + 4},
            text=text,
        )
        for row, (kind, text) in enumerate(texts)
    ]


def _bad(thing: dict[str, Any]) -> str:
    return " bad" if thing["bad"] else ""
