"""Readings that read like the one before, as those of a robot that stands still do.

Each is a reading of its own: it has its own stamp, and one press of a button reads like another.
Whoever leaves out what reads alike, to be sure that none comes twice, loses some.
"""

from __future__ import annotations

import time

from autograder.examination.exam import Failed
from autograder.exercises.qos.readings import IMU, STOP, Sensor, SensorRig
from autograder.exercises.qos.slow_consumer import YOUNG_S
from autograder.observe.relays.slow_reader import TRIES, too_busy

PRESSES = "presses"
"""The series of the stop events that bear the words of earlier ones."""
WORDS = (0, 1, 0, 0, 1)
"""Events that bear the same words again: pressed, released, pressed, pressed (at another button),
released."""
SAME, BATCH = 3, 20
"""IMU readings that read alike, of which each counts, and others that come after them."""
MOST = 20
"""Scans or frames that read alike, until two have been handed on."""
ALIKE = "alike"
"""The series of readings that read alike."""


def require_each_press(rig: SensorRig) -> None:
    """Fail unless the consumer also hands on events that bear the words of earlier ones."""
    path = rig.paths[STOP]
    for number in WORDS:
        rig.send_alone(STOP, PRESSES, number)
    rig.wait(lambda: len(path.handed.numbers(PRESSES)) >= len(WORDS))
    if (got := path.handed.numbers(PRESSES)) != list(WORDS):
        raise Failed(
            expected="A stop event is handled even if it bears the words of an earlier one, be it "
            "the one right before: one press of a button reads like another.",
            actual=f"{len(WORDS)} events came in, which read as pressed, released, pressed, "
            "pressed (at another button), released do. The driver published "
            f"{len(path.published.numbers(PRESSES))} of them, and your consumer handed on "
            f"{len(got)}{rig.error_note()}.",
        )


def require_same_again(rig: SensorRig, sensor: Sensor) -> None:
    """Fail unless a consumer that acts on the newest acts on one that reads like the last, too."""
    handed = rig.paths[sensor].handed
    if not rig.send_until(lambda: len(handed.numbers(ALIKE)) > 1, sensor, ALIKE, [0] * MOST):
        raise _left_out(rig, sensor, ALIKE)


def require_each_of_the_same(rig: SensorRig) -> None:
    """Fail unless the consumer hands on each of some IMU readings that read alike.

    Tried again if the machine took so long that a design may rightly have found them too old.
    """
    for attempt in range(TRIES):
        if _are_all_handed_on(rig, f"{ALIKE} {attempt}"):
            return
    raise too_busy(
        "tell IMU readings that were left out, as they read like the one before, from readings "
        "that had grown old"
    )


def _are_all_handed_on(rig: SensorRig, series: str) -> bool:
    """Return whether all came out, False if they may have been too old; fail if they were not.

    A consumer may take readings so many at a time: so others come after them.
    """
    path = rig.paths[IMU]
    began = time.monotonic()
    for _ in range(SAME):
        path.send(series, 0)
    rig.wait(lambda: len(path.published.numbers(series)) >= SAME)
    rig.wait_for_rest()
    is_aged = time.monotonic() - began > YOUNG_S
    later = f"{series}, later"
    if rig.send_until(lambda: len(path.handed.numbers(series)) >= SAME, IMU, later, range(BATCH)):
        return True
    if is_aged and len(path.published.numbers(series)) >= SAME:
        return False
    raise _left_out(rig, IMU, series)


def _left_out(rig: SensorRig, sensor: Sensor, series: str) -> Failed:
    path = rig.paths[sensor]
    sent, published, handed = (
        len(ends.numbers(series)) for ends in (path.sent, path.published, path.handed)
    )
    return Failed(
        expected=f"{sensor} readings are acted on even if they read like the one before: a "
        "robot that stands still has many of them.",
        actual=f"{sent} came in that differ in nothing but their stamps. The driver published "
        f"{published} of them on {sensor.topic}, and the consumer handed on "
        f"{handed or 'none'}{rig.error_note()}.",
    )
