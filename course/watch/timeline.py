"""When messages of a topic were published, received, and worked on: traces, and what they show."""

# mypy: allow-untyped-calls

from __future__ import annotations

import itertools
import statistics
import threading
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from course.runtime.offers import fitting_qos, full_topic, type_on
from course.runtime.session import Session

KEPT = 20_000
"""Messages of one topic that a trace remembers: 20 s at 1 kHz."""

COLUMNS = 200
"""Into how many columns a window is divided: more than an eye can tell apart."""

GAP = 3.0
"""A pause is a gap if it is so many times as long as the median period."""

_NS = 1e9
_DEPTH = 1000  # of the hidden subscription: it must not lose what it is to count


class Passage(NamedTuple):
    """One message: when it was published and received (ns since the epoch), and its number.

    ``sequence`` counts what its publisher published; 0 where DDS does not tell.
    """

    published: int
    received: int
    sequence: int


@dataclass(frozen=True)
class Figures:
    """What a window of a trace shows. Times are in seconds, rates in Hz; None where unknown."""

    count: int
    rate: float | None = None
    latency_p50: float | None = None
    latency_p95: float | None = None
    lost: int = 0
    gaps: tuple[tuple[float, float], ...] = ()


class Trace:
    """The passages of one topic, as a hidden subscription of the session's sees them."""

    def __init__(self, session: Session, topic: str, msg_type: Any | None = None) -> None:
        """Trace ``topic`` from now on.

        Raises:
            WaitTimeout: ``msg_type`` is None, and nobody uses the topic.
        """
        self._passages: deque[Passage] = deque(maxlen=KEPT)
        self._lock = threading.Lock()
        self._session = session
        self.topic = full_topic(session.observer, topic)
        self.msg_type = msg_type or session.until(
            lambda: type_on(session.observer, self.topic), what=f"somebody to use {self.topic}"
        )
        qos = fitting_qos(session.observer, self.topic, _DEPTH)
        self._subscription = session.watch(self.msg_type, self.topic, self._take, qos)

    def stop(self) -> None:
        """Trace no more. Idempotent."""
        self._session.unwatch(self._subscription)

    def since(self, moment_ns: int) -> list[Passage]:
        """Return the passages received since a moment (ns), oldest first."""
        with self._lock:
            passages = list(self._passages)
        return [passage for passage in passages if passage.received >= moment_ns]

    def _take(self, _message: Any, info: dict[str, int]) -> None:
        passage = Passage(
            info["source_timestamp"], info["received_timestamp"] or time.time_ns(),
            info.get("publication_sequence_number") or 0,
        )  # fmt: skip
        with self._lock:
            self._passages.append(passage)


def figures(passages: Sequence[Passage]) -> Figures:
    """Return what passages, oldest first, show."""
    if not passages:
        return Figures(0)
    latencies = sorted((p.received - p.published) / _NS for p in passages)
    stamps = [p.published / _NS for p in passages]
    span = stamps[-1] - stamps[0]
    return Figures(
        len(passages),
        rate=(len(stamps) - 1) / span if span > 0 else None,
        latency_p50=_share(latencies, 0.5),
        latency_p95=_share(latencies, 0.95),
        lost=_lost(passages),
        gaps=_gaps(stamps),
    )


def columns(moments: Sequence[int], start: int, window_ns: int) -> list[int]:
    """Return how many moments (ns) fall into each of `COLUMNS` parts of a window from ``start``."""
    counts = [0] * COLUMNS
    for moment in moments:
        place = (moment - start) * COLUMNS // window_ns
        if 0 <= place < COLUMNS:
            counts[place] += 1
    return counts


def _share(ordered: Sequence[float], share: float) -> float:
    return ordered[min(len(ordered) - 1, int(len(ordered) * share))]


def _lost(passages: Sequence[Passage]) -> int:
    """Return how many numbers are missing, if all come from one publisher that counts."""
    numbers = [passage.sequence for passage in passages]
    steps = [later - earlier for earlier, later in itertools.pairwise(numbers)]
    if 0 in numbers or any(step <= 0 for step in steps):
        return 0
    return sum(step - 1 for step in steps)


def _gaps(stamps: Sequence[float]) -> tuple[tuple[float, float], ...]:
    pauses = [(b - a, a, b) for a, b in itertools.pairwise(stamps)]
    if len(pauses) < 4:
        return ()
    usual = statistics.median(pause for pause, _, _ in pauses)
    return tuple((a, b) for pause, a, b in pauses if usual > 0 and pause > GAP * usual)
