"""Where to draw a graph's boxes: layers from left to right, few crossings (Sugiyama's method)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import igraph

from course.graph import graph_text
from course.graph.model import Endpoint, Exchange, Graph, Mismatch, Topic

BOX_HEIGHT_PX = 40  # px, with room for a name and a type below it
_CHARACTER, _LEAST_WIDTH, _LONGEST_LABEL = 7.5, 80, 34
_COLUMN_GAP, _ROW_GAP, _MARGIN = 70, 18, 8
_SPREAD_PX = 26  # px of a box's side over which the arrows that end there are spread


@dataclass(frozen=True)
class Box:
    """A node, topic, service or action; ``x`` and ``y`` are the left upper corner in pixels."""

    kind: str
    label: str
    note: str
    tip: str
    bad: bool
    x: float
    y: float
    width: float
    height: float = BOX_HEIGHT_PX


@dataclass(frozen=True)
class Polyline:
    """An arrow: an SVG path, and a label at ``x``, ``y`` where there is something to say.

    ``low`` is the largest y that its curve comes near to.
    """

    kind: str
    path: str
    tip: str
    bad: bool
    label: str
    x: float
    y: float
    low: float = 0.0


@dataclass(frozen=True)
class Drawing:
    """A graph's boxes and lines, and the size of it all in pixels."""

    boxes: tuple[Box, ...]
    lines: tuple[Polyline, ...]
    width: float
    height: float


@dataclass(frozen=True)
class _Thing:
    kind: str
    name: str
    note: str
    tip: str
    bad: bool = False

    @property
    def box_width(self) -> float:
        longest = max(len(_shorten_label(self.name)), len(_shorten_label(self.note)) * 0.85)
        return max(_LEAST_WIDTH, longest * _CHARACTER + 24)


@dataclass(frozen=True)
class _Link:
    source: tuple[str, str]
    target: tuple[str, str]
    kind: str
    tip: str
    bad: bool = False
    label: str = ""


def count_boxes(graph: Graph) -> int:
    """Return how many boxes a drawing of ``graph`` has; no place is worked out for them."""
    return sum(1 for _ in _list_things(graph))


def draw_graph(graph: Graph) -> Drawing:
    """Return a drawing of ``graph`` with its arrows from publisher to subscription."""
    things = {(thing.kind, thing.name): thing for thing in _list_things(graph)}
    if not things:
        return Drawing((), (), 0, 0)
    links = [link for link in _list_links(graph) if link.source in things and link.target in things]
    keys = list(things)
    places = _place_things(things, keys, links)
    boxes = tuple(_make_box(things[key], *places[key]) for key in keys)
    by_key = dict(zip(keys, boxes, strict=True))
    ends = _arrow_ends(links, by_key)
    lines = tuple(
        _draw_line(link, by_key[link.source], by_key[link.target], end)
        for link, end in zip(links, ends, strict=True)
    )
    return Drawing(
        boxes, lines,
        max(box.x + box.width for box in boxes) + _MARGIN,
        max(*(box.y + box.height for box in boxes), *(line.low for line in lines), 0) + _MARGIN,
    )  # fmt: skip


def _list_things(graph: Graph) -> Iterator[_Thing]:
    mentioned = {end.node for t in graph.topics for end in (*t.publishers, *t.subscriptions)}
    mentioned |= {n for x in (*graph.services, *graph.actions) for n in (*x.servers, *x.clients)}
    for name in sorted(mentioned | set(graph.nodes)):
        twins = name in graph.duplicate_names
        tip = f"Two nodes are called {name}: rename one." if twins else f"node {name}"
        yield _Thing("node", name, "", tip, twins)
    for topic in graph.topics:
        ends = [
            f"published by {end.node} [{graph_text.describe_qos(end)}]" for end in topic.publishers
        ]
        ends += [
            f"read by {end.node} [{graph_text.describe_qos(end)}]" for end in topic.subscriptions
        ]
        note = ", ".join(_short_type(type_) for type_ in topic.types)
        yield _Thing(
            "topic", topic.name, note, "\n".join([f"topic {topic.name}", *topic.types, *ends]),
            bad=bool(topic.mismatches),
        )  # fmt: skip
    for kind, exchanges in (("service", graph.services), ("action", graph.actions)):
        for exchange in exchanges:
            tip = f"{kind} {exchange.name}\n{exchange.type}"
            yield _Thing(kind, exchange.name, f"{kind} {_short_type(exchange.type)}", tip)


def _list_links(graph: Graph) -> Iterator[_Link]:
    for topic in graph.topics:
        yield from _topic_links(topic)
    for kind, exchanges in (("service", graph.services), ("action", graph.actions)):
        for exchange in exchanges:
            yield from _exchange_links(kind, exchange)


def _topic_links(topic: Topic) -> Iterator[_Link]:
    here = ("topic", topic.name)
    sent, heard = topic.broken_pairs
    for node, tip in _endpoint_tips(topic, topic.publishers, "offers", sent).items():
        pairs = sent.get(node, [])
        # What both arrows of a pair would say is said once, where it arrives.
        untold = [pair for pair in pairs if pair not in heard.get(pair.subscription, [])]
        yield _Link(
            ("node", node), here, "topic", tip, bool(pairs), graph_text.join_policies(untold)
        )
    for node, tip in _endpoint_tips(topic, topic.subscriptions, "requests", heard).items():
        pairs = heard.get(node, [])
        yield _Link(
            here, ("node", node), "topic", tip, bool(pairs), graph_text.join_policies(pairs)
        )


