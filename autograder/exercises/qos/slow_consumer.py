"""What is left for a consumer that was busy for a while, and whether it keeps up afterwards.

Two pauses show it (`autograder.observe.relays.slow_reader`): a long one what is too old, a short
one what must not be lost, in so little time that nothing of it is old.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field

from autograder.examination.exam import Failed
from autograder.examination.pictures.picture import Timeline
from autograder.exercises.qos.readings import CAMERA, CONSUMERS, IMU, LIDAR, STOP, Sensor, SensorRig
from autograder.exercises.qos.single_readings import (
    find_prompt,
    require_each_published,
    send_singles,
)
from autograder.observe.findings import handled_picture, with_picture
from autograder.observe.relays.sequence_faults import lost_phrase, numbers_phrase
from autograder.observe.relays.slow_reader import (
    PROMPT_S,
    TRIES,
    Backlog,
    Pause,
    Traffic,
    pause_consumer,
    too_busy,
)

EVENTS = 100
"""Stop events in a long pause."""
LONG_PAUSE = {
    CAMERA: Traffic(seconds=1.5),
    LIDAR: Traffic(seconds=1.5),
    STOP: Traffic(seconds=1.5, limit=EVENTS),
    IMU: Traffic(seconds=0.9, each_counts=True),  # nearly twice as many as may be kept
}
BURST = 5
"""IMU readings that come in while the consumer is busy for 50 ms."""
BURST_S = 0.05
"""Seconds in which they come in, at least."""
YOUNG_S = 0.35
"""Seconds from the first reading of a burst on in which all come out of an idle machine: a design
that goes by the age of a reading (0.5 s is old) may rightly find a later one too old, and then it
is the machine that is slow."""
TURNS = BURST + 2
"""Turns of a driver after which a consumer has had one for each reading of a burst."""


def pause_for_long(rig: SensorRig) -> Pause[Sensor]:
    """Keep the consumer busy for long, while readings of all sensors come in."""
    singles = rig.run_once(send_singles)
    thinned = [sensor for sensor, single in singles.items() if single.is_thinned]
    traffic = {sensor: LONG_PAUSE[sensor] for sensor in find_prompt(rig)}
    return pause_consumer(rig, traffic, unwatched=thinned)


def require_backlog(rig: SensorRig, sensor: Sensor) -> Backlog:
    """Return what a long pause left of a sensor's readings; fail if the driver drops any."""
    pause = rig.run_once(pause_for_long)
    require_each_published(rig, sensor)
    return pause.require_backlog(sensor)


def require_fresh(rig: SensorRig, sensor: Sensor, expected: str) -> None:
    """Fail unless the consumer goes on with the newest after a long pause, and keeps up then."""
    backlog = require_backlog(rig, sensor)
    pause = rig.run_once(pause_for_long)
    lag = pause.lags[sensor]
    in_pause = backlog.describe_fault(sensor.most, sensor.rate_hz, sensor.noun)
    if fault := in_pause or lag.lag:
        actual = f"{fault.removesuffix('.')}{rig.error_note()}."
        with with_picture(lambda: pause.draw(sensor) if in_pause else lag.draw()):
            raise Failed(expected=expected, actual=actual)
    if lag.is_undecided:
        raise too_busy(
            f"bring {sensor} readings at {sensor.rate_hz:.0f} Hz, and so to see whether your "
            "consumer keeps up with them"
        )


def require_none_left_out(rig: SensorRig) -> None:
    """Fail if the consumer leaves out IMU readings again and again while they come in."""
    if omission := rig.run_once(pause_for_long).lags[IMU].omission:
        raise Failed(
            expected="While readings come in, the consumer hands on each of them, once.",
            actual=omission,
        )


@dataclass(frozen=True)
class Burst:
    """What a consumer handed on of a burst, in order; ``is_aged`` if a reading may have got old.

    ``published`` is how many of the burst the driver put on the topic.
    """

    kept: list[int]
    published: int
    is_aged: bool
    times_s: dict[int, float] = field(default_factory=dict)
    """When each came in, since the first."""

    def draw(self) -> Timeline:
        """Return a picture of the readings that came in, and of which were handed on."""
        title = "What came in while the consumer was busy for a moment, and what it handed on"
        ended_s = max(BURST_S, *self.times_s.values())
        label = "IMU readings that came in"
        return handled_picture(title, label, self.kept, self.times_s, (0.0, ended_s), "handed on")

    @property
    def missing_count(self) -> int:
        """How many readings were lost."""
        return BURST - len(set(self.kept))


