"""Exercise 3: which communication pattern fits, chosen and built; judged by use.

Every bound below is a sentence of the task. What is right in more than one way: the position as a
service or as a topic, a parameter of the node or a service of its own, a battery level that is
durable, published again and again, or told whoever joins. The key of the choices is not here: it
comes from the hidden cell.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager

from sensor_msgs.msg import BatteryState

from autograder.examination.check_context import StudentError
from autograder.examination.exam import Exam, Failed
from autograder.exercises.patterns import (
    camera_stream,
    choices,
    drive_ends,
    interface_patterns,
    odometry,
    plain_program_times,
    stations,
    unaffected_during_drive,
)
from autograder.exercises.patterns.discovery import LateJoiner, wait_for_arrival, wait_for_discovery
from autograder.exercises.patterns.driving import ACTIONS, SPEED_MARGIN, Drive
from autograder.exercises.patterns.rig import LEVEL_MARGIN, NODE, RobotRig, robot_rig
from autograder.exercises.patterns.scenarios import NAMES, SCENARIOS, Scenario
from autograder.observe.phrases import with_reason
from course.runtime.requests.actions import GoalState

EXAM: Exam[RobotRig] = Exam("patterns", robot_rig, fresh_parts=True)

RATE_WINDOW = 2.0  # s
FROZEN = 0.6  # s on the wall
POSITIONS = ((0.3, 0.2, 0.4), (0.6, 0.5, 0.7), (0.9, 0.8, 0.95))
"""Metres before the first drive: the usual ones, and from what to what they are drawn."""
LEVEL_AGE, TICK = 1.0, 0.05  # s
SPEED_AT_START = 0.5  # m/s
LOWEST, HIGHEST = 0.1, 1.0  # m/s
MISTYPED = 5.0  # m/s
START, MOST_STARTS = 1, 6  # the stations from which it may drive first
WAY, FAR = 3, (50, 40, 60)  # stations to drive; of a drive that is called off
PASSING = 0.3  # s
QUIET, COARSE = 8.0, 0.5
"""Seconds of the node's clock after which a change is long past, and between two moments of it."""

# The visible checks name no pattern, neither in their hints nor in what is to be read.
READ_PATTERNS = f"{choices.READ}, and the section on the pattern of your choice"
READ_ACTIONS = "Chapter 5, “Actions: long-running operations with feedback”"

# What can be used over the ROS graph as the task describes it; which pattern is asked for in the
# first half is the key's affair.
WORKING: dict[Scenario, dict[str, str]] = {
    "position": {"service": "std_srvs/srv/Trigger", "topic": "std_msgs/msg/Float64"},
    "camera": {"topic": "sensor_msgs/msg/Image"},
    "navigation": {"action": ACTIONS},
    "parameters": {"service": interface_patterns.SET_PARAMETERS},
    "battery": {"topic": "sensor_msgs/msg/BatteryState"},
}


@EXAM.check(
    hints=(
        "Run the cell with your class again: does it end without an error?",
        "Try it beside the check: `course.run(RobotInterface)`.",
        "The class must be called RobotInterface, be a node, and need no arguments.",
    ),
    read="Chapter 5, “Nodes: the processing units”",
)
def node_starts(rig: RobotRig) -> str:
    """The node starts.

    Whoever wants to know or command anything finds nobody if the robot's interface is not there.
    """
    try:
        rig.start()
    except StudentError as error:
        raise Failed(
            expected=f"{NODE}() makes a node without an error.",
            actual=error.feedback_text,
        ) from None
    found = interface_patterns.wait_for_patterns(
        rig, {scenario: tuple(WORKING[scenario]) for scenario in SCENARIOS}
    )
    rig.memory["offers"] = found
    rig.stands_still()
    kinds = [f"{scenario}: {' and '.join(found[scenario]) or 'nothing'}" for scenario in SCENARIOS]
    return f"Seen on the ROS graph: {'; '.join(kinds)}."


@EXAM.check(
    hints=(
        "Look at the cell with `choices`: has every scenario its word?",
        'Each value is one of three texts: "topic", "service" or "action".',
        "Keep the five keys as they are, replace each None by your word, and run the cell again.",
    ),
    read=choices.READ,
)
def choices_made(rig: RobotRig) -> None:
    """A pattern is chosen for each of the five scenarios.

    A designer who leaves it open has others decide, usually for a topic.
    """
    rig.memory["choices"] = choices.read_choices(rig)


