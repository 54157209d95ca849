"""What a consumer that was busy for a while finds in its queues, and whether it keeps up then.

Depth and history of a queue cannot be read from the ROS graph: they show in what comes out of it.
Messages come in at their own rates, as on the robot, so that a design may rest on a queue's depth,
on a lifespan, or on the age of a message.
"""

from __future__ import annotations

import time
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Generic

from autograder.examination.exam import Failed, NotExaminable
from autograder.examination.pictures.picture import Timeline
from autograder.observe.findings import handled_picture
from autograder.observe.patience import SETTLE_S
from autograder.observe.relays.consumer_lag import ConsumerLag, watch_consumers
from autograder.observe.relays.message_stream import (
    LAG_S,
    UNLIMITED,
    MessageStream,
    hold_streams,
)
from autograder.observe.relays.observed_relays import KindT, ObservedRelays
from autograder.observe.relays.sequence_faults import numbers_phrase

LONGEST_S = 60.0
"""Seconds that a pause may take on a busy machine."""
LULL_S = 0.06
"""Seconds without messages at its end, more than half of the time between two of 10 Hz: so that one
is clearly on this side of a bound or on that one, despite jitter."""
PROMPT_S = 0.15
"""Seconds in which what is left comes out of an idle machine."""
TRIES = 8
EXPIRY_TRIES = 3
"""Pauses after which too old a backlog is the consumer's, though its messages expire by LIFESPAN.

Fast DDS may expire them later than it should: a message that comes in just as its timer goes off
puts the timer off by the whole LIFESPAN (`DataReaderImpl::on_new_cache_change_added` sets the
interval of the timer that `lifespan_expired` has just set). At 100 Hz that was seen in one pause of
640, with 82 messages left where 50 are young enough.
"""


def too_busy(doing: str) -> NotExaminable:
    """Return that something could not be done as the machine had other work."""
    return NotExaminable(
        f"This machine was too busy to {doing}. After a hand-in a person looks at it."
    )


@dataclass(frozen=True)
class Traffic:
    """What comes in during a pause.

    Attributes:
        seconds: of the pause, its last ones, in which messages come in.
        limit: how many, if they are events that end with the pause; others go on after it.
        each_counts: whether the consumer has to hand on each of those that come after it.
    """

    seconds: float
    limit: int = UNLIMITED
    each_counts: bool = False

    def count_at(self, rate_hz: float) -> int:
        """Return how many have to come in."""
        return self.limit if self.limit < UNLIMITED else int(self.seconds * rate_hz)


@dataclass(frozen=True)
class Backlog:
    """Messages of a pause, and what became of them.

    Attributes:
        count: how many came in; ``published`` says how many of them came on the topic.
        kept: the numbers in the order in which the consumer handed them on; those from ``count`` on
            came in after the pause.
        replayed: how many were published from the first of them to the end of the pause.
        oldest_s: how old the first of them was at the end of the pause.
        is_early: some came out while the consumer was held back.
    """

    count: int
    published: int
    kept: list[int]
    replayed: int
    oldest_s: float
    is_early: bool = False

    def is_stale(self, most: int, rate_hz: float) -> bool:
        """Whether the consumer acted on what was too old, by number and by age."""
        return self.replayed > most and self.oldest_s > most / rate_hz

    def describe_fault(self, most: int, rate_hz: float, noun: str = "message") -> str:
        """Return in a sentence what is wrong with it; empty if it went on with the newest.

        Example:
            >>> kept = [*range(5, 20)]
            >>> Backlog(20, 20, kept, replayed=15, oldest_s=1.5).describe_fault(5, 10.0)
            'It then worked through the last 15 of 20 messages.'
            >>> Backlog(20, 20, kept, replayed=15, oldest_s=1.5).describe_fault(15, 10.0)
            ''
        """
        if max(self.kept, default=-1) < self.count - 1:
            got = numbers_phrase(self.kept, noun)
            return f"Of {self.count} {noun}s in a pause the newest never came out: it got {got}."
        if self.is_stale(most, rate_hz):
            return f"It then worked through the last {self.replayed} of {self.published} {noun}s."
        if self.kept != sorted(self.kept):
            return f"It passed them on out of order: {numbers_phrase(self.kept, noun)}."
        return ""


