"""Exercise 1: QoS profiles for camera, LIDAR, IMU and emergency stop, judged by their effect.

Every bound below stands in the task's fine print, so any design that keeps to the task passes: the
chapter's profiles, `qos_profile_sensor_data` for the sensors, deeper or shallower queues, one
profile for both sides or two, a transient-local stop.
"""

from __future__ import annotations

from autograder.examination.exam import Exam, Failed, NotExaminable
from autograder.exercises.qos.equal_readings import (
    require_each_of_the_same,
    require_each_press,
    require_same_again,
)
from autograder.exercises.qos.radio_gap import LOST, lose_readings, require_heard
from autograder.exercises.qos.readings import (
    CAMERA,
    CONSUMERS,
    DRIVERS,
    IMU,
    LIDAR,
    SENSORS,
    STOP,
    Sensor,
    SensorRig,
)
from autograder.exercises.qos.single_readings import require_published_at_once, require_unaltered
from autograder.exercises.qos.slow_consumer import (
    BURST,
    require_burst,
    require_fresh,
    require_none_left_out,
)
from autograder.exercises.qos.stop_events import (
    require_all_handled,
    require_heard_by_all,
    require_only_events,
)
from autograder.observe import Topic
from autograder.observe.relays.endpoint_qos import is_reliable, require_endpoints
from autograder.observe.relays.late_joiner import hear_past
from autograder.observe.relays.observed_relays import relays_of
from autograder.observe.relays.sequence_faults import describe_fault, faulty_numbers

EXAM: Exam[SensorRig] = Exam("qos", relays_of(SENSORS, consumer=CONSUMERS))

OPEN_SCANS = range(1, 20, 2)
"""Scans with beams that have no echo, which are sent until the consumer hands one on."""
PAST = 5
"""Readings of each sensor before somebody joins late."""

READ_RELIABILITY = "Chapter 5, “QoS profiles: reliability”"
READ_HISTORY = "Chapter 5, “QoS profiles: history”"
READ_DURABILITY = "Chapter 5, “QoS profiles: durability”"


@EXAM.check(
    hints=(
        "Read what was observed: did a constructor raise, or is a topic missing?",
        "Try it beside the check: `course.run(SensorDrivers)`, then `course.run(SensorConsumers)`.",
        "Both classes must be there under these names, and every topic under its name and type.",
    ),
    read="Chapter 5, “Nodes: the processing units”",
)
def nodes_start(rig: SensorRig) -> None:
    """Both nodes start, with every topic in place.

    A robot whose driver does not come up has no eyes: everything else waits for this.
    """
    rig.start_node(DRIVERS)
    rig.have_stand_ins()
    rig.start_node(CONSUMERS)
    publishes = [Topic(name, s.type) for s in SENSORS for name in (s.topic, s.output)]
    subscribes = [Topic(name, s.type) for s in SENSORS for name in (s.source, s.topic)]
    require_endpoints(rig, rig.node, publishes=publishes, subscribes=subscribes)


def _check_flow(name: str, sensor: Sensor, readings: str) -> None:
    """Add a check of one sensor: what is wrong with it costs nothing of the others."""

    def flow(rig: SensorRig) -> None:
        path = rig.paths[sensor]
        rig.require_flow(sensor, f"The {sensor} readings come out at the consumer.")
        require_published_at_once(rig, sensor)
        require_unaltered(rig, sensor)
        if sensor.output in path.blank:
            raise Failed(
                expected="The consumers hand on what they act on, not only its header.",
                actual=f"The {sensor} readings on {sensor.output} have a header and nothing else.",
            )

    flow.__name__ = name
    flow.__doc__ = f"""{readings} travel from the hardware to the consumer.

    Two incompatible profiles never connect, and nothing fails aloud: the robot is simply blind.
    """
    EXAM.check(
        needs=("nodes_start",),
        hints=(
            "Follow one reading: does the driver publish it at once and unchanged, and does DDS "
            "connect the two ends?",
            "What comes late or changed was kept or changed in your driver's callback. What never "
            "comes: a subscription may ask for less than is offered, never for more.",
            "BEST_EFFORT never satisfies a RELIABLE request, nor VOLATILE a TRANSIENT_LOCAL one.",
        ),
        read="Chapter 5, “Experiment 2: two ends that do not fit”",
    )(flow)