@EXAM.check(
    needs=("node_starts",),
    hints=(
        "Who produces the pictures, who looks at them, and who should wait for whom?",
        "They come by themselves, whoever looks: a timer of the node sets the pace.",
        "A timer callback every 0.1 s that hands out self.take_picture() under robot/camera, once "
        "for all who look.",
    ),
    read=READ_PATTERNS,
)
def camera_streams(rig: RobotRig) -> None:
    """Camera images come ten times a second, for everybody who looks.

    A remote driver steers by them: too few and the robot is already elsewhere, too many and the
    Wi-Fi is full.
    """
    needed = "Pictures come by themselves, 10 a second, for any number of viewers."
    interface_patterns.require_pattern(rig, "camera", WORKING["camera"], needed)
    pictures = rig.node.pictures
    since = rig.still
    left = FROZEN - (time.time_ns() - since) / 1e9
    # One may have been under way. A publisher that goes by the wall's clock sends more.
    if rig.wait(lambda: len(pictures) > 1 and pictures[-2].published > since, left):
        raise Failed(
            expected=f"{needed} The node's clock sets the pace, as a timer of the node does.",
            actual="Pictures were published while the node's clock stood still.",
        )
    if not camera_stream.wait_for_picture(rig, since):
        raise Failed(
            expected=needed,
            actual=f"Not one picture came in {camera_stream.picture_timeout(rig):g} s of the "
            f"node's time{rig.error_note()}.",
        )
    camera_stream.require_rate(rig, RATE_WINDOW, camera_stream.RATE)
    if fault := camera_stream.picture_fault(pictures[-1]):
        raise Failed(expected="A message on robot/camera holds a picture.", actual=fault)
    plain_program_times.require_trial(rig, "camera")
    rig.films = rig.memory["films"] = True


@EXAM.check(
    needs=("node_starts",),
    hints=(
        "Where is the robot: at the start, or now?",
        "Read `self.position` at the moment when somebody asks, not before.",
        "Answer whoever asks, with success set to True and message to str(self.position); or tell "
        "everybody at least twice a second.",
    ),
    read=READ_PATTERNS,
)
def position_answered(rig: RobotRig) -> str:
    """Whoever wants to know the robot's position gets the present one.

    A planner that starts from where the robot was a while ago plans through the shelf beside it.
    """
    needed = "Whoever wants to know the position gets it in metres, "
    needed += f"at most {odometry.AGE:g} s old, also while the robot stands still."
    pattern = interface_patterns.require_pattern(rig, "position", WORKING["position"], needed)
    if not rig.listens_to("position"):
        raise Failed(expected=needed, actual="Your node does not listen to hardware/position.")
    asker = odometry.asker_by(rig, pattern)
    for number, metres in enumerate(POSITIONS):  # the robot never goes back
        position = rig.draws.number(f"position {number}", *metres)
        rig.report("position", position)
        if answer := odometry.position_fault(rig, asker, position):
            raise Failed(
                expected=needed,
                actual=f"With the robot at {position:g} m, {answer}",
            )
    # Who begins to listen while the robot stands wants to know as well.
    if pattern == "topic" and (
        answer := odometry.position_fault(rig, odometry.Overhearing(rig), position)
    ):
        raise Failed(
            expected=needed,
            actual=f"To somebody who began to listen while the robot stood at {position:g} m, "
            f"{answer}",
        )
    plain_program_times.require_trial(rig, "position")
    rig.asker = asker
    rig.memory["position"] = pattern
    if pattern == "topic":
        return (
            "As a topic: that is how most robots do it (odometry), and whoever listens always "
            "knows. The chapter asks for it by a service, which suits those who need it once."
        )
    return (
        "As a service, the chapter's answer. Most robots offer the position as a topic, too "
        "(odometry), for those who need it all the time; both are right here."
    )


