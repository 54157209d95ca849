"""What becomes of stop events at consumers that differ in what they ask for and when they join."""

from __future__ import annotations

from rclpy.duration import Duration
from rclpy.qos import QoSProfile

from autograder.examination.exam import Failed
from autograder.exercises.qos.equal_readings import PRESSES
from autograder.exercises.qos.readings import DRIVERS, STOP, SensorRig
from autograder.exercises.qos.slow_consumer import require_backlog
from autograder.observe.patience import SETTLE_S
from autograder.observe.relays.arrivals import Arrivals
from autograder.observe.relays.endpoint_qos import lossless_profile, undemanding_profile
from autograder.observe.relays.message_stream import LAG_S
from autograder.observe.relays.sequence_faults import (
    describe_fault,
    faulty_numbers,
    numbers_phrase,
    repeated_numbers,
)

QUEUED = 4
"""Events that a driver which is busy for a moment has to find."""
EVENTS = QUEUED + 1
SERIES = "event"


def require_heard_by_all(rig: SensorRig) -> None:
    """Fail unless a RELIABLE and a BEST_EFFORT consumer hear all events, each once.

    Also when one more consumer joins later.
    """
    before = set(rig.node.subscriptions)
    try:
        listeners = [
            _join(rig, "RELIABLE", lossless_profile()),
            _join(rig, "BEST_EFFORT", undemanding_profile()),
        ]
        _require_all_heard(rig, listeners)
        _require_no_repeats(rig, listeners)
    finally:  # or they would cost everybody's time until the end of the exam
        for guest in set(rig.node.subscriptions) - before:
            rig.node.destroy_subscription(guest)


def _join(rig: SensorRig, who: str, profile: QoSProfile) -> Arrivals:
    """Return what a new consumer hears of the stop events.

    One that hears nothing gets a second chance, unless it is clear why: that one endpoint of ours
    stayed deaf would say nothing about the student's.
    """
    offers_all = rig.paths[STOP].find_ends().is_offered_reliably
    for _ in range(2 if offers_all else 1):
        heard = Arrivals()
        rig.paths[STOP].listen(STOP.topic, profile, heard)
        if not rig.probe({STOP: heard}, give_up=lambda _: not offers_all):
            return heard
    raise Failed(
        expected="A consumer that asks for RELIABLE and one for BEST_EFFORT both hear it.",
        actual=f"A consumer that asks for {who} heard nothing on {STOP.topic}, "
        f"{rig.describe_probes(STOP)}{rig.error_note()}.",
    )


def _require_all_heard(rig: SensorRig, listeners: list[Arrivals]) -> None:
    """Fail unless all events are heard, of which all but the last come while the driver is busy.

    How many of a few quick ones wait in its queue would otherwise be a matter of chance.
    """
    path = rig.paths[STOP]
    with rig.keep_busy(DRIVERS):
        for number in range(QUEUED):
            path.send(SERIES, number)
        path.source.wait_for_all_acked(Duration(seconds=SETTLE_S))
    rig.wait_for_relay(STOP, SERIES, QUEUED - 1, LAG_S)
    path.send(SERIES, QUEUED)
    if rig.wait_for_relay(STOP, SERIES, QUEUED):  # else there is nothing left to wait for
        rig.wait(lambda: all(len(heard.numbers(SERIES)) >= EVENTS for heard in listeners))
    published = {n for heard in (path.published, *listeners) for n in heard.numbers(SERIES)}
    for heard in listeners:
        if (got := heard.numbers(SERIES)) != list(range(EVENTS)):
            raise Failed(
                expected=f"{EVENTS} stops arrive as {EVENTS} stops, in order.",
                actual=f"A consumer heard {numbers_phrase(got, 'reading')}."
                if len(published) == EVENTS
                else f"Of {EVENTS} that came in, the driver published {len(published)} on "
                f"{STOP.topic}. {QUEUED} had come in while it was busy: how many does its own "
                "queue hold, or does it skip some?",
            )


def _require_no_repeats(rig: SensorRig, listeners: list[Arrivals]) -> None:
    """Fail if an event of before comes again, at any that were there, when one more joins."""
    late = _join(rig, "RELIABLE", lossless_profile())
    path = rig.paths[STOP]
    there = [*listeners, path.published, path.handed]
    # The late one hears the first after the driver has found it, so what the driver then does comes
    # before the second. All hear in order: who has heard what comes after that has heard it, too.
    for heard in (late, *there):
        if rig.probe({STOP: heard}):
            raise Failed(
                expected="Every consumer hears the stops that come after it joined.",
                actual=f"When one more had joined, one heard nothing on {STOP.topic} any more, "
                f"{rig.describe_probes(STOP)}.",
            )
    for heard in there:
        again = len(repeated_numbers(heard.numbers(SERIES)))
        if again and heard is path.handed:  # the last: on the topic none was
            raise Failed(
                expected="Your consumer hands on each stop event once.",
                actual=f"{again} of {EVENTS} went over {STOP.topic} once, and came out on "
                f"{STOP.output} more than once.",
            )
        if again:
            raise Failed(
                expected="Each stop event is handed out once, whoever joins later.",
                actual=f"An event is repeated: when one more consumer joined, {again} of {EVENTS} "
                "came again where they had been heard before. A consumer would brake again for an "
                "event that is over.",
            )


def require_all_handled(rig: SensorRig) -> None:
    """Fail unless the consumer handles all events of a pause, once and in order, and none later."""
    found = require_backlog(rig, STOP)
    # Whether one that comes again is among those of the pause is a matter of the machine's speed.
    of_all = rig.paths[STOP].handed.count_repeated(but=[PRESSES])
    again = len(repeated_numbers(found.kept)) or of_all
    if again and len(set(found.kept)) == found.count:
        raise Failed(
            expected="Each stop event is handled once.",
            actual=f"{again} came out on {STOP.output} more than once, though no new event bore "
            "these words. Whoever listens there brakes again.",
        )
    if found.kept != list(range(found.count)):
        raise Failed(
            expected=f"All {found.count} events of the pause are handled, once and in order.",
            actual=f"{describe_fault(found.kept, found.count)}: the consumer handled "
            f"{faulty_numbers(found.kept, found.count, 'reading')}{rig.error_note()}.",
        )


def require_only_events(rig: SensorRig, topic: str) -> None:
    """Fail if something else than stop events was heard on ``topic``."""
    if topic in rig.paths[STOP].foreign:
        raise Failed(
            expected=f"Nothing but stop events comes on {topic}.",
            actual=f"Messages came that {STOP.source} did not deliver. Whoever hears one takes "
            "it for a press of the button.",
        )
