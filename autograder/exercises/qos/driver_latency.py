"""Readings that come in one by one: whether a driver publishes each of them, and at once.

One of each sensor is sent at a time, the next when all are seen on their topics. So each finds the
driver idle, and whatever keeps a reading back is the driver's own doing.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field

from autograder.examination.exam import Failed
from autograder.exercises.qos.readings import SENSORS, Sensor
from autograder.exercises.qos.rig import SensorRig
from autograder.exercises.qos.sensor_examiner import LAG

SINGLES = 16
MOST = 3 * SINGLES
"""Singles for a driver of which the first ones do not tell: some were late, or the machine busy."""
AT_ONCE = 0.15
"""Seconds from the hardware to the topic: the task says 0.1."""
PROMPT, SLOW = 5, 12
"""Singles that were published at once, or that were late, after which a driver is known."""
HELD = 4
"""Singles that waited beyond `AT_ONCE` while all was at rest, after which a driver is slow, however
many others it published at once: on a busy machine they often come in just before it looks."""
FORGIVEN = 1  # single that may be missing: a best-effort link may have lost it
_PHASE = "single"


def each_at_once(rig: SensorRig) -> dict[str, tuple[int, int]]:
    """Fail if a driver keeps a reading back until the next one comes, or for some time.

    Return for each sensor how many singles came in, and how many of them were published.
    """
    records = {sensor: _Record(rig, sensor) for sensor in SENSORS}
    for index in range(MOST):
        open_ones = [r for r in records.values() if index < SINGLES or not r.is_known()]
        if not _send_singles(rig, [r for r in open_ones if len(r.missed) <= FORGIVEN], index):
            break
        if any(record.is_slow() for record in records.values()):
            break
    for sensor in _held_for_the_next(rig, records):
        raised = rig.error_note()
        why = f"{raised}." if raised else ": does the driver wait for the next one?"
        raise Failed(
            expected="The drivers publish each reading as soon as the hardware delivers it.",
            actual=f"One more {sensor.name} reading came in, and it was not published on "
            f"{sensor.topic}{why}",
        )
    for sensor, record in records.items():
        if record.is_slow():
            late = record.late_times()
            raise Failed(
                expected="The drivers publish each reading as soon as the hardware delivers it, "
                "within 0.1 s.",
                actual=f"{len(record.transit_times())} {sensor.name} readings came in one by one, "
                f"and {len(late)} of them were published on {sensor.topic} "
                f"{min(late.values()):.2f} s later or more: what does the driver wait for?",
            )
    return {
        sensor.name: (
            len(rig.delivery_times(sensor, _PHASE)),
            len(set(rig.witnessed_indices(sensor, _PHASE))),
        )
        for sensor in SENSORS
    }


@dataclass
class _Record:
    """What became of one sensor's singles.

    ``waited`` are those that were not published when all was at rest: nobody was at work on them
    any more, so that it was not the machine that took its time. ``held`` are those that were still
    not published at such a moment after `AT_ONCE`.
    """

    rig: SensorRig
    sensor: Sensor
    missed: list[int] = field(default_factory=list)
    waited: set[int] = field(default_factory=set)
    held: set[int] = field(default_factory=set)

    def is_unseen(self, index: int) -> bool:
        return index not in self.rig.witnessed_indices(self.sensor, _PHASE)

    def transit_times(self) -> dict[int, float]:
        """Return how long each single took from the hardware to its topic, in s."""
        sent = self.rig.delivery_times(self.sensor, _PHASE)
        published = self.rig.publication_times(self.sensor, _PHASE)
        return {n: (when - sent[n]) / 1e9 for n, when in published.items() if n in sent}

    def late_times(self) -> dict[int, float]:
        """Return how long those took that were published too late, and not by the machine.

        Those that were `held` took longer than `AT_ONCE`, whatever time the driver gives them.
        """
        times = self.transit_times()
        late = {n: s for n, s in times.items() if s > AT_ONCE and n in self.waited}
        return late | {n: max(times[n], AT_ONCE) for n in self.held & times.keys()}

    def is_known(self) -> bool:
        return self.is_slow() or (self._is_prompt() and not self.late_times())

    def is_slow(self) -> bool:
        late = self.late_times()
        return len(self.held & late.keys()) >= HELD or (len(late) >= SLOW and not self._is_prompt())

    def _is_prompt(self) -> bool:
        return sum(seconds <= AT_ONCE for seconds in self.transit_times().values()) >= PROMPT


def _send_singles(rig: SensorRig, records: list[_Record], index: int) -> bool:
    """Send one reading of each of these sensors; return whether there were any."""
    for record in records:
        rig.node.publish(record.sensor, _PHASE, index)
    sent = time.monotonic()

    def unseen() -> list[_Record]:
        return [record for record in records if record.is_unseen(index)]

    rig.wait_for_rest()
    for record in unseen():
        record.waited.add(index)
    at_once = rig.wait(lambda: not unseen(), max(0.0, sent + AT_ONCE - time.monotonic()))
    if not at_once and rig.is_at_rest():
        for record in unseen():
            record.held.add(index)
    rig.wait(lambda: not unseen(), LAG)
    for record in unseen():
        record.missed.append(index)
    return bool(records)


def _held_for_the_next(rig: SensorRig, records: dict[Sensor, _Record]) -> list[Sensor]:
    """Return the sensors of which two running were not published by themselves.

    A sensor that has missed more than may be has been left alone since.
    """
    running = [
        (sensor, record, record.missed[-1])
        for sensor, record in records.items()
        if len(record.missed) > 1 and record.missed[-1] - record.missed[-2] == 1
    ]
    # Perhaps it was the machine that did not come to it.
    rig.wait(lambda: not any(record.is_unseen(last) for _, record, last in running))
    return [sensor for sensor, record, last in running if record.is_unseen(last)]


def find_thinning(rig: SensorRig, sensor: Sensor) -> tuple[int, int] | None:
    """Return how many singles came in, and how many of them were published; None if enough."""
    sent, seen = rig.run_once(each_at_once)[sensor.name]
    return (sent, seen) if sent - seen > FORGIVEN else None