def pause_for_burst(rig: SensorRig) -> Burst:
    """Keep the consumer busy while a burst of IMU readings comes in, and see what it hands on.

    Tried again while readings are missing that a slow machine may have let grow old, or that the
    driver has lost.
    """
    for number in range(TRIES):
        patience_s = None if number == TRIES - 1 else PROMPT_S
        burst = _send_burst(rig, f"short pause {number}", patience_s)
        if not burst.missing_count or (burst.published == BURST and not burst.is_aged):
            break
    return burst


def _send_burst(rig: SensorRig, series: str, patience_s: float | None) -> Burst:
    path = rig.paths[IMU]
    rig.wait_for_rest()  # what still waits for the consumer would be ahead of the burst
    with rig.keep_busy(CONSUMERS) as let_go:
        stream = path.stream(series, limit=BURST)
        rig.wait_for_relay(IMU, series, BURST - 1)
        published = path.published.first_times(series)
        is_jammed = let_go()
    rig.wait(lambda: BURST - 1 in path.handed.numbers(series), patience_s)
    stream.stop()
    handed_ns = path.handed.first_times(series).get(BURST - 1)
    decided_ns = _decision_ns(rig, f"{series}, later") if handed_ns is None else handed_ns
    rig.wait(lambda: len(set(path.handed.numbers(series))) == BURST, PROMPT_S)
    rig.wait_for_rest()  # one that hands on a reading again is heard out: how many is told
    is_aged = decided_ns - published.get(0, 0) > YOUNG_S * 1e9
    times_s = {number: (when - min(published.values())) / 1e9 for number, when in published.items()}
    kept = path.handed.numbers(series)
    return Burst(kept, len(published), is_aged or is_jammed, times_s)


def _decision_ns(rig: SensorRig, series: str) -> int:
    """Return when the machine had come to all of a burst whose last reading is not out.

    That is the moment in which all is at rest. A subject that never rests is given more readings:
    once one of them has come out, all of the burst has been decided about. But a consumer that
    hands on few or none takes as long as it likes, so what tells of a slow machine is the driver:
    it shares a thread with the consumer, and after as many of its turns the consumer has had its
    own.
    """
    is_at_rest, now_ns = rig.is_at_rest(), time.time_ns()
    path = rig.paths[IMU]
    stream = path.stream(series)
    stream.slow_down()
    rig.wait(lambda: stream.sent >= TURNS and path.handed.numbers(series))
    stream.stop()
    turned_ns = path.published.first_times(series).get(TURNS - 1, time.time_ns())
    return min(now_ns, turned_ns) if is_at_rest else turned_ns


def require_burst(rig: SensorRig, expected: str) -> None:
    """Fail unless the consumer hands on every IMU reading of a short pause, once and in order."""
    found = rig.run_once(pause_for_burst)
    missing = found.missing_count
    if missing and found.published < BURST:
        actual = f"Of {BURST} that came in, {found.published} went over {IMU.topic}."
    elif missing and found.is_aged:
        raise too_busy("tell a short queue from readings that had grown old")
    elif missing:
        passed = BURST - missing
        oldest = bool(passed) and set(found.kept) == set(range(missing, BURST))
        actual = (
            f"Of {BURST} readings that came in while it was busy "
            f"{lost_phrase(missing, oldest=oldest)}, {passed or 'none'} "
            f"{'were' if passed > 1 else 'was'} handed on{rig.error_note()}."
        )
    elif len(found.kept) > BURST:
        actual = (
            f"It handed on {BURST} readings as {len(found.kept)}: some came out more than once, "
            "and an estimator that adds them up turns too far."
        )
    elif found.kept != sorted(found.kept):
        actual = f"It handed them on out of order: {numbers_phrase(found.kept, 'reading')}."
    else:
        return
    with with_picture(found.draw):
        raise Failed(expected=expected, actual=actual)
