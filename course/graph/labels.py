"""Where the texts at the arrows of a drawing stand: each in a place that no other needs."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

LINE_PX = 13
"""px from one line of a label to the next."""

_CHARACTER_PX = 6.0
_SHARES = (0.38, 0.5, 0.28, 0.62, 0.74)
"""Where on its arrow a label may stand, counted from its topic: the first that is free."""

_SHIFTS = (0, -0.6, 0.6)
"""How far beside its arrow, in halves of its width, where no place on it is free."""

Point = tuple[float, float]


@dataclass(frozen=True)
class Rectangle:
    """A part of a drawing that is taken, in px."""

    left: float
    top: float
    right: float
    bottom: float

    @property
    def top_line(self) -> Point:
        """The middle of the first line of a label that takes this, in px."""
        return (self.left + self.right) / 2, self.top + LINE_PX / 2

    def overlap(self, other: Rectangle) -> float:
        """Return the area (px²) that both take."""
        width = min(self.right, other.right) - max(self.left, other.left)
        height = min(self.bottom, other.bottom) - max(self.top, other.top)
        return max(0.0, width) * max(0.0, height)


def label_width(lines: Iterable[str]) -> float:
    """Return how wide a label is, in px."""
    return max((len(line) * _CHARACTER_PX for line in lines), default=0.0)


class LabelPlaces:
    """Finds places for labels, one after the other, beside the boxes and each other."""

    def __init__(self, taken: Iterable[Rectangle]) -> None:
        """Keep clear of what is ``taken``."""
        self._taken = list(taken)

    def find_place(self, curve: Sequence[Point], lines: Sequence[str], *, back: bool) -> Rectangle:
        """Return where a label stands at an arrow; of no size, if it has no lines.

        ``curve`` has the four points of a cubic Bézier curve; ``back`` says that the arrow ends at
        the topic, so that its label is near its end.
        """
        half, height = label_width(lines) / 2, LINE_PX * len(lines)
        best, least = None, 0.0
        for shift, share in itertools.product(_SHIFTS, _SHARES):
            x, y = _point_on(curve, 1 - share if back else share)
            x += shift * half
            place = Rectangle(x - half, y - height / 2, x + half, y + height / 2)
            lost = sum(place.overlap(other) for other in self._taken)
            if best is None or lost < least:
                best, least = place, lost
            if not lost:
                break
        assert best is not None
        if lines:
            self._taken.append(best)
        return best


def _point_on(curve: Sequence[Point], t: float) -> Point:
    weights = ((1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3)
    x, y = (
        sum(w * point[axis] for w, point in zip(weights, curve, strict=True)) for axis in (0, 1)
    )
    return x, y
