"""Readings that read like the one before, as those of a robot that stands still do.

Each is a reading of its own: it has its own stamp, and one press of a button reads like another.
Whoever leaves out what reads alike, to be sure that none comes twice, loses some.
"""

from __future__ import annotations

import time

from autograder.examination.exam import Failed, NotExaminable
from autograder.exercises.qos.readings import IMU, STOP, Sensor
from autograder.exercises.qos.rig import PRESSES, SensorRig
from autograder.exercises.qos.sensor_examiner import LAG
from autograder.exercises.qos.slow_reader import TRIES, YOUNG

WORDS = (0, 1, 0, 0, 1)
"""Events that bear the same words again: pressed, released, pressed, pressed (at another button),
released."""
SAME = 3  # IMU readings that read alike, of which each counts
BATCH = 20  # others that come after them: a consumer may take readings so many at a time
MOST = 20  # scans or frames that read alike, until two have been handed on
_PHASE = "alike"


def require_told_apart(rig: SensorRig) -> None:
    """Fail unless the consumer also hands on events that bear the words of earlier ones."""
    for sent, number in enumerate(WORDS, 1):
        rig.node.publish(STOP, PRESSES, number)
        # Of stop events only one is ever on its way into a driver.
        rig.wait(lambda n=sent: len(rig.witnessed_indices(STOP, PRESSES)) >= n, LAG)  # type: ignore[misc]
    rig.wait(lambda: len(rig.consumed_indices(STOP, PRESSES)) >= len(WORDS))
    if (got := rig.consumed_indices(STOP, PRESSES)) != list(WORDS):
        raise Failed(
            expected="A stop event is handled even if it bears the words of an earlier one, be it "
            "the one right before: one press of a button reads like another.",
            actual=f"{len(WORDS)} events came in, which read as pressed, released, pressed, "
            "pressed (at another button), released do. The driver published "
            f"{len(rig.witnessed_indices(STOP, PRESSES))} of them, and your consumer handed on "
            f"{len(got)}{rig.error_note()}.",
        )


def require_same_again(rig: SensorRig, sensor: Sensor) -> None:
    """Fail unless a consumer that acts on the newest acts on one that reads like the last, too."""

    def again() -> bool:
        return len(rig.consumed_indices(sensor, _PHASE)) > 1

    for _ in range(MOST):
        rig.node.publish(sensor, _PHASE, 0)
        if rig.wait(again, 1 / sensor.rate):
            return
    if not rig.wait(again):
        raise _left_out(rig, sensor, 0, MOST)


def require_each_of_the_same(rig: SensorRig) -> None:
    """Fail unless the consumer hands on each of some IMU readings that read alike.

    Tried again if the machine took so long that a design may rightly have found them too old.
    """
    for number in range(TRIES):
        began = time.time_ns()
        for _ in range(SAME):
            rig.node.publish(IMU, _PHASE, number)
        rig.wait(lambda n=number: rig.witnessed_indices(IMU, _PHASE).count(n) >= SAME)  # type: ignore[misc]
        rig.wait_for_rest()
        aged = time.time_ns() - began > YOUNG * 1e9
        if _all_out(rig, number):
            return
        if not aged or rig.witnessed_indices(IMU, _PHASE).count(number) < SAME:
            raise _left_out(rig, IMU, number, SAME)
    raise NotExaminable(
        "This machine was too busy to tell IMU readings that were left out, as they read like the "
        "one before, from readings that had grown old. After a hand-in a person looks at it."
    )


def _all_out(rig: SensorRig, number: int) -> bool:
    """Return whether all that read alike come out; who takes readings in batches is given more."""

    def out() -> bool:
        return rig.consumed_indices(IMU, _PHASE).count(number) >= SAME

    for later in range(BATCH):
        if rig.wait(out, 1 / IMU.rate):
            return True
        rig.node.publish(IMU, f"{_PHASE}, later", number * BATCH + later)
    return rig.wait(out)


def _left_out(rig: SensorRig, sensor: Sensor, number: int, sent: int) -> Failed:
    published = rig.witnessed_indices(sensor, _PHASE).count(number)
    handed = rig.consumed_indices(sensor, _PHASE).count(number)
    return Failed(
        expected=f"{sensor.name} readings are acted on even if they read like the one before: a "
        "robot that stands still has many of them.",
        actual=f"{sent} came in that differ in nothing but their stamps. The driver published "
        f"{published} of them on {sensor.topic}, and the consumer handed on "
        f"{handed or 'none'}{rig.error_note()}.",
    )
