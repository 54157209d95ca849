"""What a pause has left of the readings that came in while a consumer was busy."""

from __future__ import annotations

from dataclasses import dataclass

from autograder.exercises.qos.consumer_lag import Handing, Share
from autograder.exercises.qos.readings import STOP, Sensor

BURST = 5  # IMU readings that come in while the consumer is busy for 50 ms
THINNED = 0.8  # a driver that publishes less than this share of the readings drops some


@dataclass(frozen=True)
class Backlog:
    """One sensor's readings: how many came in during the pause, and what became of them.

    ``published`` is how many of these the driver put on the topic. ``kept`` has the numbers in the
    order in which the consumer passed them on; those from ``count`` on came in after the pause.
    ``replayed`` is how many the driver published from the first of them to the end of the pause: it
    may have lost some of its own, which nobody can have kept.
    ``oldest`` is how old the first of them was at the end of the pause, in s since its publication.
    ``early`` says that some came out while the consumer was held back, ``expires`` that readings
    are to expire by a LIFESPAN, ``behind`` what it handed on when it had fallen far behind later
    on, if it did, ``omits`` what share it handed on then, if it left out some again and again.
    ``altered`` says that the driver changed some reading, ``again`` how many stop events have been
    handed on more than once.
    """

    sensor: Sensor
    count: int
    published: int
    kept: list[int]
    replayed: int
    oldest: float
    early: bool
    expires: bool
    altered: bool
    again: int
    behind: Handing | None = None
    omits: Share | None = None

    @property
    def is_withheld(self) -> bool:
        """Whether the driver kept some to itself; of stop events, any."""
        least = self.count if self.sensor is STOP else (self.count - 1) * THINNED
        return self.published < least

    @property
    def is_unfinished(self) -> bool:
        """Whether the newest has not come out, nor one from after the pause."""
        return max(self.kept, default=-1) < self.count - 1

    @property
    def is_stale(self) -> bool:
        """Whether the consumer acted on what was too old, by number and by age."""
        most = self.sensor.most
        return self.replayed > most and self.oldest > most / self.sensor.rate

    @property
    def may_have_expired_late(self) -> bool:
        """Whether what was too old may be DDS's fault, which now and then expires it late."""
        return self.expires and self.is_stale

    @property
    def is_disordered(self) -> bool:
        """Whether some came out after a newer one."""
        return self.kept != sorted(self.kept)

    @property
    def is_decided(self) -> bool:
        """Whether it is wrong whatever comes after the pause: then nobody need wait for that."""
        if self.early or self.altered or self.is_withheld:
            return True
        return not self.is_unfinished and (self.is_stale or self.is_disordered)


@dataclass(frozen=True)
class Burst:
    """What a consumer passed on of a burst, in order; ``aged`` if a reading may have got old.

    ``published`` is how many of the burst the driver put on the topic.
    """

    kept: list[int]
    published: int
    aged: bool

    @property
    def missing_count(self) -> int:
        """How many readings were lost."""
        return BURST - len(set(self.kept))

    @property
    def is_conclusive(self) -> bool:
        """Whether what is missing tells something of the consumer."""
        return not self.missing_count or (self.published == BURST and not self.aged)
