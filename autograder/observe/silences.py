"""For how long nothing came on a topic."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise


def longest_silence(times_s: Sequence[float], since_s: float, until_s: float) -> float:
    """Return the longest time between two messages, or between one and either end, in s.

    Args:
        times_s: when each came, in order; those outside do not count.
        since_s: the begin of the time that is looked at.
        until_s: its end.

    Example:
        >>> longest_silence([1.0, 1.5, 4.0], 1.0, 3.0)
        1.5
    """
    within = [at for at in times_s if since_s <= at <= until_s]
    return max(after - before for before, after in pairwise([since_s, *within, until_s]))
