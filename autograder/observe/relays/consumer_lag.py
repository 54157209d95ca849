"""Whether a consumer keeps up with what comes in, or falls further and further behind.

A list that fills faster than it is emptied is a queue without end, whatever DDS keeps. It shows
after a pause, while messages go on coming in: though they come at their rate, a sound consumer soon
hands on one that is fresh; with the other each is older than the one before. Both times, of
publication and of handing on, are the student's own: how fast the examiner hears of them plays no
part.

A busy machine brings fewer messages than the topic's rate, and a consumer that is too slow for it
then seems to keep up. So a fresh message counts if they had come at their rate until then; or else
the consumer has to have shown that it can be quicker than the rate, and to have handed on one that
was not too old: a delay line is quick, too.

A list that drops its oldest messages, and is emptied too slowly, hands on none that is too old, but
not all of them. Where each counts, such a list leaves out one here and one there, all the time.
What a queue loses in a busy moment stands together, and many come out before the next.
"""

from __future__ import annotations

import time
from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple, TypeVar

from autograder.examination.pictures.picture import Series
from autograder.observe.relays.arrivals import Arrivals
from autograder.observe.relays.observed_process import ObservedProcess

WATCHED_S = 0.8  # after a pause; from then on a fresh message shows that a consumer keeps up
FRESH_S = 0.2  # a control loop at 5 Hz that acts on the newest hands it on within this time
GENEROUS = 2  # times what a consumer may find waiting: beyond it is not just a busy moment
LASTING_S = 0.5  # for which it has to stay beyond
STEADY_S, MANY = 3.0, 8  # and messages, that have to be beyond the bound itself, all of them
QUIET_S = 2.0  # without a message after which there is nothing more to see
RATED_S, ENOUGH = 1.0, 0.9  # before, and the share of what is to come in then, for that to count
EVENLY = 0.8  # the share in either half of it: a slow consumer may be given all at the last moment
UNCLEAR_S = 8.0  # for those that are neither fresh nor far behind
STAMINA_S = 60.0  # until a machine on which messages never came at their rate proved too busy
SPURT = 5  # messages that were handed on twice as fast as they come: their consumer can catch up
GAPS, BETWEEN = 10, 5  # gaps in what was handed on, and messages at most between one and the next
MOST_DRAWN = 100  # messages in a picture
LOOKS_S = 0.05  # between two looks at all that was published and handed on
SELDOM = 10  # times what the last look took: the more there is to see, and the busier the machine

Key = TypeVar("Key")


class Handing(NamedTuple):
    """A message that was handed on: when, how old it was, and how many newer ones wait."""

    when_ns: int
    age_s: float
    waiting: int