_check_flow("camera_flows", CAMERA, "Camera frames")
_check_flow("lidar_flows", LIDAR, "Scans")
_check_flow("imu_flows", IMU, "IMU readings")
_check_flow("stop_flows", STOP, "Stop events")


@EXAM.check(
    needs=("camera_flows",),
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
    ends = rig.paths[CAMERA].find_ends()
    is_offered = any(map(is_reliable, ends.publishers))
    if is_offered and any(map(is_reliable, ends.subscriptions)):
        raise Failed(
            expected="The link from driver to consumer on camera/image is best effort.",
            actual="The driver offers RELIABLE and the consumer requests it, so DDS re-sends.",
        )
    if is_offered:
        return "The driver offers RELIABLE, the consumer asks for less: the link is best effort."
    return "The price: a subscriber that insists on RELIABLE now receives no picture."


@EXAM.check(
    needs=("camera_flows",),
    hints=(
        "Where do frames wait, or get lost, on their way to your consumer's output?",
        "They wait in the subscription's queue, as many as KEEP_LAST's depth, and in lists of your "
        "own; they are lost where a callback leaves some out.",
        f"KEEP_LAST with a depth of 1 to {CAMERA.most} keeps the picture live; a frame that looks "
        "like the last one is one, too.",
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
    needs=("lidar_flows",),
    hints=(
        "Where do scans wait, or get lost, on their way to your consumer's output?",
        "Obstacle avoidance needs the latest scan: a queue of depth 10 holds one that is 1 s old, "
        "at 10 Hz. And it needs each kind: with open beams, and like the one before.",
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
    _require_open_scans(rig)
    require_same_again(rig, LIDAR)
    return _describe_practice(rig, LIDAR)


def _require_open_scans(rig: SensorRig) -> None:
    path, series = rig.paths[LIDAR], "open"
    if not rig.send_until(lambda: path.handed.numbers(series), LIDAR, series, OPEN_SCANS):
        raise Failed(
            expected="Scans with beams that have no echo (inf, or nan) are acted on, too: nearly "
            "every scan has some.",
            actual=f"Of {len(OPEN_SCANS)} such scans the driver published "
            f"{len(path.published.first_times(series))}, and the consumer handed on none"
            f"{rig.error_note()}.",
        )


def _describe_practice(rig: SensorRig, sensor: Sensor) -> str:
    if rig.paths[sensor].find_ends().is_offered_reliably:
        return (
            "RELIABLE is the chapter's answer. Many drivers in the field publish best effort "
            "(SensorDataQoS) instead; both are right here."
        )
    return (
        "Best effort is what many drivers in the field do (SensorDataQoS); the chapter's answer is "
        "RELIABLE. Both are right here, but a subscriber that insists on RELIABLE hears nothing."
    )


@EXAM.check(
    needs=("imu_flows",),
    hints=(
        "Count what comes in at 100 Hz while the consumer is busy: what of it must come out?",
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
    require_none_left_out(rig)
    require_each_of_the_same(rig)
    return _describe_practice(rig, IMU)


@EXAM.check(
    needs=("stop_flows",),
    hints=(
        "Follow one press: does the driver publish it, once and nothing else, and who can listen?",
        "What a publisher offers must be at least what the most demanding subscriber requests; and "
        "the queue for the hardware must hold what comes in while the driver is busy.",
        "Offer RELIABLE on emergency/stop, and request it in your consumer too.",
    ),
    read=READ_RELIABILITY,
)
def stop_reaches_all(rig: SensorRig) -> None:
    """Every consumer can hear the emergency stop, and one that asks for RELIABLE misses none.

    A safety node asks for RELIABLE, a logger on Wi-Fi perhaps for BEST_EFFORT: DDS must connect
    both, and repair what is lost for the one that asks for it.
    """
    require_heard_by_all(rig)
    require_only_events(rig, STOP.topic)
    if not any(map(is_reliable, rig.paths[STOP].find_ends().subscriptions)):
        raise Failed(
            expected="Your own consumer cannot lose a stop on a bad network either.",
            actual="It requests BEST_EFFORT, so DDS does not repair a lost event for it.",
        )


@EXAM.check(
    needs=("stop_reaches_all",),
    hints=(
        "Compare what came in with what your consumer handed on: what is missing, or there twice?",
        "KEEP_LAST(depth) throws the oldest away as soon as more than `depth` are waiting, a "
        "lifespan what gets old, a comparison with the last event what reads alike.",
        "KEEP_ALL, or a depth of 100 as in the task, keeps every event: hand on each as it is.",
    ),
    read=READ_HISTORY,
)
def stop_complete(rig: SensorRig) -> str:
    """Every stop event is kept, in order, even while the consumer is busy.

    Pressed, released, pressed again: whoever sees only the last event does not know what happened.
    """
    ends = rig.paths[STOP].find_ends()
    if ends.can_expire:  # the cause of what may be lost: first
        raise Failed(
            expected="A stop event waits for a busy consumer as long as it must.",
            actual="A lifespan on emergency/stop throws events away when they get old.",
        )
    require_all_handled(rig)
    require_each_press(rig)
    if STOP.topic not in rig.paths[STOP].foreign:  # else it only passes on what was found there
        require_only_events(rig, STOP.output)
    told = "TRANSIENT_LOCAL also tells a node that starts late: well thought."
    return told if ends.is_offered_durably else ""


@EXAM.check(
    needs=("camera_flows", "lidar_flows", "imu_flows"),
    hints=(
        "Who hands an old reading to a node that starts late: DDS, or your driver itself?",
        "A map or a parameter is still true a minute later, and TRANSIENT_LOCAL keeps it. Is a "
        "camera frame?",
        "VOLATILE for camera, LIDAR and IMU, and a driver that publishes each reading once.",
    ),
    read=READ_DURABILITY,
)
def late_joiner(rig: SensorRig) -> None:
    """A node that starts late does not act on old camera, LIDAR or IMU data.

    A planner that restarts in mid-drive must not take a scan from before for the present.
    """
    sensors = (CAMERA, LIDAR, IMU)
    for sensor in sensors:
        rig.send_burst(sensor, "past", PAST)
    topics = [Topic(s.topic, s.type, value=rig.paths[s].find_mark) for s in sensors]
    for sensor, past in zip(sensors, hear_past(rig, rig.node, DRIVERS, topics), strict=True):
        expected = f"A late reader of {sensor.topic} gets new readings only"
        old = f"It was handed {sensor} readings from before it started"
        if past.plain:
            raise Failed(
                expected=f"{expected}.",
                actual=f"{old}, though it did not ask for any: does the driver publish a reading "
                "again?",
            )
        if past.asking:
            raise Failed(
                expected=f"{expected}, even if it asks for the past (TRANSIENT_LOCAL).",
                actual=f"{old}.",
            )


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
    expected = "After a gap in the radio link all {} stop events of the gap arrive, in order."
    count = LOST[STOP]
    got = require_heard(rig.run_once(lose_readings), STOP, expected.format(count))
    if got != list(range(count)):
        raise Failed(
            expected=expected.format(count),
            actual=f"{describe_fault(got, count)}: it got {faulty_numbers(got, count, 'reading')}.",
        )


@EXAM.check(
    needs=("camera_flows",),
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
    expected = "After a gap in the radio link the next frame arrives, and none from the gap."
    got = require_heard(rig.run_once(lose_readings), CAMERA, expected)
    if got[-1:] != [LOST[CAMERA]]:
        raise Failed(expected=expected, actual="The next frame did not arrive.")
    if old := len([number for number in got if number < LOST[CAMERA] - 1]):
        frames = "A frame that was" if old == 1 else f"{old} frames that were"
        sent = "was" if old == 1 else "were"
        raise Failed(
            expected=expected,
            actual=f"{frames} lost in the gap {sent} sent again before it.",
        )
