"""When messages of a topic were published, received, and worked on: traces, and what they show."""

from __future__ import annotations

import itertools
import statistics
import threading
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

from rclpy.qos import DurabilityPolicy

from course.graph import reader
from course.runtime.core_session import CoreSession
from course.runtime.requests.graph_queries import fitting_qos, full_topic, type_on

KEPT_MESSAGES = 20_000
"""Messages of one topic that a trace remembers: 20 s at 1 kHz. More take long to draw."""

COLUMNS = 200
"""Into how many columns a window is divided: more than an eye can tell apart."""

BINS = 50
"""Into how many parts a window is divided for the plots of rate and latency."""

MESSAGES = 1000
"""Messages of one topic that a trace keeps whole, to be saved."""

MAX_BYTES = 32 * 1024 * 1024
"""Bytes that these have at most: of large messages, such as pictures, the latest few are kept."""

GAP_S = 3.0
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
    """What a window of a trace shows. Times are in seconds, rates in Hz; None where unknown.

    ``gaps`` are pauses from publication to publication; ``drops`` how many messages never came, and
    when the one after them was published. Both times are since the epoch.
    """

    count: int
    rate: float | None = None
    latency_p50: float | None = None
    latency_p95: float | None = None
    lost: int = 0
    gaps: tuple[tuple[float, float], ...] = ()
    drops: tuple[tuple[float, int], ...] = ()


class Plots(NamedTuple):
    """Rate (Hz) and latency (s) in each of `BINS` parts of a window; None where nothing came.

    In a gap the rate is 0.
    """

    rate: list[float | None]
    p50: list[float | None]
    p95: list[float | None]


class Trace:
    """The passages of one topic, as a hidden subscription of the session's sees them.

    ``is_published`` says whether somebody published it when `adapt_qos` looked last.
    """

    def __init__(self, session: CoreSession, topic: str, msg_type: Any | None = None) -> None:
        """Trace ``topic`` from now on.

        Raises:
            WaitTimeout: ``msg_type`` is None, and nobody uses the topic.
        """
        self._passages: deque[Passage] = deque(maxlen=KEPT_MESSAGES)
        self._lock = threading.Lock()
        self._session = session
        self.topic = full_topic(session.observer, topic)
        self.msg_type = msg_type or session.until(
            lambda: type_on(session.observer, self.topic), what=f"somebody to use {self.topic}"
        )
        self._messages: deque[tuple[int, bytes]] = deque()
        self.is_published = True
        self._size = 0
        self._subscribe()

    @property
    def latest_messages(self) -> list[tuple[int, bytes]]:
        """The latest messages, each with its time (ns) and as CDR, oldest first (a snapshot)."""
        with self._lock:
            return list(self._messages)

    @property
    def newest_message(self) -> bytes | None:
        """The message that came last, as CDR; None before the first."""
        with self._lock:
            return self._messages[-1][1] if self._messages else None

    def adapt_qos(self) -> None:
        """Subscribe again if there is a publisher now that offers less than was requested.

        For example, a talker's cell is run again with another QoS. A request for less still fits.
        """
        offers = self._session.observer.get_publishers_info_by_topic(self.topic)
        self.is_published = bool(offers)
        if any(reader.find_incompatibilities(offer.qos_profile, self._qos) for offer in offers):
            self._session.unwatch(self._subscription)
            self._subscribe()

    def stop(self) -> None:
        """Trace no more, and let the messages go. Idempotent."""
        self._session.unwatch(self._subscription)
        with self._lock:
            self._messages.clear()
            self._size = 0

    def _subscribe(self) -> None:
        self._qos = fitting_qos(self._session.observer, self.topic, _DEPTH)
        # Fits every offer, and brings nothing of the past: what is replayed is not what is late.
        self._qos.durability = DurabilityPolicy.VOLATILE
        self._subscription = self._session.watch(
            self.msg_type, self.topic, self._take_message, self._qos, raw=True
        )

    def passages_since(self, moment_ns: int) -> list[Passage]:
        """Return the passages received since a moment (ns), oldest first."""
        with self._lock:
            passages = list(self._passages)
        return [passage for passage in passages if passage.received >= moment_ns]

    @property
    def complete_since(self) -> int:
        """The moment (ns) since when no passage has been let go of; 0 if none ever was."""
        with self._lock:
            full = len(self._passages) == self._passages.maxlen
            return self._passages[0].received if full else 0

    def _take_message(self, message: bytes, info: dict[str, int]) -> None:
        passage = Passage(
            info["source_timestamp"], info["received_timestamp"] or time.time_ns(),
            info.get("publication_sequence_number") or 0,
        )  # fmt: skip
        # As a recording has it: simulated time in a session that has one.
        stamp = self._session.sim.now_ns if self._session.options["sim_time"] else passage.published
        with self._lock:
            self._passages.append(passage)
            self._messages.append((stamp, message))
            self._size += len(message)
            while len(self._messages) > MESSAGES or (
                self._size > MAX_BYTES and len(self._messages) > 1
            ):
                self._size -= len(self._messages.popleft()[1])