@EXAM.check(
    needs=("node_starts",),
    hints=(
        "What does whoever changes a parameter need to hear back?",
        "declare_parameter gives your node all that it takes; a range or a callback refuses.",
        "declare_parameter('max_speed', 0.5, ParameterDescriptor(floating_point_range=[...])) with "
        "a FloatingPointRange from 0.1 to 1.0.",
    ),
    read="ROS 2 documentation, “Concepts: Parameters”",
)
def parameter_changes(rig: RobotRig) -> str:
    """A parameter can be changed, and a bad value is refused with a reason.

    Somebody mistypes 5 for 0.5 m/s: the robot has to say no, and say why.
    """
    needed = "Whoever changes max_speed hears whether the new value holds, or why it does not."
    interface_patterns.require_pattern(rig, "parameters", WORKING["parameters"], needed)
    prefix = interface_patterns.parameter_node(rig)
    # Where only a service knows it, the first drive tells: see speed_takes_effect.
    if prefix is not None and rig.untouched:
        first = interface_patterns.speed_limit(rig, prefix)
        if first is not None and first != SPEED_AT_START:
            raise Failed(
                expected=f"max_speed is {SPEED_AT_START:g} m/s at the start.",
                actual=f"Before anybody has changed it, it is {first:g} m/s.",
            )
    with unaffected_during_drive.require_standing(rig):
        for good in _good_speeds(rig):
            taken, reason = interface_patterns.set_speed_limit(rig, good)
            if not taken:
                raise Failed(
                    expected=f"{needed} {good:g} m/s is a good value: from 0.1 to 1.0 all are.",
                    actual=f"It was refused, {with_reason(reason)}.",
                )
    for bad in _bad_speeds(rig):
        taken, reason = interface_patterns.set_speed_limit(rig, bad)
        if taken:
            interface_patterns.set_speed_limit(rig, good)  # with this one no robot can drive on
            raise Failed(
                expected="Values of max_speed that are not between 0.1 and 1.0 are refused.",
                actual=f"{bad:g} m/s was accepted.",
            )
        if not reason.strip():
            raise Failed(
                expected="A value that is refused is refused with a reason.",
                actual=f"{bad:g} m/s was refused, and the reason was left empty.",
            )
    if prefix is not None and (now := interface_patterns.speed_limit(rig, prefix)) != good:
        raise Failed(
            expected=f"The value that was set, {good:g} m/s, can be read back.",
            actual=f"Read back, max_speed is {now}.",
        )
    rig.limit = good
    if prefix is None:
        return (
            "By a service of your own: right. A parameter of the node would be, too; it can be "
            "read back, and tools such as `ros2 param` and rqt know it."
        )
    return (
        "As a parameter of the node: right. A SetParameters service of your own would be, too; "
        "practice prefers the parameter, which can be read back and which all tools know."
    )


def _good_speeds(rig: RobotRig) -> tuple[float, ...]:
    """Return speed limits in m/s: both bounds, one that is not round, and the one that stays."""
    odd = rig.draws.number("a good speed", 0.37, 0.21, 0.89)
    return HIGHEST, LOWEST, odd, _speed_limits(rig)[0][0]


def _bad_speeds(rig: RobotRig) -> tuple[float, ...]:
    draw = rig.draws.number
    return (
        draw("a speed below 0", -0.5, -0.9, -0.1),
        0.0,
        draw("a speed that is too low", 0.05, 0.01, 0.09),
        MISTYPED,
        draw("a speed that is too high", 1.1, 1.01, 1.3),
    )


def _speed_limits(rig: RobotRig) -> tuple[tuple[float, float], ...]:
    """Return speed limits in m/s, each with one that is refused after it."""
    slow = rig.draws.number("a low speed limit", 0.3, 0.2, 0.4)
    fast = rig.draws.number("a high speed limit", 0.8, 0.6, 0.9)
    return (slow, MISTYPED), (fast, _bad_speeds(rig)[2])


def _battery_levels(rig: RobotRig) -> tuple[float, ...]:
    """Return battery levels: great changes and a small one, falling and rising."""
    high = rig.draws.number("a high level", 0.6, 0.55, 0.69)
    low = rig.draws.number("a low level", 0.4, 0.3, 0.45)
    return high, low, round(low - 0.02, 2), rig.draws.number("a higher level", 0.8, 0.71, 0.94)


@EXAM.check(
    needs=("node_starts",),
    hints=(
        "Who needs the battery level, and does each of them have to ask?",
        "Tell the level when it changes, or every second; BatteryState has a field for it.",
        "In charge_changed, hand out BatteryState(percentage=self.charge) under robot/battery, "
        "once for all who listen.",
    ),
    read=READ_PATTERNS,
)
def battery_broadcast(rig: RobotRig) -> None:
    """A new battery level reaches everybody who listens.

    The planner, the display and the log all need it; whoever is forgotten strands the robot.
    """
    needed = f"Whoever listens to robot/battery knows a new level within {LEVEL_AGE:g} s."
    interface_patterns.require_pattern(rig, "battery", WORKING["battery"], needed)
    if not rig.listens_to("charge"):
        raise Failed(expected=needed, actual="Your node does not listen to hardware/charge.")
    wait_for_discovery(rig)
    for level in _battery_levels(rig):
        rig.report("charge", level)
        if not rig.wait_stepping(lambda level=level: rig.told_level(level), LEVEL_AGE):  # type: ignore[misc]
            raise Failed(
                expected=f"{needed} Its percentage is 0.0 to 1.0.",
                actual=f"{LEVEL_AGE:g} s after the level had become {level:g}, "
                f"{unaffected_during_drive.last_level(rig)}{rig.error_note()}.",
            )
    plain_program_times.require_trial(rig, "level")
    rig.broadcasts = rig.memory["broadcasts"] = True


