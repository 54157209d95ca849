"""Where to draw a graph's boxes: in layers with few crossings (Sugiyama's method)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import igraph

from course.graph import arrows
from course.graph.labels import LINE_PX, LabelPlaces, Rectangle, label_width
from course.graph.model import Graph
from course.graph.parts import Key, Link, Part, list_links, list_parts
from course.graph.shapes import draw_outline

BOX_HEIGHT_PX = 40  # px, with room for a name and a type below it
MAX_LABELS = 80
"""Arrows of a drawing at which the QoS stands; of a larger one only what does not connect."""

_CHARACTER, _LEAST_WIDTH, _LONGEST_LABEL = 7.5, 80, 34
_COLUMN_GAP, _ROW_GAP, _MARGIN = 70, 18, 8
_LAYER_GAP, _ASIDE_GAP = 36, 16  # px between the layers of a tall drawing, and inside of one

Way = Literal["wide", "tall"]
"""Layers from left to right, or from top to bottom, for a narrow page."""

WAYS: tuple[Way, ...] = ("wide", "tall")


@dataclass(frozen=True)
class Box:
    """A node, topic, service or action; ``x`` and ``y`` are the left upper corner in pixels.

    ``outline`` is its shape as an SVG path.
    """

    kind: str
    label: str
    note: str
    tip: str
    bad: bool
    x: float
    y: float
    width: float
    height: float = BOX_HEIGHT_PX
    outline: str = ""


@dataclass(frozen=True)
class Polyline:
    """An arrow: an SVG path, and a label whose first line has its middle at ``x``, ``y``.

    ``qos`` is the first line, ``reasons`` are those after it, which say why nothing passes.
    """

    kind: str
    path: str
    tip: str
    bad: bool
    qos: str
    reasons: tuple[str, ...]
    x: float
    y: float


@dataclass(frozen=True)
class Drawing:
    """A graph's boxes and lines, and the size of it all in pixels.

    ``left`` is the smallest x.
    """

    boxes: tuple[Box, ...]
    lines: tuple[Polyline, ...]
    width: float
    height: float
    left: float = 0.0


def count_boxes(graph: Graph) -> int:
    """Return how many boxes a drawing of ``graph`` has; no place is worked out for them."""
    return sum(1 for _ in list_parts(graph))


def draw_graph(graph: Graph, way: Way = "wide") -> Drawing:
    """Return a drawing of ``graph`` with its arrows from publisher to subscription."""
    parts = {(part.kind, part.name): part for part in list_parts(graph)}
    if not parts:
        return Drawing((), (), 0, 0)
    links = [link for link in list_links(graph) if link.source in parts and link.target in parts]
    layers = _find_layers(list(parts), links)
    place = _place_in_columns if way == "wide" else _place_in_rows
    places = place(parts, links, layers)
    boxes = {key: _make_box(part, *places[key]) for key, part in parts.items()}
    lines, labels = _draw_lines(links, boxes, downwards=way == "tall")
    taken = [*map(_taken_by, boxes.values()), *labels]
    left = min(0.0, min(r.left for r in taken) - _MARGIN)
    return Drawing(
        tuple(boxes.values()), tuple(lines),
        round(max(r.right for r in taken) + _MARGIN - left, 1),
        round(max(r.bottom for r in taken) + _MARGIN, 1), round(left, 1),
    )  # fmt: skip


def _find_layers(keys: list[Key], links: list[Link]) -> list[list[tuple[Key, float]]]:
    """Return the layers, each with its parts in order and where Sugiyama's method has them."""
    numbers = {key: number for number, key in enumerate(keys)}
    edges = [(numbers[link.source], numbers[link.target]) for link in links]
    net = igraph.Graph(n=len(keys), edges=edges, directed=True)
    rows = [round(y) for _, y in net.layout_sugiyama(vgap=1, hgap=1)[: len(keys)]]
    # What nobody leads to stands beside what it leads to: its arrow would cross all in between.
    for number in range(len(keys)):
        if not net.indegree(number) and (targets := net.successors(number)):
            rows[number] = max(0, min(rows[target] for target in targets) - 1)
    spots = net.layout_sugiyama(layers=rows, vgap=1, hgap=1, maxiter=200)[: len(keys)]
    first = min(spot[0] for spot in spots)
    layers: dict[int, list[tuple[Key, float]]] = {}
    for key, spot in zip(keys, spots, strict=True):
        layers.setdefault(round(spot[1]), []).append((key, spot[0] - first))
    return [sorted(layers[number], key=lambda seat: seat[1]) for number in sorted(layers)]


