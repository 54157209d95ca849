"""Exercise 1: QoS profiles for camera, LIDAR, IMU and emergency stop, judged by their effect.

Every bound below is a sentence of the task, so any design that keeps to the task passes: the
chapter's profiles, `qos_profile_sensor_data` for the sensors, deeper or shallower queues, one
profile for both sides or two, a transient-local stop.
"""

from __future__ import annotations

from collections.abc import Iterator

from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
from rclpy.topic_endpoint_info import TopicEndpointInfo

from autograder.examination.check_context import StudentError
from autograder.examination.exam import Exam, Failed, NotExaminable
from autograder.exercises.qos.backlog_checks import (
    altered_failure,
    require_burst,
    require_fresh,
    require_open_scans,
    require_whole,
)
from autograder.exercises.qos.backlogs import BURST
from autograder.exercises.qos.driver_latency import each_at_once
from autograder.exercises.qos.equal_readings import (
    require_each_of_the_same,
    require_same_again,
    require_told_apart,
)
from autograder.exercises.qos.late_joiner import require_no_past
from autograder.exercises.qos.packet_loss import Aftermath, radio_gap
from autograder.exercises.qos.readings import CAMERA, IMU, LIDAR, SENSORS, STOP, Sensor
from autograder.exercises.qos.rig import CONSUMERS, DRIVERS, SensorRig, sensor_rig
from autograder.exercises.qos.stop_events import (
    describe_fault,
    faulty_numbers,
    require_all_handled,
    require_all_heard,
    require_no_repeats,
    require_only_events,
)
from autograder.observe.qos_refusal import Refusal, find_refusal

EXAM: Exam[SensorRig] = Exam("qos", sensor_rig)

READ_RELIABILITY = "Chapter 5, “QoS profiles: reliability”"
READ_HISTORY = "Chapter 5, “QoS profiles: history”"
READ_DURABILITY = "Chapter 5, “QoS profiles: durability”"


@EXAM.check(
    hints=(
        "Run the cell with your classes again: does it end without an error?",
        "Try it beside the check: `course.run(SensorDrivers)`, then `course.run(SensorConsumers)`.",
        "Both classes must be there under these names, and every topic under its name and type.",
    ),
    read="Chapter 5, “Nodes: the processing units”",
)
def nodes_start(rig: SensorRig) -> None:
    """Both nodes start, with every topic in place.

    A robot whose driver does not come up has no eyes: everything else waits for this.
    """
    for name in (DRIVERS, CONSUMERS):
        try:
            rig.subject.start(name)
        except StudentError as error:
            raise Failed(
                expected=f"{name}() makes a node without an error.",
                actual=error.feedback_text,
            ) from None
        if name == DRIVERS:
            rig.have_stand_ins()
    faults: list[str] = []

    def all_there() -> bool:
        faults[:] = _endpoint_faults(rig)
        return not any(line.startswith("There is no") for line in faults)

    rig.wait(all_there)
    if faults:
        raise Failed(expected="Every topic of the task has its endpoint.", actual=" ".join(faults))


def _endpoint_faults(rig: SensorRig) -> Iterator[str]:
    """Yield what is missing, or has another type than the task says, a sentence each."""
    for sensor in SENSORS:
        ends = (
            ("subscription to", f"hardware/{sensor.name}", rig.find_subscriptions),
            ("publisher on", sensor.topic, rig.find_publishers),
            ("subscription to", sensor.topic, rig.find_subscriptions),
            ("publisher on", f"consumer/{sensor.name}", rig.find_publishers),
        )
        wanted = f"{sensor.type.__module__.split('.')[0]}/msg/{sensor.type.__name__}"
        for what, topic, endpoints in ends:
            types = {endpoint.topic_type for endpoint in endpoints(topic)}
            if not types:
                yield f"There is no {what} {topic}."
            elif wanted not in types:
                told = ", ".join(sorted(types))
                yield f"The {what} {topic} has type {told}, not {wanted}."


