"""What two subscriptions to one topic hear, put together."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator, Sequence
from operator import itemgetter
from typing import TypeVar, overload

T = TypeVar("T")


class Ears(Sequence[T]):
    """What two subscriptions to one topic have heard, each message once, in order of publication.

    One is best effort and matches every publisher, the other is reliable and loses nothing. Neither
    alone has all: the first may lose the newest message, the second may have matched later.
    """

    def __init__(self) -> None:
        """Nothing yet."""
        self._heard: list[tuple[int, T]] = []
        self._known: set[int] = set()
        self._forgotten = 0

    def add_message(self, published: int, item: T, stamp: int) -> None:
        """Note what was published at ``published`` (ns), unless it has been heard before.

        By its ``stamp`` it is known again: the writer's, which is the same for both subscriptions.
        """
        if published > self._forgotten and stamp not in self._known:
            self._known.add(stamp)
            at = bisect_left(self._heard, published, key=itemgetter(0))
            self._heard.insert(at, (published, item))

    @property
    def newest_time(self) -> int:
        """When the newest was published (ns), or 0: it says what came after a moment.

        To count says less: what is still under way at that moment comes in later.
        """
        return self._heard[-1][0] if self._heard else 0

    @property
    def same_since(self) -> int:
        """When the first of the items that equal the newest was published (ns), or 0.

        Those at the end are meant, without another one between them.
        """
        since = 0
        for published, item in reversed(self._heard):
            if item != self._heard[-1][1]:
                break
            since = published
        return since

    @overload
    def __getitem__(self, index: int) -> T: ...
    @overload
    def __getitem__(self, index: slice) -> list[T]: ...
    def __getitem__(self, index: int | slice) -> T | list[T]:
        """Return one item, or some."""
        if isinstance(index, slice):
            return [item for _, item in self._heard[index]]
        return self._heard[index][1]

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self._heard)

    def __iter__(self) -> Iterator[T]:
        """Go through a copy."""
        return iter(self[:])

    def clear(self) -> None:
        """Forget all, and what the other subscription may still hear of it."""
        if self._heard:
            self._forgotten = self._heard[-1][0]
            self._heard = []