def _endpoint_tips(
    topic: Topic, ends: Iterable[Endpoint], does: str, broken: Mapping[str, list[Mismatch]]
) -> dict[str, str]:
    """Return {node: what its endpoints on a topic offer or request, and what breaks them}."""
    lines: dict[str, list[str]] = {}
    for end in ends:
        lines.setdefault(end.node, []).append(f"{end.node} {does} {graph_text.describe_qos(end)}")
    for node, said in lines.items():
        said += [graph_text.describe_mismatch(topic.name, pair) for pair in broken.get(node, [])]
    return {node: "\n".join(dict.fromkeys(said)) for node, said in lines.items()}


def _exchange_links(kind: str, exchange: Exchange) -> Iterator[_Link]:
    here = (kind, exchange.name)
    for node in exchange.clients:
        yield _Link(("node", node), here, kind, f"{node} uses {exchange.name}")
    for node in exchange.servers:
        yield _Link(here, ("node", node), kind, f"{node} serves {exchange.name}")


def _place_things(
    things: dict[tuple[str, str], _Thing], keys: list[tuple[str, str]], links: list[_Link]
) -> dict[tuple[str, str], tuple[float, float]]:
    """Return {thing: left upper corner}; columns are as wide as their widest box."""
    numbers = {key: number for number, key in enumerate(keys)}
    edges = [(numbers[link.source], numbers[link.target]) for link in links]
    net = igraph.Graph(n=len(keys), edges=edges, directed=True)
    spots = net.layout_sugiyama(vgap=1, hgap=1, maxiter=200)[: len(keys)]
    columns = sorted({round(spot[1]) for spot in spots})
    words_wide = max(
        (len(link.label) * _CHARACTER + 40 for link in links if link.label), default=0.0
    )
    left, place = float(_MARGIN), {}
    for column in columns:
        inside = [n for n, spot in enumerate(spots) if round(spot[1]) == column]
        width = max(things[keys[n]].box_width for n in inside)
        place.update({n: left + (width - things[keys[n]].box_width) / 2 for n in inside})
        left += width + max(_COLUMN_GAP, words_wide)
    top = min(spot[0] for spot in spots)
    row = BOX_HEIGHT_PX + _ROW_GAP
    return {key: (place[n], _MARGIN + (spots[n][0] - top) * row) for n, key in enumerate(keys)}


def _make_box(thing: _Thing, x: float, y: float) -> Box:
    return Box(
        thing.kind, _shorten_label(thing.name), _shorten_label(thing.note), thing.tip, thing.bad,
        round(x, 1), round(y, 1), round(thing.box_width, 1),
    )  # fmt: skip


def _arrow_ends(links: list[_Link], boxes: dict[tuple[str, str], Box]) -> list[float]:
    """Return how far below the middle of its target's side each arrow ends: beside its fellows."""
    arriving: dict[tuple[str, str], list[int]] = {}
    for number, link in enumerate(links):
        arriving.setdefault(link.target, []).append(number)
    ends = [0.0] * len(links)
    for numbers in arriving.values():
        step = min(12.0, _SPREAD_PX / len(numbers))
        numbers.sort(key=lambda number: boxes[links[number].source].y)
        for place, number in enumerate(numbers):
            ends[number] = round((place - (len(numbers) - 1) / 2) * step, 1)
    return ends


def _draw_line(link: _Link, source: Box, target: Box, end: float) -> Polyline:
    """Return a curve from the right side of ``source`` to the left of ``target``, or back.

    It ends ``end`` pixels below the middle of the side.
    """
    forward = target.x >= source.x + source.width
    x1 = source.x + (source.width if forward else source.width / 2)
    y1 = source.y + (source.height / 2 if forward else source.height)
    x2 = target.x if forward else target.x + target.width / 2
    y2 = target.y + (target.height / 2 + end if forward else target.height)
    if forward:
        bend = max(30.0, (x2 - x1) / 2)
        path = f"M{x1:g},{y1:g} C{x1 + bend:g},{y1:g} {x2 - bend:g},{y2:g} {x2:g},{y2:g}"
    else:
        low = max(y1, y2) + BOX_HEIGHT_PX / 2 + 6
        path = f"M{x1:g},{y1:g} C{x1:g},{low:g} {x2:g},{low:g} {x2:g},{y2:g}"
    middle = ((x1 + x2) / 2, (y1 + y2) / 2 - 6)
    return Polyline(
        link.kind,
        path,
        link.tip,
        link.bad,
        link.label,
        *middle,
        max(y1, y2) if forward else low,
    )


def _shorten_label(label: str) -> str:
    return label if len(label) <= _LONGEST_LABEL else f"{label[: _LONGEST_LABEL - 1]}…"


def _short_type(type_: str) -> str:
    return type_.rpartition("/")[2]
