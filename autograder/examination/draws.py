"""Numbers of an examination that nobody can know beforehand: drawn from one seed.

A verdict records its seed, so that an examination can be repeated with the same numbers.
"""

from __future__ import annotations

import random
import secrets
from collections.abc import Iterable
from typing import TypeVar

T = TypeVar("T")

USUAL_SEED = 0
"""The seed that draws nothing: each number is then the usual one, which the corpus expects."""

MAX_SEED = 2**53
"""So many that nobody finds it by trying, from the numbers seen so far; JSON holds it."""


def fresh_seed() -> int:
    """Return a seed that nobody can know."""
    return 1 + secrets.randbelow(MAX_SEED)


class Draws:
    """The numbers of one examination: one purpose gets the same number each time.

    A ``purpose`` is the name that a check gives to a number: "a rate", say. Who tries an exam, or
    runs its corpus, gets the ``usual`` one, so that cases can say what will be observed; who is
    graded gets one that nobody knows before.

    Example:
        >>> Draws(USUAL_SEED).number("a rate", 2.5, 1.5, 9.5)
        2.5
        >>> drawn = Draws(seed=7)
        >>> drawn.number("a rate", 2.5, 1.5, 9.5) == drawn.number("a rate", 2.5, 1.5, 9.5)
        True
    """

    def __init__(self, seed: int) -> None:
        """Draw from ``seed``."""
        self.seed = seed

    def number(self, purpose: str, usual: float, low: float, high: float) -> float:
        """Return a number from ``low`` to ``high``, in hundredths."""
        return self.whole(purpose, round(usual * 100), round(low * 100), round(high * 100)) / 100

    def whole(self, purpose: str, usual: int, low: int, high: int) -> int:
        """Return a whole number from ``low`` to ``high``."""
        return usual if self.seed == USUAL_SEED else self._source(purpose).randint(low, high)

    def flag(self, purpose: str, *, usual: bool = True) -> bool:
        """Return True or False."""
        return bool(self.whole(purpose, usual, 0, 1))

    def shuffled(self, purpose: str, items: Iterable[T]) -> list[T]:
        """Return things in another order; the usual one is theirs."""
        order = list(items)
        if self.seed != USUAL_SEED:
            self._source(purpose).shuffle(order)
        return order

    def _source(self, purpose: str) -> random.Random:
        return random.Random(f"{self.seed} {purpose}")