@EXAM.check(
    needs=("battery_broadcast",),
    hints=(
        "What does a display see that is switched on an hour after the last change?",
        "Either the publisher keeps its last message for late joiners, or it repeats it.",
        "QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL), or a timer of 1 s.",
    ),
    read="Chapter 5, “QoS profiles: durability”",
)
def battery_late_joiner(rig: RobotRig) -> str:
    """A listener that joins late learns the battery level, too.

    A display that is switched on later shows an empty field until the level changes next: perhaps
    too late.
    """
    level = rig.draws.number("the last level", 0.7, 0.1, 0.24)
    rig.report("charge", level)
    needed = f"Whoever joins late knows the level within {LEVEL_AGE:g} s, without a change."
    # Everything that this change set off is over before anyone joins.
    rig.wait_stepping(lambda: rig.told_level(level), LEVEL_AGE)
    rig.step(QUIET, COARSE)
    late = LateJoiner(rig, BatteryState, NAMES["battery"])

    def told() -> bool:  # a publisher may keep some earlier levels, too: the last one counts
        return bool(late.heard) and abs(late.heard[-1].percentage - level) < LEVEL_MARGIN

    if late.durable:
        how = "Transient local"
        rig.wait_stepping(told, LEVEL_AGE)
    else:
        how = "Published again"
        # Somebody may join just after one repetition: from there on the next one counts. And it
        # may be joining that sets it off, so somebody joins each time.
        for tolerance in (0.0, TICK):
            joined = time.time_ns()
            late = LateJoiner(rig, BatteryState, NAMES["battery"])
            wait_for_discovery(rig)
            if not wait_for_arrival(
                rig,
                lambda joined=joined: rig.node.levels.newest_time > joined,  # type: ignore[misc]
                LEVEL_AGE + tolerance,
                TICK,
            ):
                raise Failed(
                    expected=needed,
                    actual=f"The level was not published again within {LEVEL_AGE:g} s, and its "
                    f"publisher ({late.unkept}) keeps nothing for late joiners.",
                )
        rig.wait_stepping(told)
    if not told():
        said = f"{late.heard[-1].percentage:.4g}" if late.heard else "nothing"
        raise Failed(expected=needed, actual=f"With the level at {level:g}, it was told {said}.")
    plain_program_times.require_trial(rig, "late")
    return f"{how}: right. A durable publisher and one that repeats itself both serve late joiners."


@EXAM.check(
    needs=("node_starts",),
    hints=(
        "Which pattern has a goal, reports on the way, and an end?",
        "In a loop: drive, see at which station the robot is, report all so far, sleep a little.",
        "One callback does the whole drive: a report at each station, and at the end drive(0.0), "
        "goal_handle.succeed() and a Result with the stations passed.",
    ),
    read=READ_PATTERNS,
)
def navigation_drives(rig: RobotRig) -> None:
    """A navigation goal is driven to, with a report at each station and at the end.

    A drive takes minutes: whoever sent the robot wants to know how far it is, and that it is there.
    """
    needed = "Somebody names a station, hears of each one that is passed, and learns how it ended."
    interface_patterns.require_pattern(rig, "navigation", WORKING["navigation"], needed)
    start = _next_start(rig)
    with Drive(rig, start, start + WAY) as drive:
        if rig.untouched:
            rig.first_top = drive.top_speed(SPEED_AT_START)
        # An earlier part of the exam may have found already what is found in a blocked aisle.
        drive_ends.to_the_end(drive, blocked=not rig.memory.get("waits"))
        stations.require_result(drive)
    rig.memory["waits"] = True
    _drive_again(rig, drive.position, "a drive")
    plain_program_times.require_trial(rig, "aisle")


def _next_start(rig: RobotRig) -> int:
    """Return the station from which a drive begins: the robot is never carried back."""
    first = rig.draws.whole("the first station", START, START, MOST_STARTS)
    return max(first, math.ceil(rig.position))