def compute_figures(passages: Sequence[Passage]) -> Figures:
    """Return what passages, oldest first, show."""
    if not passages:
        return Figures(0)
    latencies = sorted((p.received - p.published) / _NS for p in passages)
    stamps = [p.published / _NS for p in passages]
    span = stamps[-1] - stamps[0]
    missing = find_drops(passages)
    return Figures(
        len(passages),
        rate=(len(stamps) - 1) / span if span > 0 else None,
        latency_p50=_pick_quantile(latencies, 0.5),
        latency_p95=_pick_quantile(latencies, 0.95),
        lost=sum(count for _, count in missing),
        gaps=_find_gaps(stamps),
        drops=missing,
    )


def compute_plots(passages: Sequence[Passage], start: int, window_ns: int) -> Plots:
    """Return rate and latency over a window from ``start`` (ns) of passages, oldest first.

    The rate of a part is that of the periods that end in it, so that a steady topic has a level
    line however few messages fall into a part.
    """
    periods: list[list[float]] = [[] for _ in range(BINS)]
    latencies: list[list[float]] = [[] for _ in range(BINS)]
    before: Passage | None = None
    for passage in passages:
        place = (passage.published - start) * BINS // window_ns
        if 0 <= place < BINS:
            latencies[place].append((passage.received - passage.published) / _NS)
            if before is not None:
                periods[place].append((passage.published - before.published) / _NS)
        before = passage
    rate = [len(found) / sum(found) if sum(found) > 0 else None for found in periods]
    part = window_ns / BINS / _NS
    for begin, end in compute_figures(passages).gaps:
        for place, found in enumerate(latencies):
            middle = start / _NS + (place + 0.5) * part
            if begin < middle < end and not found:
                rate[place] = 0.0
    ordered = [sorted(found) for found in latencies]
    return Plots(
        rate,
        *(
            [_pick_quantile(found, share) if found else None for found in ordered]
            for share in (0.5, 0.95)
        ),
    )


def count_columns(moments: Sequence[int], start: int, window_ns: int) -> list[int]:
    """Return how many moments (ns) fall into each of `COLUMNS` parts of a window from ``start``."""
    counts = [0] * COLUMNS
    for moment in moments:
        place = (moment - start) * COLUMNS // window_ns
        if 0 <= place < COLUMNS:
            counts[place] += 1
    return counts


def _pick_quantile(ordered: Sequence[float], share: float) -> float:
    return ordered[min(len(ordered) - 1, int(len(ordered) * share))]


class Counted(Protocol):
    """A message that came somewhere: when it was published (ns), and its number."""

    @property
    def published(self) -> int:
        """See `Passage`."""

    @property
    def sequence(self) -> int:
        """See `Passage`."""


def find_drops(messages: Sequence[Counted]) -> tuple[tuple[float, int], ...]:
    """Return where numbers are missing, if all come from one publisher that counts.

    Returns:
        How many are, and when the message after them was published (s since the epoch).
    """
    pairs = list(itertools.pairwise(messages))
    if any(a.sequence == 0 or b.sequence <= a.sequence for a, b in pairs):
        return ()
    return tuple(
        (b.published / _NS, b.sequence - a.sequence - 1)
        for a, b in pairs
        if b.sequence > a.sequence + 1
    )


def _find_gaps(stamps: Sequence[float]) -> tuple[tuple[float, float], ...]:
    pauses = [(b - a, a, b) for a, b in itertools.pairwise(stamps)]
    if len(pauses) < 4:
        return ()
    usual = statistics.median(pause for pause, _, _ in pauses)
    return tuple((a, b) for pause, a, b in pauses if usual > 0 and pause > GAP_S * usual)
