"""A picture of what was observed, as data: a sequence in time, or a value over rounds.

It is made by the examiner, and never by a submission. It says what was seen and nothing of how that
looks: `drawing` and `wording` show it, and a verdict does not depend on them. It is part of a
verdict, which an examiner sends that a submission may have taken over, so each one is bounded.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal, get_args

MarkKind = Literal["done", "lost", "wrong", "due", "event"]
"""What a mark means: it went as it must, did not come about, must not have been, was to come; or it
is there to tell when something was."""
SpanKind = Literal["busy", "allowed"]
"""What a stretch of time means: something went on, or something may be there."""

MARK_KINDS: tuple[MarkKind, ...] = get_args(MarkKind)
SPAN_KINDS: tuple[SpanKind, ...] = get_args(SpanKind)

MAX_BYTES = 4096
"""Bytes of a picture as JSON."""
MAX_ITEMS = 200
"""Marks and spans of a timeline, and points of a series."""
MAX_LANES = 4
MAX_TITLE_CHARS, MAX_LABEL_CHARS = 100, 28
"""Characters of a title, and of any other text in a picture."""
DECIMALS, MIN_S = 3, 0.001
"""Decimals of times in seconds, and how long a timeline is at least."""

Marks = tuple[tuple[float, MarkKind], ...]
Spans = tuple[tuple[float, float, SpanKind], ...]


@dataclass(frozen=True)
class Lane:
    """A row of a timeline: marks at times (s), and stretches from one time to another."""

    label: str
    marks: Marks = ()
    spans: Spans = ()

    @classmethod
    def of(
        cls, label: str, marks: Mapping[MarkKind, Iterable[float]], spans: Iterable[Any] = ()
    ) -> Lane:
        """Return a lane with the times (s) of each kind of marks.

        Example:
            >>> Lane.of("tries", {"done": [0.0, 1.5]}, [(1.0, 1.5, "allowed")]).marks
            ((0.0, 'done'), (1.5, 'done'))
        """
        found = sorted((round(at, DECIMALS), kind) for kind, times in marks.items() for at in times)
        stretches = ((round(a, DECIMALS), round(b, DECIMALS), kind) for a, b, kind in spans)
        return cls(label, tuple(found), tuple(stretches))


@dataclass(frozen=True)
class Timeline:
    """What was seen from 0 to so many seconds, in up to `MAX_LANES` rows.

    ``legend`` says in a few words what each kind of mark and of stretch means here.

    Raises:
        ValueError: it is larger than a picture may be, or makes no sense.

    Example:
        >>> tries = Lane.of("tries", {"done": [0.0, 1.6, 3.1]})
        >>> picture = Timeline("A grip", 5.0, (tries,), (("done", "the gripper is asked"),))
    """

    title: str
    seconds: float
    lanes: tuple[Lane, ...]
    legend: tuple[tuple[str, str], ...] = ()
    form: Literal["timeline"] = "timeline"

    def __post_init__(self) -> None:
        """Hold it to its bounds."""
        marks = [mark for lane in self.lanes for mark in lane.marks]
        spans = [span for lane in self.lanes for span in lane.spans]
        _require(1 <= len(self.lanes) <= MAX_LANES, "rows")
        _require(len(marks) + len(spans) <= MAX_ITEMS, "marks")
        _require(all(kind in MARK_KINDS for _, kind in marks), "kinds of marks")
        _require(all(kind in SPAN_KINDS for _, _, kind in spans), "kinds of spans")
        _require(all(kind in MARK_KINDS + SPAN_KINDS for kind, _ in self.legend), "kinds")
        _require(len(dict(self.legend)) == len(self.legend), "kinds told twice")
        _require_numbers(*(mark[0] for mark in marks), *(at for span in spans for at in span[:2]))
        _require_numbers(self.seconds)
        _require(self.seconds >= MIN_S, "seconds")
        _require_texts(
            self.title, *(lane.label for lane in self.lanes), *(words for _, words in self.legend)
        )
        _require_size(self)

    def kinds(self) -> set[str]:
        """Return the kinds of marks and stretches that are in it."""
        marks = {kind for lane in self.lanes for _, kind in lane.marks}
        return marks | {span[2] for lane in self.lanes for span in lane.spans}


@dataclass(frozen=True)
class Series:
    """A value over rounds, such as lives of a node, or over seconds: points (round, value).

    Raises:
        ValueError: it is larger than a picture may be, or makes no sense.

    Example:
        >>> picture = Series("Threads over lives", "lives", "threads", ((0, 12), (1, 13), (2, 14)))
    """

    title: str
    x_label: str
    y_label: str
    points: tuple[tuple[float, float], ...]
    form: Literal["series"] = "series"

    def __post_init__(self) -> None:
        """Hold it to its bounds."""
        _require(2 <= len(self.points) <= MAX_ITEMS, "points")
        _require_numbers(*(number for point in self.points for number in point))
        _require_texts(self.title, self.x_label, self.y_label)
        _require_size(self)


Picture = Timeline | Series


def picture_from_data(data: Any) -> Picture | None:
    """Return the picture that JSON knows as ``data``: what `dataclasses.asdict` made of it.

    Raises:
        ValueError, KeyError, TypeError: it is none.
    """
    if data is None:
        return None
    match data["form"]:
        case "timeline":
            lanes = tuple(
                Lane(
                    lane["label"],
                    tuple((at, kind) for at, kind in lane["marks"]),
                    tuple((begin, end, kind) for begin, end, kind in lane["spans"]),
                )
                for lane in data["lanes"]
            )
            legend = tuple((kind, words) for kind, words in data["legend"])
            return Timeline(data["title"], data["seconds"], lanes, legend)
        case "series":
            points = tuple((x, y) for x, y in data["points"])
            return Series(data["title"], data["x_label"], data["y_label"], points)
    raise ValueError("a picture of an unknown form")


def _require(holds: bool, what: str) -> None:
    if not holds:
        raise ValueError(f"a picture cannot have these {what}")


def _require_numbers(*values: Any) -> None:
    are_numbers = all(isinstance(v, int | float) and not isinstance(v, bool) for v in values)
    # Larger ones have no place on an axis, and overflow what is reckoned with them.
    _require(are_numbers and all(math.isfinite(v) and abs(v) < 1e12 for v in values), "numbers")


def _require_texts(title: Any, *labels: Any) -> None:
    _require(isinstance(title, str) and len(title) <= MAX_TITLE_CHARS, "words as a title")
    _require(all(isinstance(t, str) and len(t) <= MAX_LABEL_CHARS for t in labels), "labels")


def _require_size(picture: Picture) -> None:
    size = len(json.dumps(asdict(picture), separators=(",", ":"), ensure_ascii=False).encode())
    _require(size <= MAX_BYTES, f"{size} bytes")