def _drive_again(rig: RobotRig, position: float, before: str) -> None:
    """Send the robot about a metre on: what the goal ``before`` has left must not be in the way."""
    with _told_of_next(before), Drive(rig, position, round(position) + 1) as drive:
        if rig.obeyed is not None:
            drive.require_speed(rig.obeyed, f"With max_speed at {rig.obeyed:g} m/s")
        drive_ends.to_the_end(drive)
        stations.require_result(drive)


@contextmanager
def _told_of_next(before: str) -> Iterator[None]:
    """Have a failure say that it was in the drive after the one ``before``."""
    try:
        yield
    except Failed as failed:
        raise Failed(
            expected=f"After {before} the next goal is as good as the first. {failed.expected}",
            actual=f"In that next drive: {failed.actual}",
        ) from None


@EXAM.check(
    needs=("navigation_drives", "parameter_changes"),
    hints=(
        "When does your node look at max_speed: when it starts, or when it drives?",
        "Ask for the parameter's value anew for every goal.",
        "self.drive(self.get_parameter('max_speed').value) where the drive begins.",
    ),
    read="ROS 2 documentation, “Concepts: Parameters”",
)
def speed_takes_effect(rig: RobotRig) -> None:
    """A new speed limit is the speed of the next drive.

    A parameter that is accepted and then ignored is worse than one that is refused: everybody
    believes that the robot has slowed down.
    """
    first = rig.first_top
    if first is not None and abs(first - SPEED_AT_START) > SPEED_MARGIN:
        raise Failed(
            expected=f"max_speed is {SPEED_AT_START:g} m/s at the start, and the robot drives at "
            "that.",
            actual=f"On the first drive, before anybody had changed max_speed, hardware/speed went "
            f"up to {first:g} m/s.",
        )
    position = float(_next_start(rig))
    for limit, refused in _speed_limits(rig):
        interface_patterns.set_speed_limit(rig, limit)
        interface_patterns.set_speed_limit(rig, refused)  # the good one stays
        expected = f"With max_speed at {limit:g} m/s, and {refused:g} m/s refused after that,"
        with Drive(rig, position, int(position) + 2) as drive:
            drive.require_speed(limit, expected)
            drive.roll_on()
            stations.require_report(drive)
            drive.go_by(PASSING)  # at the station some halt for a moment
            drive.require_speed(limit, expected)
            drive_ends.to_the_end(drive)
            position = drive.position
    rig.obeyed = limit


@EXAM.check(
    needs=("navigation_drives",),
    hints=(
        "Who decides in an action server whether a goal may be cancelled?",
        "The default cancel callback rejects; and the loop has to look at is_cancel_requested.",
        "cancel_callback=lambda _: CancelResponse.ACCEPT; in the loop, when is_cancel_requested: "
        "drive(0.0), goal_handle.canceled(), return the result.",
    ),
    read=READ_ACTIONS,
)
def navigation_cancel(rig: RobotRig) -> None:
    """A goal that is called off stops the robot.

    Somebody steps into the aisle and the goal is cancelled: a robot that drives on to the next
    station first has not understood.
    """
    start = _next_start(rig)
    with Drive(rig, start, start + rig.draws.whole("a long way", *FAR)) as drive:
        drive.require_driving()
        drive.roll_on()
        stations.require_report(drive)
        drive.require_driving()
        drive.leave_station()
        _call_off(drive)
    before = "a drive that was called off"
    unaffected_during_drive.require_the_same_after(rig, drive.position, before)
    with _told_of_next(before), Drive(rig, drive.position, drive.goal) as drive:
        drive.require_driving()  # and not yet at any station
        _call_off(drive)
    _drive_again(rig, drive.position, before)
    plain_program_times.require_trial(rig, "cancel")


def _call_off(drive: Drive) -> None:
    over = drive_ends.cancel_drive(drive, drive_ends.STOPS)
    drive_ends.require_end(
        drive, GoalState.CANCELED, "A drive that is called off ends there and then."
    )
    if not drive_ends.stopped_by(drive, over):
        raise Failed(
            expected=f"A drive that is called off stops the robot within {drive_ends.STOPS:g} s.",
            actual=f"{drive_ends.STOPS:g} s of the node's time later hardware/speed had not said "
            "0.0 yet. It did so afterwards.",
        )


choices.add_checks(EXAM, needs=("choices_made",))
