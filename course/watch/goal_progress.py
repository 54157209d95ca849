"""How far a goal has come: one number of its feedback, followed from message to message."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

from course.messages import values

TELLING = ("percent", "progress", "fraction", "remaining", "distance")
"""Parts of names that tell of progress, the most telling first."""

_DEEPEST = 3
_STAMPS = ("header", "stamp")


class Measure(NamedTuple):
    """A number in a feedback message, and what it is: the field's path, or how long a list is."""

    name: str
    value: float


def measure_progress(feedback: Any) -> Measure | None:
    """Return the number of a feedback message that tells most of its progress; None without any.

    A field whose name says so comes first (see `TELLING`), then any other number, then the length
    of a list that grows, as of a path or a sequence. A duration counts in seconds.
    """
    found = sorted(_find_numbers(feedback, "", _DEEPEST), key=_rank_measure)
    return found[0] if found else None


def _find_numbers(message: Any, start: str, depth: int) -> Iterator[Measure]:
    for field, _ in values.message_fields(type(message)):
        if field in _STAMPS:
            continue
        path, value = start + field, getattr(message, field)
        if isinstance(value, bool | str | bytes):
            continue
        if isinstance(value, int | float):
            yield Measure(path, float(value))
        elif not hasattr(value, "get_fields_and_field_types"):
            yield Measure(f"{path}{_LENGTH}", float(len(value)))
        elif hasattr(value, "nanosec"):
            yield Measure(f"{path} (s)", value.sec + value.nanosec / 1e9)
        elif depth > 1:
            yield from _find_numbers(value, f"{path}.", depth - 1)


_LENGTH = " (number of values)"


def _rank_measure(found: Measure) -> tuple[int, bool]:
    telling = [place for place, word in enumerate(TELLING) if word in found.name.lower()]
    return min(telling, default=len(TELLING)), found.name.endswith(_LENGTH)
