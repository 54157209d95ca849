"""Numbered messages as they arrived at one end: which, in what order, and when."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection
from typing import NamedTuple


class Arrival(NamedTuple):
    """A numbered message that arrived: when it was published, and received, in ns since 1970."""

    number: int
    published_ns: int
    received_ns: int


class Arrivals:
    """The numbered messages that arrived at one end, by series: "warm-up", "pause 1", …

    One thread notes them; others may read meanwhile.

    Example:
        >>> heard = Arrivals()
        >>> for number in (0, 2, 2):
        ...     heard.note("burst", number, published_ns=1000 + number, received_ns=2000)
        >>> heard.numbers("burst"), heard.newest("burst"), heard.newest("pause")
        ([0, 2, 2], 2, -1)
        >>> heard.first_times("burst")
        {0: 1000, 2: 1002}
        >>> heard.count_repeated()
        1
    """

    def __init__(self) -> None:
        """Begin with none."""
        self._series: dict[str, list[Arrival]] = {}

    def note(self, series: str, number: int, published_ns: int, received_ns: int) -> None:
        """Note one more."""
        self._series.setdefault(series, []).append(Arrival(number, published_ns, received_ns))

    def __len__(self) -> int:
        """Return how many arrived in all."""
        return sum(map(len, list(self._series.values())))

    def of(self, series: str) -> list[Arrival]:
        """Return those of a series, in order of arrival."""
        return list(self._series.get(series, ()))

    def numbers(self, series: str) -> list[int]:
        """Return the numbers of a series, in order of arrival; one that came twice twice."""
        return [arrival.number for arrival in self.of(series)]

    def newest(self, series: str) -> int:
        """Return the highest number of a series, -1 if none arrived."""
        return max(self.numbers(series), default=-1)

    def first_times(self, series: str) -> dict[int, int]:
        """Return when each message of a series was first published: {number: ns since 1970}."""
        times: dict[int, int] = {}
        for arrival in self.of(series):
            times.setdefault(arrival.number, arrival.published_ns)
        return times

    def count_repeated(self, but: Collection[str] = ()) -> int:
        """Return how many messages arrived more than once, in all series ``but`` these."""
        return sum(
            times > 1
            for series, arrivals in list(self._series.items())
            if series not in but
            for times in Counter(arrival.number for arrival in list(arrivals)).values()
        )