@EXAM.check(
    needs=("nodes_start",),
    hints=(
        "Compare what your publisher offers with what your subscription requests.",
        "A subscription may ask for less than is offered, never for more.",
        "BEST_EFFORT never satisfies a RELIABLE request, nor VOLATILE a TRANSIENT_LOCAL one.",
    ),
    read="Chapter 5, “Experiment 2: two ends that do not fit”",
)
def readings_flow(rig: SensorRig) -> None:
    """A reading of each sensor travels from the hardware to the consumer.

    Two incompatible profiles never connect, and nothing fails aloud: the robot is simply blind.
    """
    rig.listen_to_consumers()
    silent = rig.probe(SENSORS, rig.node.consumed, give_up=lambda s: _qos_refusals(rig, s))
    if silent:
        raise Failed(
            expected="Each of the four sensors' readings comes out at the consumer.",
            actual=_describe_silence(rig, silent),
        )
    rig.probe_stand_ins()
    rig.run_once(each_at_once)
    for sensor in SENSORS:
        if sensor.topic in rig.node.altered:
            raise altered_failure(sensor)
        if (target := f"consumer/{sensor.name}") in rig.node.blank:
            raise Failed(
                expected="The consumers hand on what they act on, not only its header.",
                actual=f"The {sensor.name} readings on {target} have a header and nothing else.",
            )


def _qos_refusals(rig: SensorRig, sensor: Sensor) -> list[Refusal]:
    """Return why DDS connects no driver to any consumer; empty if it does, or if there are none."""
    offers, requests = (
        [end.qos_profile for end in ends]
        for ends in (rig.find_publishers(sensor.topic), rig.find_subscriptions(sensor.topic))
    )
    found = [find_refusal(offered, requested) for offered in offers for requested in requests]
    reasons = [reason for reason in found if reason is not None]
    return reasons if len(reasons) == len(found) else []


def _describe_silence(rig: SensorRig, silent: list[Sensor]) -> str:
    """Return why these are silent. What a callback raised is told once, at the end."""
    refused_first = sorted(silent, key=lambda sensor: not _qos_refusals(rig, sensor))
    told = " ".join(_why_silent(rig, sensor) for sensor in refused_first)
    return f"{told.removesuffix('.')}{rig.error_note()}."


def _why_silent(rig: SensorRig, sensor: Sensor) -> str:
    if reasons := _qos_refusals(rig, sensor):
        why = reasons[0].as_sentence("your publisher", "your subscription", sensor.topic)
        return f"Nothing of {sensor.name} arrives: {why}"
    if not rig.node.witnessed[sensor.name]:
        if sensor.topic in rig.node.foreign:
            return _describe_change(sensor.topic, f"hardware/{sensor.name} delivered")
        return f"Nothing of {sensor.name} is published on {sensor.topic}."
    if (target := f"consumer/{sensor.name}") in rig.node.foreign:
        return _describe_change(target, f"{sensor.topic} carried")
    return f"{sensor.topic} carries readings, but none comes out on {target}."


def _describe_change(topic: str, what: str) -> str:
    return f"{topic} carries messages, but not what {what}: their content was changed."


@EXAM.check(
    needs=("readings_flow",),
    hints=(
        "What should happen to a camera frame that was lost on the way?",
        "A reliable link re-sends it, and holds back the newer frames until it is there.",
        "Make either side of camera/image BEST_EFFORT.",
    ),
    read=READ_RELIABILITY,
)
def camera_best_effort(rig: SensorRig) -> str:
    """A lost camera frame is gone; it never holds up newer ones.

    RELIABLE repairs a loss by sending the old frame again, in order: on Wi-Fi the picture freezes
    and then plays the past. A connection is reliable only if both sides ask for it.
    """
    offered, requested = rig.find_publishers(CAMERA.topic), rig.find_subscriptions(CAMERA.topic)
    if any(map(_is_reliable, offered)) and any(map(_is_reliable, requested)):
        raise Failed(
            expected="The link from driver to consumer on camera/image is best effort.",
            actual="The driver offers RELIABLE and the consumer requests it, so DDS re-sends.",
        )
    if any(map(_is_reliable, offered)):
        return "The driver offers RELIABLE, the consumer asks for less: the link is best effort."
    return "The price: a subscriber that insists on RELIABLE now receives no picture."


def _is_reliable(endpoint: TopicEndpointInfo) -> bool:
    return bool(endpoint.qos_profile.reliability == ReliabilityPolicy.RELIABLE)


