"""Messages that come in one by one: whether a node passes each of them on, and at once.

One is sent on each way through the node at a time, the next when all have come out. So each finds
the node idle, and whatever keeps a message back is the node's own doing.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

from autograder.observe.relays.arrivals import Arrivals
from autograder.observe.relays.message_stream import LAG_S
from autograder.observe.relays.observed_process import ObservedProcess

SINGLES = 16
"""Messages that are sent one by one."""
MOST_SINGLES = 3 * SINGLES
"""Messages for a node of which the first do not tell: some were late, or the machine was busy."""
PROMPT, SLOW = 5, 12
"""Messages that came out at once, or late, after which a node is known."""
HELD = 4
"""Messages that waited for too long while all was at rest, after which a node is slow, however many
others came out at once: on a busy machine they often come in just before it looks."""
FORGIVEN = 1
"""Message that may be missing: a best-effort link may have lost it."""


class RelayLatency:
    """What became of the messages that were sent on one way through a node.

    Attributes:
        missed: the numbers of those that had not come out when the next was sent.
        waited: of those that had not come out when all was at rest: nobody was at work on them any
            more, so that it was not the machine that took its time.
        held: of those that had not even come out at such a moment after ``at_once_s``.
    """

    def __init__(
        self, send: Callable[[int], None], sent: Arrivals, out: Arrivals, series: str,
        at_once_s: float,
    ) -> None:  # fmt: skip
        """Begin with none.

        Args:
            send: publishes the message of a number.
            sent: notes what was sent.
            out: notes what comes out.
            series: what the messages are called there.
            at_once_s: s from one to the other that are at once.
        """
        self.send = send
        self.missed: list[int] = []
        self.waited: set[int] = set()
        self.held: set[int] = set()
        self._sent, self._out, self._series, self._at_once_s = sent, out, series, at_once_s

    @property
    def counts(self) -> tuple[int, int]:
        """How many went in, and how many of them came out."""
        return len(self._sent.first_times(self._series)), len(self._transit_times_s())

    def is_unseen(self, number: int) -> bool:
        """Whether a message has not come out yet."""
        return number not in self._out.numbers(self._series)

    @property
    def is_thinned(self) -> bool:
        """Whether more are missing than may be."""
        went_in, came_out = self.counts
        return went_in - came_out > FORGIVEN

    @property
    def keeps_back(self) -> bool:
        """Whether the last two running did not come out by themselves."""
        *_, before, last = [-2, -2, *self.missed]
        return last - before == 1 and self.is_unseen(last)

    @property
    def late_times_s(self) -> list[float]:
        """How long those took (s) that came out too late, and not by the machine's doing.

        Those that were `held` took longer than at once, whatever time the node gives them.
        """
        times = self._transit_times_s()
        late = {n: s for n, s in times.items() if s > self._at_once_s and n in self.waited}
        held = {n: max(times[n], self._at_once_s) for n in self.held & times.keys()}
        return list((late | held).values())

    @property
    def is_slow(self) -> bool:
        """Whether the node takes its time."""
        held = self.held & self._transit_times_s().keys()
        return len(held) >= HELD or (len(self.late_times_s) >= SLOW and not self._is_prompt)

    @property
    def is_known(self) -> bool:
        """Whether more messages would tell no more."""
        return self.is_slow or (self._is_prompt and not self.late_times_s)

    @property
    def _is_prompt(self) -> bool:
        return sum(s <= self._at_once_s for s in self._transit_times_s().values()) >= PROMPT

    def _transit_times_s(self) -> dict[int, float]:
        sent = self._sent.first_times(self._series)
        out = self._out.first_times(self._series)
        return {n: (when - sent[n]) / 1e9 for n, when in out.items() if n in sent}


def send_one_by_one(
    process: ObservedProcess, relays: Sequence[RelayLatency], at_once_s: float
) -> None:
    """Send messages on each way through a node, one by one, until enough is known of all."""
    for number in range(MOST_SINGLES):
        asked = [
            relay
            for relay in relays
            if len(relay.missed) <= FORGIVEN
            and not relay.is_slow
            and (number < SINGLES or not relay.is_known)
        ]
        if not asked:
            break
        _send_singles(process, asked, number, at_once_s)
    # Perhaps it was the machine that did not come to it.
    process.wait(lambda: not any(relay.keeps_back for relay in relays))


def _send_singles(
    process: ObservedProcess, relays: Sequence[RelayLatency], number: int, at_once_s: float
) -> None:
    for relay in relays:
        relay.send(number)
    sent = time.monotonic()

    def unseen() -> list[RelayLatency]:
        return [relay for relay in relays if relay.is_unseen(number)]

    def all_out() -> bool:
        return not unseen()

    process.wait_for_rest()
    for relay in unseen():
        relay.waited.add(number)
    at_once = process.wait(all_out, max(0.0, sent + at_once_s - time.monotonic()))
    if not at_once and process.is_at_rest():
        for relay in unseen():
            relay.held.add(number)
    process.wait(all_out, LAG_S)
    for relay in unseen():
        relay.missed.append(number)
