"""Whether a consumer keeps up with what comes in, or falls further and further behind.

A list that fills faster than it is emptied is a queue without end, whatever DDS keeps. It shows
after a pause, while readings go on coming in: though they come at their rate, a sound consumer soon
hands on one that is fresh; with the other each is older than the one before. Both times, of
publication and of handing on, are the student's own: how fast the examiner hears of them plays no
part.

A busy machine brings fewer readings than the sensor has, and a consumer that is too slow for the
sensor then seems to keep up. So a fresh reading counts if they had come at their rate until then;
or else the consumer has to have shown that it can be quicker than the sensor, and to have handed on
one that was not too old: a delay line is quick, too.

A list that drops its oldest readings, and is emptied too slowly, hands on none that is too old, but
not all of them. Of the IMU each one counts: such a list leaves out one here and one there, all the
time. What a queue loses in a busy moment stands together, and many come out before the next.
"""

from __future__ import annotations

import time
from bisect import bisect_right
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace

from autograder.exercises.qos.readings import IMU, Sensor
from autograder.exercises.qos.rig import SensorRig

WATCHED = 0.8  # s after a pause; from then on a fresh reading shows that a consumer keeps up
FRESH = 0.2  # s: a control loop at 5 Hz that acts on the newest hands it on within this time
GENEROUS = 2  # times what a consumer may find waiting: beyond it is not just a busy moment
LASTING = 0.5  # s for which it has to stay beyond
STEADY, MANY = 3.0, 8  # s, and readings, that have to be beyond the bound itself, all of them
QUIET = 2.0  # s without a reading after which there is nothing more to see
RATED, ENOUGH = 1.0, 0.9  # s before, and the share of what is to come in then, for that to count
EVENLY = 0.8  # the share in either half of it: a slow consumer may be given all at the last moment
PATIENCE = 8.0  # s for those that are neither fresh nor far behind
STAMINA = 60.0  # s until a machine on which readings never came at their rate has proved too busy
SPURT = 5  # readings that were handed on twice as fast as they come: their consumer can catch up
GAPS, BETWEEN = 10, 5  # gaps in what was handed on, and readings at most between one and the next
LOOKS = 0.05  # s between two looks at all that was published and handed on
SELDOM = 10  # times what the last look took: the more there is to see, and the busier the machine


@dataclass(frozen=True)
class Handing:
    """A reading that was handed on: when (ns), how old it was (s), and how many newer ones wait.

    ``freshest`` says that none was fresher than this one, of all that were handed on for a while.
    """

    when: int
    age: float
    waiting: int
    freshest: bool = False

    @property
    def is_undecided(self) -> bool:
        """Whether the machine was too busy to tell whether its consumer keeps up."""
        return self is UNKNOWN

    def describe_lag(self, sensor: Sensor) -> str:
        """Return in a sentence how far behind a sensor's consumer was."""
        while_they_came = f"while readings came in at {sensor.rate:.0f} Hz"
        if self.freshest:
            return (
                f"Afterwards, {while_they_came}, even the freshest that it handed on was "
                f"{self.age:.2f} s old, which is more than {sensor.most / sensor.rate:g} s, and "
                f"{self.waiting} newer ones were waiting."
            )
        return (
            f"Afterwards it fell further and further behind: {while_they_came}, it handed on one "
            f"that was {self.age:.2f} s old, and {self.waiting} newer ones were waiting."
        )


UNKNOWN = Handing(0, 0.0, 0)
"""Stands for what a machine was too busy to tell."""


@dataclass(frozen=True)
class Share:
    """How many readings were published in some time, and how many of these were handed on."""

    published: int
    handed: int

    def describe_omission(self) -> str:
        """Return in a sentence what a consumer left out."""
        return (
            f"While readings came in, it handed on {self.handed} of {self.published}, and left out "
            "one or a few again and again: is there a list that drops what it does not hand on in "
            "time?"
        )


def watch_consumers(
    rig: SensorRig,
    sensors: Iterable[Sensor],
    phase: str,
    resumed: int,
    stop: Callable[[Sensor], None],
) -> dict[str, Pursuit]:
    """Watch what is handed on since ``resumed`` (ns); return what was seen, by sensor name.

    To be called while readings go on coming in, which it lets ``stop`` where all has been seen: on
    a busy machine the others then come at their rate sooner.
    """
    pursuits = [Pursuit(rig, sensor, phase, resumed) for sensor in sensors]
    watched = list(pursuits)

    def over(enough: Callable[[Pursuit], bool]) -> bool:
        for pursuit in filter(enough, watched.copy()):
            stop(pursuit.sensor)
            watched.remove(pursuit)
        return not watched

    rig.wait_in_traffic(lambda: over(Pursuit.is_settled), WATCHED + PATIENCE)
    rig.wait_in_traffic(lambda: over(lambda pursuit: pursuit.is_settled() or pursuit.able), STAMINA)
    for pursuit in watched:
        pursuit.behind = UNKNOWN
    return {pursuit.sensor.name: pursuit for pursuit in pursuits}


