"""What becomes of stop events at consumers that differ in what they ask for and when they join."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

from rclpy.duration import Duration
from rclpy.qos import QoSProfile

from autograder.examination.exam import Failed
from autograder.exercises.qos.backlog_checks import check_backlog, lost_phrase, readings_phrase
from autograder.exercises.qos.readings import STOP, Heard
from autograder.exercises.qos.rig import DRIVERS, SensorRig
from autograder.exercises.qos.sensor_examiner import LAG, lossless_profile, undemanding_profile
from autograder.observe.patience import SETTLE_S

EVENTS = 5


def require_all_heard(rig: SensorRig, *, give_up: bool) -> Sequence[Heard]:
    """Fail unless a RELIABLE and a BEST_EFFORT consumer hear all events; return what they hear.

    ``give_up`` says that to wait for a silent one is pointless.
    """
    listeners = []
    for who, profile in (("RELIABLE", lossless_profile()), ("BEST_EFFORT", undemanding_profile())):
        if (found := _add_listener(rig, profile, give_up=give_up)) is None:
            raise Failed(
                expected="A consumer that asks for RELIABLE and one for BEST_EFFORT both hear it.",
                actual=f"A consumer that asks for {who} heard nothing on {STOP.topic}, "
                f"{rig.describe_probes(STOP)}{rig.error_note()}.",
            )
        listeners.append(found)
    took = _send_events(rig)
    for heard in listeners if took else ():  # else there is nothing left to wait for
        rig.wait(lambda h=heard: len(rig.heard_indices(h, STOP, "event")) >= EVENTS)  # type: ignore[misc]
    published = {
        number
        for heard in (rig.node.witnessed, *listeners)
        for number in rig.heard_indices(heard, STOP, "event")
    }
    for heard in listeners:
        if (got := rig.heard_indices(heard, STOP, "event")) != list(range(EVENTS)):
            raise Failed(
                expected=f"{EVENTS} stops arrive as {EVENTS} stops, in order.",
                actual=f"A consumer heard {readings_phrase(got)}."
                if len(published) == EVENTS
                else f"Of {EVENTS} that came in, the driver published {len(published)} on "
                f"{STOP.topic}. {EVENTS - 1} had come in while it was busy: how many does its own "
                "queue hold, or does it skip some?",
            )
    return listeners


def _add_listener(rig: SensorRig, profile: QoSProfile, *, give_up: bool = False) -> Heard | None:
    """Return what a new consumer hears of the stop events, None if it hears nothing.

    Who hears nothing at once gets a second chance: that one endpoint of ours stayed deaf would say
    nothing about the student's.
    """
    for _ in range(1 if give_up else 2):
        heard: Heard = defaultdict(list)
        rig.node.listen(STOP, STOP.topic, profile, heard)
        if not rig.probe([STOP], heard, give_up=lambda _: give_up):
            return heard
    return None


def _send_events(rig: SensorRig) -> bool:
    """Send the events, all but the last while the driver is busy; return whether it took the last.

    How many of a few quick ones wait in its queue would otherwise be a matter of chance.
    """
    with rig.keep_busy(DRIVERS):
        for index in range(EVENTS - 1):
            rig.node.publish(STOP, "event", index)
        rig.node.hardware[STOP.name].wait_for_all_acked(Duration(seconds=SETTLE_S))
    rig.wait(lambda: rig.is_taken(STOP, "event", EVENTS - 2), LAG)
    rig.node.publish(STOP, "event", EVENTS - 1)
    return rig.wait(lambda: rig.is_taken(STOP, "event", EVENTS - 1))


def require_no_repeats(rig: SensorRig, listeners: Sequence[Heard]) -> None:
    """Fail if an event of before comes again, at any that were there, when one more joins."""
    late = _add_listener(rig, lossless_profile())
    there = (*listeners, rig.node.witnessed, rig.node.consumed)
    # The late one hears the first after the driver has found it, so what the driver then does comes
    # before the second. All hear in order: who has heard what comes after that has heard it, too.
    for heard in (late, *there):
        if heard is None or rig.probe([STOP], heard):
            raise Failed(
                expected="Every consumer hears the stops that come after it joined.",
                actual=f"When one more had joined, one heard nothing on {STOP.topic} any more, "
                f"{rig.describe_probes(STOP)}.",
            )
    for heard in there:
        if again := _repeated_numbers(rig.heard_indices(heard, STOP, "event")):
            if heard is rig.node.consumed:  # the last: on the topic none was
                raise Failed(
                    expected="Your consumer hands on each stop event once.",
                    actual=f"{len(again)} of {EVENTS} went over {STOP.topic} once, and came out on "
                    f"consumer/{STOP.name} more than once.",
                )
            raise Failed(
                expected="Each stop event is handed out once, whoever joins later.",
                actual=f"An event is repeated: when one more consumer joined, {len(again)} of "
                f"{EVENTS} came again where they had been heard before. A consumer would brake "
                "again for an event that is over.",
            )


def require_all_handled(rig: SensorRig) -> None:
    """Fail unless the consumer handles all events of a pause, once and in order, and none later."""
    found = check_backlog(rig, STOP)
    count, kept = found.count, found.kept
    # Whether one that comes again is among those of the pause is a matter of the machine's speed.
    again = len(_repeated_numbers(kept)) or found.again or rig.comes_again()
    if again and len(set(kept)) == count:
        raise Failed(
            expected="Each stop event is handled once.",
            actual=f"{again} came out on consumer/{STOP.name} more than once, though no new event "
            "bore these words. Whoever listens there brakes again.",
        )
    if kept != list(range(count)):
        raise Failed(
            expected=f"All {count} events of the pause are handled, once and in order.",
            actual=f"{describe_fault(kept, count)}: the consumer handled "
            f"{faulty_numbers(kept, count)}{rig.error_note()}.",
        )


def require_only_events(rig: SensorRig, topic: str) -> None:
    """Fail if something else than stop events was heard on ``topic``."""
    if topic in rig.node.foreign:
        raise Failed(
            expected=f"Nothing but stop events comes on {topic}.",
            actual="Messages came that hardware/emergency_stop did not deliver. Whoever hears one "
            "takes it for a press of the button.",
        )


def describe_fault(got: list[int], count: int) -> str:
    """Return what is wrong with ``got``, which is not 0 to ``count - 1`` in order, as a phrase."""
    if missing := count - len(set(got)):
        return lost_phrase(missing, count)
    if again := _repeated_numbers(got):
        return f"{len(again)} of {count} came more than once"
    return "Some came out of order"


def faulty_numbers(got: list[int], count: int) -> str:
    """Return the numbers from one before the first that is out of place on, as a phrase.

    Or that those from the first on are there, and then no more up to ``count``.
    """
    first = next((place for place, number in enumerate(got) if number != place), len(got))
    if got and first == len(got) < count:
        return f"only the first {first} of them" if first > 1 else "only the first of them"
    return readings_phrase(got[max(0, first - 1) :])


def _repeated_numbers(numbers: list[int]) -> set[int]:
    return {number for number in numbers if numbers.count(number) > 1}