class ConsumerLag:
    """Watches whether a consumer keeps up since a pause.

    Attributes:
        lag: in a sentence how far behind it was, if it falls behind.
        omission: in a sentence what it left out, if each message counts, and it left out many.
        is_able: it is neither fresh nor far behind, but has had to keep up, or could, and some
            message that it handed on was not too old to act on.
        is_undecided: the machine was too busy to tell.
    """

    def __init__(
        self, published: Arrivals, handed: Arrivals, series: str, since_ns: int, *, rate_hz: float,
        most_waiting: int, each_counts: bool = False, noun: str = "messages",
    ) -> None:  # fmt: skip
        """Begin to watch.

        Args:
            published: what comes in for the consumer.
            handed: what it hands on.
            series: of which messages.
            since_ns: the end of the pause, in ns since 1970.
            rate_hz: messages that come in each second.
            most_waiting: how many the consumer may find waiting; what would take longer to come in
                is too old.
            each_counts: whether the consumer has to hand on each message.
            noun: what the messages are called in sentences.
        """
        self.lag, self.omission = "", ""
        self.is_able = self.is_undecided = False
        self._published, self._handed, self._series = published, handed, series
        self._since_ns, self._rate_hz, self._most = since_ns, rate_hz, most_waiting
        self._each_counts, self._noun = each_counts, noun
        self._quick = self._settled = False
        self._look_at_ns = since_ns + WATCHED_S * 1e9
        # Of messages that were published, and of those handed on: how many, and when (ns) the last.
        self._heard, self._heard_at_ns = [0, 0], [time.time_ns()] * 2

    def is_settled(self) -> bool:
        """Whether it has been seen that the consumer keeps up, or that it does not."""
        if not self._settled and (began := time.time_ns()) > self._look_at_ns:
            self._settled = self._examine_handings()
            ended = time.time_ns()
            self._look_at_ns = ended + max(LOOKS_S * 1e9, SELDOM * (ended - began))
        return self._settled

    def draw(self) -> Series:
        """Return a picture of how old each message was when it was handed on."""
        published = self._published.first_times(self._series)
        handings = self._list_handings(published, sorted(published.values()))
        points = [
            (round((handing.when_ns - self._since_ns) / 1e9, 2), round(handing.age_s, 2))
            for handing in handings[:: len(handings) // MOST_DRAWN + 1]
        ]
        title = f"How old the {self._noun} were when they were handed on, after the pause"
        return Series(title, "seconds since the pause", "seconds old", tuple(points))

    def _examine_handings(self) -> bool:
        published = self._published.first_times(self._series)
        moments = sorted(published.values())
        handings = self._list_handings(published, moments)
        if self._is_quiet(moments, handings):
            return True
        if not handings:
            return False
        if self._each_counts and (omission := self._find_omission(published)):
            self.omission = omission
            return True
        # A list that is emptied slowly bears a high rate for a second, until it is full: where each
        # message counts only a spurt does.
        rated = not self._each_counts and self._at_rate(moments, moments[-1])
        self._quick = self._quick or rated or self._has_spurt(handings)
        young_s = self._most / self._rate_hz
        self.is_able = self._quick and any(self._is_fresh(each, young_s) for each in handings)
        newest = handings[-1]
        if self._is_fresh(newest, FRESH_S) and self._at_rate(moments, newest.when_ns):
            return True
        self.lag = self._find_lag(handings)
        return bool(self.lag)

    def _find_lag(self, handings: Sequence[Handing]) -> str:
        came = f"while {self._noun} came in at {self._rate_hz:.0f} Hz"
        late = self._late_at_last(handings, GENEROUS)
        if late and late[0].when_ns - late[-1].when_ns > LASTING_S * 1e9:
            return (
                f"Afterwards it fell further and further behind: {came}, it handed on one that was "
                f"{late[0].age_s:.2f} s old, and {late[0].waiting} newer ones were waiting."
            )
        # A list that is always full does not grow, but no message that comes out of it is fresh.
        late = self._late_at_last(handings, 1)
        if len(late) >= MANY and late[0].when_ns - late[-1].when_ns > STEADY_S * 1e9:
            freshest = min(late, key=lambda handing: handing.age_s)
            return (
                f"Afterwards, {came}, even the freshest that it handed on was "
                f"{freshest.age_s:.2f} s old, which is more than {self._most / self._rate_hz:g} s, "
                f"and {freshest.waiting} newer ones were waiting."
            )
        return ""

    def _is_fresh(self, handing: Handing, age_s: float) -> bool:
        return handing.when_ns > self._since_ns + WATCHED_S * 1e9 and handing.age_s <= age_s

    def _is_quiet(self, moments: Sequence[int], handings: Sequence[Handing]) -> bool:
        """Whether nothing is handed on though messages are published, or nothing heard at all.

        An examiner that is late itself hears of both late, of one more than of the other, and goes
        on hearing.
        """
        now = time.time_ns()
        for kind, heard in enumerate((len(moments), len(handings))):
            if heard != self._heard[kind]:
                self._heard[kind], self._heard_at_ns[kind] = heard, now
        published_at, handed_at = self._heard_at_ns
        last = handings[-1].when_ns if handings else self._since_ns
        goes_on = bool(moments) and moments[-1] > last + QUIET_S * 1e9
        quiet = now > handed_at + QUIET_S * 1e9
        return quiet and (goes_on or now > published_at + QUIET_S * 1e9)

    def _at_rate(self, moments: Sequence[int], end_ns: int) -> bool:
        """Whether messages came at their rate until then; a slow consumer keeps up with fewer."""
        half = int(RATED_S / 2 * 1e9)
        at = [bisect_right(moments, end_ns - ago) for ago in (2 * half, half, 0)]
        expected = RATED_S * self._rate_hz
        evenly = min(at[1] - at[0], at[2] - at[1]) >= EVENLY * expected / 2
        return evenly and at[2] - at[0] >= ENOUGH * expected

    def _find_omission(self, published: Mapping[int, int]) -> str:
        """Return what is handed on of messages of which some are left out again and again."""
        handed = set(self._handed.numbers(self._series))
        since = {number: when for number, when in published.items() if when > self._since_ns}
        order = sorted(since, key=lambda number: since[number])
        begin, gaps, last = 0, 0, -1  # last: where the gap before was, in that order
        for at, number in enumerate(order):
            if number in handed:
                continue
            if last < 0 or at - last > BETWEEN + 1:
                begin, gaps = at, 0
            if gaps == 0 or at > last + 1:
                gaps += 1
            last = at
            if gaps > GAPS:
                return (
                    f"While {self._noun} came in, it handed on "
                    f"{len(handed.intersection(order[begin:at]))} of {at - begin}, and left out "
                    "one or a few again and again: is there a list that drops what it does not "
                    "hand on in time?"
                )
        return ""

    def _has_spurt(self, handings: Sequence[Handing]) -> bool:
        when = [handing.when_ns for handing in handings]
        within = SPURT / self._rate_hz / 2 * 1e9
        return any(b - a < within for a, b in zip(when, when[SPURT - 1 :], strict=False))

    def _late_at_last(self, handings: Sequence[Handing], generous: int) -> list[Handing]:
        """Go back through those that are late until one is not."""
        most = generous * self._most
        late: list[Handing] = []
        for handing in reversed(handings):
            if handing.waiting <= most or handing.age_s <= most / self._rate_hz:
                break
            late.append(handing)
        return late

    def _list_handings(self, published: Mapping[int, int], moments: Sequence[int]) -> list[Handing]:
        return [
            Handing(
                when,
                (when - published[number]) / 1e9,
                bisect_right(moments, when) - bisect_right(moments, published[number]),
            )
            for number, when, _ in self._handed.of(self._series)
            if when > self._since_ns and number in published
        ]


def watch_consumers(
    process: ObservedProcess, lags: Mapping[Key, ConsumerLag], stop: Callable[[Key], None]
) -> None:
    """Watch consumers until it has been seen of each whether it keeps up.

    To be called while messages go on coming in at their rate, which it lets ``stop`` where all has
    been seen: on a busy machine the others then come at their rate sooner.
    """
    watched = dict(lags)

    def over(is_enough: Callable[[ConsumerLag], bool]) -> bool:
        for key in [key for key, lag in watched.items() if is_enough(lag)]:
            stop(key)
            del watched[key]
        return not watched

    process.wait(lambda: over(ConsumerLag.is_settled), WATCHED_S + UNCLEAR_S, often=False)
    process.wait(lambda: over(lambda lag: lag.is_settled() or lag.is_able), STAMINA_S, often=False)
    for lag in watched.values():
        lag.is_undecided = True