@EXAM.check(
    needs=("readings_flow",),
    hints=(
        "Where do frames wait while the consumer is busy, and how many of them?",
        "The depth of the subscription's KEEP_LAST is the length of that queue.",
        f"KEEP_LAST with a depth of 1 to {CAMERA.most} keeps the picture live.",
    ),
    read=READ_HISTORY,
)
def camera_newest(rig: SensorRig) -> None:
    """After a pause the camera consumer goes on with the newest frames.

    A deep queue makes a slow reader live in the past: it works through old pictures while the
    robot drives on.
    """
    expected = f"After a pause at most the last {CAMERA.most} frames (1 s) are processed."
    require_fresh(rig, CAMERA, expected)
    require_same_again(rig, CAMERA)


@EXAM.check(
    needs=("readings_flow",),
    hints=(
        "How old is the oldest scan in a queue of depth 10, at 10 Hz?",
        "Obstacle avoidance needs the latest scan; a few more do no harm.",
        f"KEEP_LAST with depth 1 gives the latest scan only; up to {LIDAR.most} are accepted.",
    ),
    read=READ_HISTORY,
)
def lidar_fresh(rig: SensorRig) -> str:
    """After a pause obstacle avoidance acts on fresh scans only.

    An old scan shows obstacles where they were: at 1 m/s half a second is half a metre.
    """
    expected = f"After a pause no scan older than 0.5 s (the last {LIDAR.most}) is acted on."
    require_fresh(rig, LIDAR, expected)
    require_open_scans(rig)
    require_same_again(rig, LIDAR)
    return _describe_practice(rig, LIDAR)


def _describe_practice(rig: SensorRig, sensor: Sensor) -> str:
    if all(map(_is_reliable, rig.find_publishers(sensor.topic))):
        return (
            "RELIABLE is the chapter's answer. Many drivers in the field publish best effort "
            "(SensorDataQoS) instead; both are right here."
        )
    return (
        "Best effort is what many drivers in the field do (SensorDataQoS); the chapter's answer is "
        "RELIABLE. Both are right here, but a subscriber that insists on RELIABLE hears nothing."
    )


@EXAM.check(
    needs=("readings_flow",),
    hints=(
        "Count how many readings come in while the consumer is busy for 50 ms, at 100 Hz.",
        "A queue that is too short drops part of the burst; an endless one replays the past.",
        f"KEEP_LAST with a depth of {BURST} to {IMU.most} fits; the chapter takes 10.",
    ),
    read=READ_HISTORY,
)
def imu_burst(rig: SensorRig) -> str:
    """A short burst of IMU readings is kept, a long past is not.

    State estimation integrates: each reading that is missing is an angle that is wrong. But a
    controller that works through seconds of old readings steers by the past.
    """
    expected = (
        f"All {BURST} readings of a pause of 50 ms are processed once, and after a longer one "
        f"at most the last {IMU.most} (0.5 s)."
    )
    try:
        require_fresh(rig, IMU, expected)
    except NotExaminable:
        require_burst(rig, expected)  # what it does lose is seen on a busy machine, too
        raise
    require_burst(rig, expected)
    require_whole(rig)
    require_each_of_the_same(rig)
    return _describe_practice(rig, IMU)


@EXAM.check(
    needs=("readings_flow",),
    hints=(
        "Which consumers can connect to a BEST_EFFORT publisher, and which cannot?",
        "What a publisher offers must be at least what the most demanding subscriber requests.",
        "Offer RELIABLE on emergency/stop, and request it in your consumer too.",
    ),
    read=READ_RELIABILITY,
)
def stop_reaches_all(rig: SensorRig) -> None:
    """An emergency stop reaches every consumer, whichever reliability it asks for.

    A safety node asks for RELIABLE, a logger on Wi-Fi perhaps for BEST_EFFORT: neither may miss a
    stop. Only a RELIABLE offer serves both.
    """
    offers_all = all(map(_is_reliable, rig.find_publishers(STOP.topic)))
    with rig.node.temporary_listeners():
        listeners = require_all_heard(rig, give_up=not offers_all)
        require_no_repeats(rig, listeners)
    require_only_events(rig, STOP.topic)
    if not any(map(_is_reliable, rig.find_subscriptions(STOP.topic))):
        raise Failed(
            expected="Your own consumer cannot lose a stop on a bad network either.",
            actual="It requests BEST_EFFORT, so DDS does not repair a lost event for it.",
        )


