"""The shapes of a graph's parts, one convention for every drawing.

As rqt_graph draws them, nodes are ellipses and topics boxes; services are hexagons, actions framed.
Mermaid has no ellipse: its nearest is a box with round ends.
"""

from __future__ import annotations

import math

MERMAID = {
    "node": ("([", "])"),
    "topic": ("[", "]"),
    "service": ("{{", "}}"),
    "action": ("[[", "]]"),
}
"""What Mermaid writes before and after the text of a part, by kind."""

_CORNER_PX = 12  # px by which a hexagon is cut at its sides
_FRAME_PX = 5  # px between the two lines of a frame


def draw_outline(kind: str, x: float, y: float, width: float, height: float) -> str:
    """Return the outline of a part as an SVG path; ``x``, ``y`` is its left upper corner in px."""
    if kind == "node":
        a, b = width / 2, height / 2
        return f"M{x:g},{y + b:g} a{a:g},{b:g} 0 1 1 {width:g},0 a{a:g},{b:g} 0 1 1 {-width:g},0 Z"
    if kind == "service":
        side, c = width - 2 * _CORNER_PX, _CORNER_PX
        return (
            f"M{x:g},{y + height / 2:g} l{c},{-height / 2:g} h{side:g} l{c},{height / 2:g} "
            f"l{-c},{height / 2:g} h{-side:g} Z"
        )
    box = f"M{x:g},{y:g} h{width:g} v{height:g} h{-width:g} Z"
    if kind == "action":
        box += f" M{x + _FRAME_PX:g},{y:g} v{height:g} M{x + width - _FRAME_PX:g},{y:g} v{height:g}"
    return box


def find_inset(kind: str, aside: float, along: float, across: float) -> float:
    """Return how far inside its bounding box a part's side is, ``aside`` px from the side's middle.

    ``along`` is half the length of that side, ``across`` half the part's extent across it, in px.
    """
    share = min(1.0, abs(aside) / along)
    if kind == "node":
        return across * (1 - math.sqrt(1 - share**2))
    return 0.0