class Pursuit:
    """One sensor's consumer, and whether it keeps up.

    ``behind`` is where it was if it falls behind, ``omits`` the share that it handed on if it has
    to see each reading, and left many out.
    ``able`` says of one that is neither fresh nor far behind that it has had to keep up, or could,
    and that some reading that it handed on was not too old to act on.
    """

    def __init__(self, rig: SensorRig, sensor: Sensor, phase: str, resumed: int) -> None:
        """Watch what was handed on since ``resumed`` (ns)."""
        self.sensor = sensor
        self.behind: Handing | None = None
        self.omits: Share | None = None
        self._rig, self._phase, self._resumed = rig, phase, resumed
        self.able = False
        self._quick = False
        self._settled = False
        self._look_at = resumed + WATCHED * 1e9
        # Of readings that were published, and of those handed on: how many, and when (ns) the last.
        self._heard, self._heard_at = [0, 0], [time.time_ns()] * 2

    def is_settled(self) -> bool:
        """Whether it has been seen that the consumer keeps up, or that it does not."""
        if not self._settled and (began := time.time_ns()) > self._look_at:
            self._settled = self._examine_handings()
            ended = time.time_ns()
            self._look_at = ended + max(LOOKS * 1e9, SELDOM * (ended - began))
        return self._settled

    def _examine_handings(self) -> bool:
        published = self._rig.publication_times(self.sensor, self._phase)
        moments = sorted(published.values())
        handings = self._list_handings(published, moments)
        if self._is_quiet(moments, handings):
            return True
        if not handings:
            return False
        if self.sensor is IMU and (omits := self._find_omission(published)) is not None:
            self.omits = omits
            return True
        # A list of IMU readings that is emptied slowly bears their rate for a second, until it is
        # full: here only a spurt counts.
        rated = self.sensor is not IMU and self._at_rate(moments, moments[-1])
        self._quick = self._quick or rated or self._has_spurt(handings)
        self.able = self._quick and any(map(self._is_young, handings))
        if self._is_fresh(handings[-1]) and self._at_rate(moments, handings[-1].when):
            return True
        late = list(self._late_at_last(handings, GENEROUS))
        if late and late[0].when - late[-1].when > LASTING * 1e9:
            self.behind = late[0]
        # A list that is always full does not grow, but no reading that comes out of it is fresh.
        always = list(self._late_at_last(handings, 1))
        if len(always) >= MANY and always[0].when - always[-1].when > STEADY * 1e9:
            freshest = min(always, key=lambda handing: handing.age)
            self.behind = self.behind or replace(freshest, freshest=True)
        return self.behind is not None

    def _is_fresh(self, handing: Handing) -> bool:
        return self._is_watched(handing) and handing.age <= FRESH

    def _is_young(self, handing: Handing) -> bool:
        return self._is_watched(handing) and handing.age <= self.sensor.most / self.sensor.rate

    def _is_watched(self, handing: Handing) -> bool:
        return handing.when > self._resumed + WATCHED * 1e9

    def _is_quiet(self, moments: list[int], handings: list[Handing]) -> bool:
        """Whether nothing is handed on though readings are published, or nothing heard at all.

        An examiner that is late itself hears of both late, of one more than of the other, and goes
        on hearing.
        """
        now = time.time_ns()
        for kind, heard in enumerate((len(moments), len(handings))):
            if heard != self._heard[kind]:
                self._heard[kind], self._heard_at[kind] = heard, now
        published_at, handed_at = self._heard_at
        last = handings[-1].when if handings else self._resumed
        goes_on = bool(moments) and moments[-1] > last + QUIET * 1e9
        quiet = now > handed_at + QUIET * 1e9
        return quiet and (goes_on or now > published_at + QUIET * 1e9)

    def _at_rate(self, moments: list[int], end: int) -> bool:
        """Whether readings came at the sensor's rate until ``end`` (ns since 1970).

        A slow consumer keeps up with fewer.
        """
        half = int(RATED / 2 * 1e9)
        at = [bisect_right(moments, end - ago) for ago in (2 * half, half, 0)]
        expected = RATED * self.sensor.rate
        evenly = min(at[1] - at[0], at[2] - at[1]) >= EVENLY * expected / 2
        return evenly and at[2] - at[0] >= ENOUGH * expected

    def _find_omission(self, published: Mapping[int, int]) -> Share | None:
        """Return what is handed on of readings of which some are left out again and again."""
        handed = {number for number, _ in self._rig.handed_readings(self.sensor, self._phase)}
        since = {number: when for number, when in published.items() if when > self._resumed}
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
                some = order[begin:at]
                return Share(len(some), len(handed.intersection(some)))
        return None

    def _has_spurt(self, handings: list[Handing]) -> bool:
        when = [handing.when for handing in handings]
        within = SPURT / self.sensor.rate / 2 * 1e9
        return any(b - a < within for a, b in zip(when, when[SPURT - 1 :], strict=False))

    def _late_at_last(self, handings: list[Handing], generous: int) -> Iterable[Handing]:
        """Go back through those that are late until one is not."""
        most = generous * self.sensor.most
        for handing in reversed(handings):
            if handing.waiting <= most or handing.age <= most / self.sensor.rate:
                return
            yield handing

    def _list_handings(self, published: Mapping[int, int], moments: list[int]) -> list[Handing]:
        return [
            Handing(
                when,
                (when - published[number]) / 1e9,
                bisect_right(moments, when) - bisect_right(moments, published[number]),
            )
            for number, when in self._rig.handed_readings(self.sensor, self._phase)
            if when > self._resumed and number in published
        ]
