"""What was found on the floor lately, also where the robot does not see it any more."""

from __future__ import annotations

from collections.abc import Iterable

from course.design.at_work.places.place import Place

MEMORY_S = 8.0
"""Seconds that a place is remembered after it was found last: what moves leaves it soon."""

_APART_M = 0.08  # two places in the same square of this width are one


class ObstacleMemory:
    """Places on the floor where something was found, in the frame of the floor."""

    def __init__(self) -> None:
        """Remember nothing yet."""
        self._found: dict[tuple[int, int], tuple[float, Place]] = {}

    def remember(self, places: Iterable[Place], now: float) -> None:
        """Take what was found now (s)."""
        for place in places:
            self._found[round(place.x / _APART_M), round(place.y / _APART_M)] = now, place

    def recall(self, now: float) -> list[Place]:
        """Return what was found within the last `MEMORY_S`, and forget the rest."""
        self._found = {at: (t, p) for at, (t, p) in self._found.items() if now - t < MEMORY_S}
        return [place for _, place in self._found.values()]
