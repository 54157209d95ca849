"""What is required of what is left for a consumer that was busy for a while."""

from __future__ import annotations

from autograder.examination.exam import Failed, NotExaminable
from autograder.exercises.qos.backlogs import BURST, Backlog, Burst
from autograder.exercises.qos.driver_latency import find_thinning
from autograder.exercises.qos.readings import IMU, LIDAR, STOP, Sensor, is_open
from autograder.exercises.qos.rig import SensorRig
from autograder.exercises.qos.slow_reader import EVENTS, LONGEST, busy_consumer, short_pause

OPEN_SCANS = 10  # scans that are sent until the consumer hands one on


def check_backlog(rig: SensorRig, sensor: Sensor) -> Backlog:
    """Return what became of one sensor's readings.

    Fail if the driver keeps readings back, or if the consumer cannot be held back.
    """
    backlogs: dict[str, Backlog] = rig.run_once(busy_consumer)
    found = backlogs[sensor.name]
    if found.early and not rig.can_hold:
        raise NotExaminable(
            "Your consumer went on while its callbacks were held back: a thread or an executor of "
            "its own does its work, and that cannot be held back here, only where your work is "
            "graded in the sandbox."
        )
    if found.early:
        raise Failed(
            expected="While none of its threads runs, your consumer hands nothing on.",
            actual="It went on: does a thread bear a name that those of DDS have?",
        )
    if found.altered or sensor.topic in rig.node.altered:
        raise altered_failure(sensor)
    if found.is_withheld:
        raise _withheld_failure(rig, sensor, found.count, found.published)
    if fewer := find_thinning(rig, sensor):
        raise _withheld_failure(rig, sensor, *fewer)
    if sensor is STOP and found.count < EVENTS:
        raise NotExaminable(
            f"In {LONGEST} s only {found.count} stop events got through the driver, each sent when "
            "the one before was out: this machine was too busy, or the driver takes its time. "
            "After a hand-in a person looks at it."
        )
    return found


def altered_failure(sensor: Sensor) -> Failed:
    """Return that a driver changed a sensor's readings."""
    return Failed(
        expected="The drivers publish each reading with its content unchanged.",
        actual=f"The {sensor.name} readings on {sensor.topic} are not what "
        f"hardware/{sensor.name} delivered: something in the message was changed or left out.",
    )


def _withheld_failure(rig: SensorRig, sensor: Sensor, came: int, went: int) -> Failed:
    return Failed(
        expected=f"The driver publishes each {sensor.name} reading as it comes in.",
        actual=f"Of {came} that came in, {went} went over {sensor.topic}{rig.error_note()}.",
    )


def require_fresh(rig: SensorRig, sensor: Sensor, expected: str) -> None:
    """Fail unless the consumer goes on with the newest after a long pause, and keeps up then."""
    found = check_backlog(rig, sensor)
    kept, behind = found.kept, found.behind
    if found.is_unfinished:
        actual = (
            f"Of {found.count} readings in a pause the newest never came out: it got "
            f"{readings_phrase(kept)}{rig.error_note()}."
        )
    elif found.is_stale:
        actual = f"It then worked through the last {found.replayed} of {found.published} readings."
    elif found.is_disordered:
        actual = f"It passed them on out of order: {readings_phrase(kept)}."
    elif behind is not None and behind.is_undecided:
        raise NotExaminable(
            f"This machine was too busy to bring {sensor.name} readings at {sensor.rate:.0f} Hz, "
            "and so to see whether your consumer keeps up with them. After a hand-in a person "
            "looks at it."
        )
    elif behind is not None:
        actual = behind.describe_lag(sensor)
    else:
        return
    raise Failed(expected=expected, actual=actual)


def require_burst(rig: SensorRig, expected: str) -> None:
    """Fail unless the consumer passes on every IMU reading of a short pause, in order."""
    found: Burst = rig.run_once(short_pause)
    if found.missing_count and found.published < BURST:
        raise _withheld_failure(rig, IMU, BURST, found.published)
    if found.missing_count and found.aged:
        raise NotExaminable(
            "This machine was too busy to tell a short queue from readings that had grown old. "
            "After a hand-in a person looks at it."
        )
    if found.missing_count:
        passed = BURST - found.missing_count
        oldest = bool(passed) and set(found.kept) == set(range(found.missing_count, BURST))
        actual = (
            f"Of {BURST} readings that came in while it was busy "
            f"{lost_phrase(found.missing_count, oldest=oldest)}, {passed or 'none'} "
            f"{'were' if passed > 1 else 'was'} passed on{rig.error_note()}."
        )
    elif len(found.kept) > BURST:
        actual = (
            f"It passed on {BURST} readings as {len(found.kept)}: some came out more than once, "
            "and an estimator that adds them up turns too far."
        )
    elif found.kept != sorted(found.kept):
        actual = f"It passed them on out of order: {readings_phrase(found.kept)}."
    else:
        return
    raise Failed(expected=expected, actual=actual)


def require_whole(rig: SensorRig) -> None:
    """Fail if the consumer leaves out IMU readings again and again while they come in."""
    if (omits := check_backlog(rig, IMU).omits) is not None:
        raise Failed(
            expected="While readings come in, the consumer hands on each of them, once.",
            actual=omits.describe_omission(),
        )


def require_open_scans(rig: SensorRig) -> None:
    """Fail if the consumer leaves out scans with beams that have no echo."""
    phase = "open"
    numbers = [number for number in range(2 * OPEN_SCANS) if is_open(number)]

    def came() -> bool:
        return bool(rig.consumed_indices(LIDAR, phase))

    for number in numbers:
        rig.node.publish(LIDAR, phase, number)
        if rig.wait(came, 1 / LIDAR.rate):
            return
    if not rig.wait(came):
        passed = len(set(rig.witnessed_indices(LIDAR, phase)))
        raise Failed(
            expected="Scans with beams that have no echo (inf, or nan) are acted on, too: nearly "
            "every scan has some.",
            actual=f"Of {len(numbers)} such scans the driver published {passed}, and the consumer "
            f"handed on none{rig.error_note()}.",
        )


def lost_phrase(number: int, of: int = 0, *, oldest: bool = False) -> str:
    """Return a phrase such as "1 was lost", or "2 of 7 were lost".

    ``oldest`` says that these were the ones that had waited longest.
    """
    was = "was" if number == 1 else "were"
    if oldest:
        return f"the {'one' if number == 1 else number} that had waited longest {was} lost"
    return f"{number}{f' of {of}' if of else ''} {was} lost"


def readings_phrase(numbers: list[int]) -> str:
    """Return the first of some reading numbers, as a phrase that counts from 1, as people do."""
    if not numbers:
        return "nothing at all"
    shown = ", ".join(str(number + 1) for number in numbers[:6])
    some = "reading" if len(numbers) == 1 else "readings"
    return f"{some} {shown}{' …' if len(numbers) > 6 else ''}"
