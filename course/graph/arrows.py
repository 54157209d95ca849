"""The arrows of a drawing: curves from side to side that end beside each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from course.graph.labels import Point, Rectangle
from course.graph.shapes import find_inset

_SPREAD_PX = 26  # px of a box's side over which the arrows that end there are spread
_LEAST_BEND_PX = 24
_DETOUR_PX = 26  # px that an arrow back runs outside of both boxes


class PlacedBox(Protocol):
    """What an arrow needs to know of a box: its kind, left upper corner and size in px."""

    @property
    def kind(self) -> str:
        """See `course.graph.parts.Part`."""

    @property
    def x(self) -> float:
        """Left side."""

    @property
    def y(self) -> float:
        """Upper side."""

    @property
    def width(self) -> float:
        """From left to right."""

    @property
    def height(self) -> float:
        """From top to bottom."""


@dataclass(frozen=True)
class Curve:
    """A cubic Bézier curve: its four points in px."""

    points: tuple[Point, Point, Point, Point]

    @property
    def path(self) -> str:
        """The curve as an SVG path."""
        start, *others = (f"{round(x, 1):g},{round(y, 1):g}" for x, y in self.points)
        return f"M{start} C{' '.join(others)}"

    @property
    def extent(self) -> Rectangle:
        """What it takes of the drawing at most where it bulges."""
        xs, ys = zip(*self.points, strict=True)
        return Rectangle(min(xs), min(ys), max(xs), max(ys))


def spread_ends(ends: Sequence[tuple[PlacedBox, PlacedBox]], *, downwards: bool) -> list[float]:
    """Return how far from the middle of its target's side each arrow ends: beside its fellows.

    ``ends`` has the boxes at which each arrow begins and ends.
    """
    arriving: dict[int, list[int]] = {}
    for number, (_, target) in enumerate(ends):
        arriving.setdefault(id(target), []).append(number)
    asides = [0.0] * len(ends)
    for numbers in arriving.values():
        step = min(12.0, _SPREAD_PX / len(numbers))
        numbers.sort(key=lambda number: ends[number][0].x if downwards else ends[number][0].y)
        for place, number in enumerate(numbers):
            asides[number] = round((place - (len(numbers) - 1) / 2) * step, 1)
    return asides


def draw_curve(source: PlacedBox, target: PlacedBox, aside: float, *, downwards: bool) -> Curve:
    """Return a curve from the far side of ``source`` to the near side of ``target``, or back.

    It ends ``aside`` px from the middle of that side. ``downwards`` says which sides these are.
    """
    begin, end = _Flow(source, downwards), _Flow(target, downwards)
    if end.near >= begin.far:
        inset = find_inset(target.kind, aside, end.half_side, (end.far - end.near) / 2)
        start, stop = (begin.far, begin.middle), (end.near + inset, end.middle + aside)
        bend = max(_LEAST_BEND_PX, (stop[0] - start[0]) / 2)
        points = (start, (start[0] + bend, start[1]), (stop[0] - bend, stop[1]), stop)
    else:  # against the flow: outside of both
        start = ((begin.near + begin.far) / 2, begin.outer)
        stop = ((end.near + end.far) / 2, end.outer)
        low = max(start[1], stop[1]) + _DETOUR_PX
        points = (start, (start[0], low), (stop[0], low), stop)
    return Curve(tuple((y, x) if downwards else (x, y) for x, y in points))  # type: ignore[arg-type]


class _Flow:
    """A box as seen along the direction in which its drawing flows."""

    def __init__(self, box: PlacedBox, downwards: bool) -> None:
        along, across = (box.y, box.height), (box.x, box.width)
        if not downwards:
            along, across = across, along
        self.near, self.far = along[0], sum(along)
        self.half_side = across[1] / 2
        self.middle, self.outer = across[0] + self.half_side, sum(across)