@EXAM.check(
    needs=("stop_reaches_all",),
    hints=(
        "Which stop events are left if the consumer was busy while many came in?",
        "KEEP_LAST(depth) throws the oldest away as soon as more than `depth` are waiting.",
        "KEEP_ALL, or a depth of 100 as in the task, keeps every event.",
    ),
    read=READ_HISTORY,
)
def stop_complete(rig: SensorRig) -> str:
    """Every stop event is kept, in order, even while the consumer is busy.

    Pressed, released, pressed again: whoever sees only the last event does not know what happened.
    """
    if rig.can_expire(STOP):  # the cause of what may be lost: first
        raise Failed(
            expected="A stop event waits for a busy consumer as long as it must.",
            actual="A lifespan on emergency/stop throws events away when they get old.",
        )
    require_all_handled(rig)
    require_told_apart(rig)
    if STOP.topic not in rig.node.foreign:  # else it only passes on what another check has found
        require_only_events(rig, f"consumer/{STOP.name}")
    durable = any(
        e.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
        for e in rig.find_publishers(STOP.topic)
    )
    return "TRANSIENT_LOCAL also tells a node that starts late: well thought." if durable else ""


@EXAM.check(
    needs=("readings_flow",),
    hints=(
        "What does a node that starts late receive from a TRANSIENT_LOCAL publisher?",
        "A map or a parameter is still true a minute later. Is a camera frame?",
        "VOLATILE for camera, LIDAR and IMU.",
    ),
    read=READ_DURABILITY,
)
def late_joiner(rig: SensorRig) -> None:
    """A node that starts late does not act on old camera, LIDAR or IMU data.

    A planner that restarts in mid-drive must not take a scan from before for the present.
    """
    require_no_past(rig, (CAMERA, LIDAR, IMU))


_UNHEARD = "A consumer at the far end of the link heard nothing, not even before the gap."


def _after_gap(rig: SensorRig, sensor: Sensor) -> Aftermath:
    found: dict[str, Aftermath] = rig.run_once(radio_gap)
    return found[sensor.name]


@EXAM.check(
    needs=("stop_reaches_all",),
    hints=(
        "Who still has an event that a consumer out of radio range did not get?",
        "RELIABLE sends again what the publisher still has: KEEP_LAST(depth) keeps `depth` of it.",
        "Give the publisher KEEP_ALL, or a depth of 100, not only the subscription.",
    ),
    read=READ_HISTORY,
)
def stop_repaired(rig: SensorRig) -> None:
    """A consumer that was out of radio range gets every stop event it missed.

    RELIABLE alone does not promise it: DDS can send again only what the publisher has kept.
    """
    found = _after_gap(rig, STOP)
    got = found.heard
    if got != list(range(found.count)):
        raise Failed(
            expected=f"After a gap in the radio link all {found.count} stop events of the gap "
            "arrive, in order.",
            actual=_UNHEARD
            if got is None
            else f"{describe_fault(got, found.count)}: it got {faulty_numbers(got, found.count)}.",
        )


@EXAM.check(
    needs=("readings_flow",),
    hints=(
        "What does a RELIABLE link do with the frames of the gap when it is up again?",
        "It sends them again, oldest first, and the live picture has to wait for them.",
        "Make either side of camera/image BEST_EFFORT: then a frame that is lost stays lost.",
    ),
    read=READ_RELIABILITY,
)
def camera_moves_on(rig: SensorRig) -> None:
    """After a gap in the radio link the camera goes on with the live picture.

    Frames of the past are of no use to who drives by the picture, and they cost the bandwidth that
    the link has just got back.
    """
    found = _after_gap(rig, CAMERA)
    expected = "After a gap in the radio link the next frame arrives, and none from the gap."
    if found.heard is None:
        raise Failed(expected=expected, actual=_UNHEARD)
    if not found.heard or found.heard[-1] != found.count:
        raise Failed(expected=expected, actual="The next frame did not arrive.")
    if old := [number for number in found.heard if number < found.count - 1]:
        frames = "A frame that was" if len(old) == 1 else f"{len(old)} frames that were"
        sent = "was" if len(old) == 1 else "were"
        raise Failed(
            expected=expected,
            actual=f"{frames} lost in the gap {sent} sent again before it.",
        )