Places = dict[Key, tuple[float, float]]


def _place_in_columns(
    parts: dict[Key, Part], links: list[Link], layers: list[list[tuple[Key, float]]]
) -> Places:
    """Return {part: left upper corner}; columns are as wide as their widest box."""
    left, places = float(_MARGIN), {}
    for layer in layers:
        width = max(_box_width(parts[key]) for key, _ in layer)
        for key, seat in layer:
            x = left + (width - _box_width(parts[key])) / 2
            places[key] = (x, _MARGIN + seat * (BOX_HEIGHT_PX + _ROW_GAP))
        labels = [_label_lines(link, links) for link in _leaving(layer, links)]
        left += width + max([_COLUMN_GAP, *(label_width(lines) + 30 for lines in labels)])
    return places


def _place_in_rows(
    parts: dict[Key, Part], links: list[Link], layers: list[list[tuple[Key, float]]]
) -> Places:
    """Return {part: left upper corner}; what is in one layer stands side by side, as it fits."""
    widths = {key: _box_width(part) for key, part in parts.items()}
    for link in links:  # a topic's place is as wide as what stands at its arrows
        topic = link.target if link.target[0] == "topic" else link.source
        widths[topic] = max(widths[topic], label_width(_label_lines(link, links)))
    rows = [sum(widths[key] + _ASIDE_GAP for key, _ in layer) for layer in layers]
    places: Places = {}
    top = float(_MARGIN)
    for row, layer in zip(rows, layers, strict=True):
        left = _MARGIN + (max(rows) - row) / 2
        for key, _ in layer:
            places[key] = (left + (widths[key] - _box_width(parts[key])) / 2, top)
            left += widths[key] + _ASIDE_GAP
        labels = [_label_lines(link, links) for link in _leaving(layer, links)]
        top += BOX_HEIGHT_PX + _LAYER_GAP + LINE_PX * max(map(len, labels), default=0)
    return places


def _leaving(layer: list[tuple[Key, float]], links: list[Link]) -> list[Link]:
    here = {key for key, _ in layer}
    return [link for link in links if link.source in here]


def _label_lines(link: Link, links: list[Link]) -> tuple[str, ...]:
    qos = link.qos if len(links) <= MAX_LABELS or link.bad else ""
    return (*([qos] if qos else []), *link.reasons)


def _box_width(part: Part) -> float:
    longest = max(len(_shorten_label(part.name)), len(_shorten_label(part.note)) * 0.85)
    return max(_LEAST_WIDTH, longest * _CHARACTER + (24 if part.kind == "topic" else 34))


def _make_box(part: Part, x: float, y: float) -> Box:
    x, y, width = round(x, 1), round(y, 1), round(_box_width(part), 1)
    return Box(
        part.kind, _shorten_label(part.name), _shorten_label(part.note), part.tip, part.bad,
        x, y, width, outline=draw_outline(part.kind, x, y, width, BOX_HEIGHT_PX),
    )  # fmt: skip


def _draw_lines(
    links: list[Link], boxes: dict[Key, Box], *, downwards: bool
) -> tuple[list[Polyline], list[Rectangle]]:
    """Return the arrows, and what they and their labels take of the drawing."""
    ends = [(boxes[link.source], boxes[link.target]) for link in links]
    asides = arrows.spread_ends(ends, downwards=downwards)
    free = LabelPlaces(_taken_by(box) for box in boxes.values())
    lines, taken = [], []
    for link, pair, aside in zip(links, ends, asides, strict=True):
        curve = arrows.draw_curve(*pair, aside, downwards=downwards)
        text = _label_lines(link, links)
        place = free.find_place(curve.points, text, back=link.target[0] == "topic")
        qos = text[0] if len(text) > len(link.reasons) else ""
        lines.append(
            Polyline(
                link.kind,
                curve.path,
                link.tip,
                link.bad,
                qos,
                link.reasons,
                *(round(value, 1) for value in place.top_line),
            )
        )
        taken += [place, curve.extent]
    return lines, taken


def _taken_by(box: Box) -> Rectangle:
    return Rectangle(box.x, box.y, box.x + box.width, box.y + box.height)


def _shorten_label(label: str) -> str:
    return label if len(label) <= _LONGEST_LABEL else f"{label[: _LONGEST_LABEL - 1]}…"