class Pause(Generic[KindT]):
    """A pause of the consumer's while messages come in, most of which go on afterwards.

    Attributes:
        is_jammed: DDS could not receive meanwhile, so that nothing is known.
        lags: whether the consumer keeps up afterwards, of each kind where that can be seen.
    """

    def __init__(
        self, relays: ObservedRelays[KindT], series: str, traffic: Mapping[KindT, Traffic],
        unwatched: Collection[KindT],
    ) -> None:  # fmt: skip
        """Keep the consumer busy, let it go on, and watch it: see `pause_consumer`."""
        self._relays, self._series, self._traffic = relays, series, traffic
        self._streams: dict[KindT, MessageStream] = {}
        self._counts: dict[KindT, int] = {}
        self._early: set[KindT] = set()
        self._resumed_ns = 0
        self.lags: dict[KindT, ConsumerLag] = {}
        self.is_jammed = self._pause()
        if not self.is_jammed:
            for kind in traffic:
                self._drain(kind)
            self._watch(unwatched)
        for stream in self._streams.values():
            stream.stop()

    def _pause(self) -> bool:
        relays, streams = self._relays, self._streams
        with relays.keep_busy(relays.consumer) as let_go:
            self._begin_streams()
            relays.wait(self._is_enough, LONGEST_S, often=False)
            with hold_streams(streams.values()):
                for kind, stream in streams.items():
                    if self._traffic[kind].limit < UNLIMITED:
                        stream.stop()
                    stream.slow_down()
                    self._counts[kind] = stream.sent
                    # So the reader that is held has been sent all before it, too.
                    relays.wait_for_relay(kind, self._series, stream.sent - 1)
                newest_ns = max(max(self._published(k).values(), default=0) for k in streams)
                relays.wait(lambda: time.time_ns() - newest_ns >= LULL_S * 1e9, LAG_S)
                self._early = {kind for kind in streams if self._kept(kind)}
                self._resumed_ns = time.time_ns()
                return let_go()

    def _begin_streams(self) -> None:
        """Begin those that last longest first, so that all end together."""
        traffic = sorted(self._traffic.items(), key=lambda item: -item[1].seconds)
        lead, longest_s = traffic[0][0], traffic[0][1].seconds
        for kind, more in traffic:
            before = (longest_s - more.seconds) * lead.rate_hz
            self._wait_until_sent(lead, before)
            path = self._relays.paths[kind]
            self._streams[kind] = path.stream(self._series, limit=more.limit)

    def _wait_until_sent(self, kind: KindT, number: float) -> None:
        if number > 0:
            stream = self._streams[kind]
            self._relays.wait(lambda: stream.sent >= number, LONGEST_S, often=False)

    def _is_enough(self) -> bool:
        return all(
            stream.sent >= self._traffic[kind].count_at(kind.rate_hz)
            for kind, stream in self._streams.items()
        )

    def _published(self, kind: KindT) -> dict[int, int]:
        """Return when the messages of the pause came on the topic: {number: ns}."""
        times = self._relays.paths[kind].published.first_times(self._series)
        return {number: when for number, when in times.items() if number < self._counts[kind]}

    def _kept(self, kind: KindT) -> list[int]:
        return self._relays.paths[kind].handed.numbers(self._series)

    def _drain(self, kind: KindT) -> None:
        """Wait until the consumer has handed on the newest, for as long as it makes progress.

        One that leaves out what is too old may, on a busy machine, not get through what has piled
        up while more comes in: if nothing comes out, nothing comes in until it has.
        """
        relays, newest = self._relays, max(self._published(kind), default=-1)

        def is_out() -> bool:
            return max(self._kept(kind), default=-1) >= newest

        passed = -1
        while passed < (now := len(self._kept(kind))) and not relays.wait(is_out):
            passed = now
        if self._traffic[kind].limit < UNLIMITED:  # who hands the newest on first has lost nothing
            relays.wait_for_rest()
            relays.wait(lambda: len(set(self._kept(kind))) >= self._counts[kind], PROMPT_S)
        elif not is_out():
            with hold_streams(self._streams.values()):
                relays.wait_for_rest(SETTLE_S)
            relays.wait(is_out)

    def _watch(self, unwatched: Collection[KindT]) -> None:
        """See whether the consumer keeps up while messages come in at their rate."""
        for kind, stream in self._streams.items():
            if self._traffic[kind].limit < UNLIMITED or kind in unwatched:
                stream.stop()
                continue
            stream.keep_rate()
            path = self._relays.paths[kind]
            self.lags[kind] = ConsumerLag(
                path.published, path.handed, self._series, self._resumed_ns,
                rate_hz=kind.rate_hz, most_waiting=kind.most,
                each_counts=self._traffic[kind].each_counts, noun=f"{kind.noun}s",
            )  # fmt: skip
        watch_consumers(self._relays, self.lags, lambda kind: self._streams[kind].stop())

    def require_backlog(self, kind: KindT) -> Backlog:
        """Return what has become of the messages of one kind by now.

        Raises:
            Failed: the consumer cannot be held back.
            NotExaminable: it cannot be held back here, or the machine was too busy.
        """
        found, count = self.backlog(kind), self._traffic[kind].count_at(kind.rate_hz)
        if found.is_early and not self._relays.can_hold:
            raise NotExaminable(
                "Your consumer went on while its callbacks were held back: a thread or an executor "
                "of its own does its work, and that cannot be held back here, only where your work "
                "is graded in the sandbox."
            )
        if found.is_early:
            raise Failed(
                expected="While none of its threads runs, your consumer hands nothing on.",
                actual="It went on: does a thread bear a name that those of DDS have?",
            )
        if found.count < count:
            raise too_busy(
                f"bring {count} {kind.noun}s through your nodes in {LONGEST_S:.0f} s "
                f"({found.count} came), or these take their time"
            )
        return found

    def backlog(self, kind: KindT) -> Backlog:
        """Return what has become of the messages of one kind by now."""
        kept, published = self._kept(kind), self._published(kind)
        since = [when for number, when in published.items() if number >= min(kept, default=0)]
        oldest_ns = self._resumed_ns - published.get(min(kept, default=-1), self._resumed_ns)
        return Backlog(
            self._counts[kind], len(published), kept, len(since), oldest_ns / 1e9,
            kind in self._early,
        )  # fmt: skip

    def draw(self, kind: KindT) -> Timeline:
        """Return a picture of the messages that came in, and of which were handed on afterwards."""
        published = self._published(kind)
        began_ns = min(published.values(), default=self._resumed_ns)
        ended_s = (self._resumed_ns - began_ns) / 1e9
        title = f"What came in while the consumer was busy, and what it acted on then: {kind}"
        return handled_picture(
            title, f"{kind.noun}s that came in", self._kept(kind),
            {number: (when - began_ns) / 1e9 for number, when in published.items()},
            (ended_s - kind.most / kind.rate_hz, ended_s),
        )  # fmt: skip

    @property
    def may_have_expired_late(self) -> bool:
        """Whether what was too old may be DDS's fault, which now and then expires it late."""
        return any(
            self._relays.paths[kind].find_ends().can_expire
            and self.backlog(kind).is_stale(kind.most, kind.rate_hz)
            for kind in self._traffic
        )


def pause_consumer(
    relays: ObservedRelays[KindT],
    traffic: Mapping[KindT, Traffic],
    unwatched: Collection[KindT] = (),
) -> Pause[KindT]:
    """Keep the consumer busy while messages come in, let it go on, and watch it.

    Done again if that tells nothing, or if DDS was at fault.

    Args:
        relays: the student's nodes.
        traffic: what comes in.
        unwatched: messages of which a node on the way drops some: they never come at their rate, so
            that is not waited for.

    Raises:
        NotExaminable: DDS could never receive meanwhile.
    """
    for number in range(TRIES):
        pause = Pause(relays, f"pause {number}", traffic, unwatched)
        is_final = number + 1 >= EXPIRY_TRIES
        if not pause.is_jammed and (is_final or not pause.may_have_expired_late):
            return pause
        relays.wait_for_rest()
    raise NotExaminable(
        "Your consumer was at work at each moment in which the examiner tried to keep it busy from "
        "outside, so that nothing could be received either. After a hand-in a person looks at it."
    )
