"""Exercise 3: which communication pattern fits, chosen and built; judged by use.

Every bound below stands in the task's fine print. What is right in more than one way: the position
as a service or as a topic, a parameter of the node or a service of its own, a battery level that is
durable, published again and again, or told each one that joins. The key of the choices is not here:
it comes from the hidden cell.
"""

from __future__ import annotations

from contextlib import AbstractContextManager

from autograder.examination.exam import Exam, Failed
from autograder.exercises.patterns import drive_ends, readings
from autograder.exercises.patterns.drive import SPEED_MARGIN, Drive
from autograder.exercises.patterns.interface_patterns import await_patterns, require_pattern
from autograder.exercises.patterns.plain_program import TRIALS
from autograder.exercises.patterns.robot import CHARGE, POSITION, SPEED_AT_START, Robot
from autograder.exercises.patterns.scenarios import CHOICES, SCENARIOS
from autograder.observe.findings import in_context
from autograder.observe.stepped_time.stream_rate import require_stream

FILM_S, PASSING_S = 2.0, 0.3
"""Seconds of the node's clock in which pictures are counted, and in which a station is passed."""
POSITIONS_M = ((0.3, 0.2, 0.4), (0.6, 0.5, 0.7), (0.9, 0.8, 0.95))
"""Before the first drive: the usual ones, and from what to what they are drawn."""
LOWEST, HIGHEST, MISTYPED = 0.1, 1.0, 5.0  # m/s
SLOW, FAST = ("a low speed limit", 0.3, 0.2, 0.4), ("a high speed limit", 0.8, 0.6, 0.9)
TOO_SLOW = ("a speed that is too low", 0.05, 0.01, 0.09)
"""Speed limits in m/s: the usual ones, and from what to what they are drawn."""
START, MOST_STARTS, WAY = 1, 6, 3
"""The stations from which the robot may drive first, and how many it passes."""

# The visible checks name no pattern, neither in their hints nor in what is to be read.
READ_CHOICES = "Chapter 5, “When to use what”"
READ_PATTERNS = f"{READ_CHOICES}, and the section on the pattern of your choice"
READ_PARAMETERS = "ROS 2 documentation, “Concepts: Parameters”"
EXAM: Exam[Robot] = Exam("patterns", Robot, fresh_parts=True, read=READ_PATTERNS)


@EXAM.check(
    hints=(
        "Run the cell with your class again: does it end without an error?",
        "Try it beside the check: `course.run(RobotInterface)`.",
        "The class must be called RobotInterface, be a node, and need no arguments.",
    ),
    read="Chapter 5, “Nodes: the processing units”",
)
def node_starts(robot: Robot) -> str:
    """The node starts.

    Nodes that want to know or command anything find nobody if the robot's interface is not there.
    """
    robot.start()
    await_patterns(robot)
    found = robot.found.offers
    kinds = [f"{name}: {' and '.join(found[name]) or 'nothing'}" for name in SCENARIOS]
    return f"Seen on the ROS graph: {'; '.join(kinds)}."


@EXAM.check(
    hints=(
        "Look at the cell with `choices`: has every scenario its word?",
        'Each value is one of three texts: "topic", "service" or "action".',
        "Keep the five keys as they are, replace each None by your word, and run the cell again.",
    ),
    read=READ_CHOICES,
)
def choices_made(robot: Robot) -> None:
    """A pattern is chosen for each of the five scenarios.

    A designer who leaves it open has others decide, usually for a topic.
    """
    CHOICES.read(robot.bench)


@EXAM.check(
    needs=("node_starts",),
    hints=(
        "Do pictures come by themselves, at the right pace, and with something in them?",
        "Nobody has to ask for them, and nobody waits: a timer of the node sets the pace.",
        "A timer callback every 0.1 s that hands out self.take_picture() under robot/camera, once "
        "for all who look.",
    ),
)
def camera_streams(robot: Robot) -> None:
    """Camera images come ten times a second, for everybody who looks.

    A remote driver steers by them: too few and the robot is already elsewhere, too many and the
    Wi-Fi is full.
    """
    require_pattern(robot, "camera")
    require_stream(robot, robot.pictures, readings.PICTURES_HZ, FILM_S)
    readings.require_content(robot)
    TRIALS.require(robot.bench, "camera")
    robot.found.works.add("camera")


@EXAM.check(
    needs=("node_starts",),
    hints=(
        "Is a node that wants to know told anything at all, and is it where the robot is now?",
        "Read `self.position` at the moment when somebody asks, not before.",
        "Answer each request, with success set to True and message to str(self.position); or tell "
        "everybody at least twice a second.",
    ),
)
def position_answered(robot: Robot) -> str:
    """A node that wants to know the robot's position gets the present one.

    A planner that starts from where the robot was a while ago plans through the shelf beside it.
    """
    pattern = require_pattern(robot, "position")
    robot.require_heard(POSITION)
    if pattern == "topic":
        readings.listen_to_position(robot)
    for number, metres in enumerate(POSITIONS_M):  # the robot never goes back
        robot.report(POSITION, robot.draws.number(f"position {number}", *metres))
        readings.require_position(robot, pattern)
    if pattern == "topic":  # who begins to listen while the robot stands wants to know as well
        with in_context("So does a new listener.", "To somebody who has just begun to listen:"):
            readings.listen_to_position(robot)
            readings.require_position(robot, pattern)
    TRIALS.require(robot.bench, "position")
    robot.found.position_by = pattern
    if pattern == "topic":
        return (
            "As a topic: that is how most robots do it (odometry), and all who listen always "
            "know. The chapter asks for it by a service, which suits those who need it once."
        )
    return (
        "As a service, the chapter's answer. Most robots offer the position as a topic, too "
        "(odometry), for those who need it all the time; both are right here."
    )


@EXAM.check(
    needs=("node_starts",),
    hints=(
        "Which values are accepted, which are refused, and what is the sender told of that?",
        "declare_parameter gives your node all that it takes; a range or a callback refuses.",
        "declare_parameter('max_speed', 0.5, ParameterDescriptor(floating_point_range=[...])) with "
        "a FloatingPointRange from 0.1 to 1.0.",
    ),
    read=READ_PARAMETERS,
)
def parameter_changes(robot: Robot) -> str:
    """A parameter can be changed, and a bad value is refused with a reason.

    Somebody mistypes 5 for 0.5 m/s: the robot has to say no, and say why.
    """
    require_pattern(robot, "parameters")
    draw = robot.draws.number
    slow = draw(*SLOW)
    # Where only a service knows it, the first drive tells: see speed_takes_effect.
    robot.max_speed.require(SPEED_AT_START)
    with drive_ends.require_standing(robot):
        for good in (HIGHEST, LOWEST, draw("a good speed", 0.37, 0.21, 0.89), slow):
            robot.max_speed.set(good).require_accepted()
    low, high = draw(*TOO_SLOW), draw("a speed that is too high", 1.1, 1.01, 1.3)
    for bad in (draw("a speed below 0", -0.5, -0.9, -0.1), 0.0, low, MISTYPED, high):
        change = robot.max_speed.set(bad)
        if change.accepted:
            robot.max_speed.set(slow)  # with a bad one no robot can drive on
        change.require_refused()
    robot.found.works.add("parameters")
    if robot.max_speed.find_node() is None:
        return (
            "By a service of your own: right. A parameter of the node would be, too; it can be "
            "read back, and tools such as `ros2 param` and rqt know it."
        )
    return (
        "As a parameter of the node: right. A SetParameters service of your own would be, too; "
        "practice prefers the parameter, which can be read back and which all tools know."
    )


@EXAM.check(
    needs=("node_starts",),
    hints=(
        "Does everybody who listens hear each new level, as a number from 0.0 to 1.0?",
        "Tell the level when it changes, or every second; BatteryState has a field for it.",
        "In charge_changed, hand out BatteryState(percentage=self.charge) under robot/battery, "
        "once for all who listen.",
    ),
)
def battery_broadcast(robot: Robot) -> None:
    """A new battery level reaches everybody who listens.

    The planner, the display and the log all need it; one that is forgotten strands the robot.
    """
    require_pattern(robot, "battery")
    robot.require_heard(CHARGE)
    robot.await_discovery()
    draw = robot.draws.number
    high, low = draw("a high level", 0.6, 0.55, 0.69), draw("a low level", 0.4, 0.3, 0.45)
    for level in (high, low, round(low - 0.02, 2), draw("a higher level", 0.8, 0.71, 0.94)):
        readings.require_level(robot, level)
    TRIALS.require(robot.bench, "battery")
    robot.found.works.add("battery")


@EXAM.check(
    needs=("battery_broadcast",),
    hints=(
        "What does a display see that is switched on an hour after the last change?",
        "Either the publisher keeps its last message for late joiners, or it repeats it.",
        "QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL), or a timer of 1 s.",
    ),
    read="Chapter 5, “QoS profiles: durability”",
)
def battery_late_joiner(robot: Robot) -> str:
    """A listener that joins late learns the battery level, too.

    A display that is switched on later shows an empty field until the level changes next: perhaps
    too late.
    """
    level = robot.draws.number("the last level", 0.7, 0.1, 0.24)
    how = readings.require_late_level(robot, level)
    TRIALS.require(robot.bench, "battery late")
    return f"{how}: right. A durable publisher and one that repeats itself both serve late joiners."


@EXAM.check(
    needs=("node_starts",),
    hints=(
        "Follow one drive: what are its sender and the motors told at its start, at each station, "
        "and at its end; and who has to wait meanwhile?",
        "In a loop: drive, see at which station the robot is, report all so far, sleep a little.",
        "One callback does the whole drive: a report at each station, and at the end drive(0.0), "
        "goal_handle.succeed() and a Result with the stations passed.",
    ),
)
def navigation_drives(robot: Robot) -> None:
    """A navigation goal is driven to, with a report at each station and at the end.

    A drive takes minutes: its sender wants to know how far it is, and that it is there.
    """
    require_pattern(robot, "navigation")
    start = robot.draws.whole("the first station", START, START, MOST_STARTS)
    robot.report(POSITION, float(start))
    with Drive(robot, start + WAY) as drive:
        if robot.max_speed.last_set is None:
            robot.first_top = drive.find_top_speed(SPEED_AT_START)
        # An earlier part of the exam may have found already what is found in a blocked aisle.
        drive_ends.drive_to_goal(drive, blocked="aisle" not in robot.found.works)
    robot.found.works.add("aisle")
    drive_again(robot, "a drive")
    TRIALS.require(robot.bench, "navigation blocked")


def drive_again(robot: Robot, before: str) -> None:
    """Send the robot about a metre on: what the goal ``before`` has left must not be in the way."""
    with in_next_drive(before), Drive(robot, round(robot.position) + 1) as drive:
        if robot.obeys and robot.max_speed.last_set is not None:
            drive.require_speed(robot.max_speed.last_set)
        drive_ends.drive_to_goal(drive)


def in_next_drive(before: str) -> AbstractContextManager[None]:
    """Have a failure say that it was in the drive after the one ``before``."""
    return in_context(f"After {before} the next is as good as the first.", "In the next drive:")


@EXAM.check(
    needs=("navigation_drives", "parameter_changes"),
    hints=(
        "Which speed do the motors get, and when does your node look it up: at its start, or for "
        "each drive?",
        "Ask for the parameter's value anew for every goal.",
        "self.drive(self.get_parameter('max_speed').value) where the drive begins.",
    ),
    read=READ_PARAMETERS,
)
def speed_takes_effect(robot: Robot) -> None:
    """A new speed limit is the speed of the next drive.

    A parameter that is accepted and then ignored is worse than one that is refused: everybody
    believes that the robot has slowed down.
    """
    first = robot.first_top
    if first is not None and abs(first - SPEED_AT_START) > SPEED_MARGIN:
        raise Failed(
            expected="max_speed is 0.5 m/s at the start, and the robot drives at that.",
            actual="On the first drive, before anybody had changed max_speed, hardware/speed went "
            f"up to {first:g} m/s.",
        )
    draw = robot.draws.number
    for limit, bad in ((draw(*SLOW), MISTYPED), (draw(*FAST), draw(*TOO_SLOW))):
        robot.max_speed.set(limit)
        robot.max_speed.set(bad)  # the good one stays
        refused = f", and {bad:g} m/s refused after that"
        with Drive(robot, int(robot.position) + 2) as drive:
            drive.require_speed(limit, refused)
            drive.roll_on()
            drive.require_report()
            drive.robot.pass_time(PASSING_S)
            drive.require_speed(limit, refused)
            drive_ends.drive_to_goal(drive)
    robot.obeys = True


@EXAM.check(
    needs=("navigation_drives",),
    hints=(
        "Is the cancel accepted, do the motors stop at once, does the goal end, and does all else "
        "go on?",
        "The default cancel callback rejects; and the loop has to look at is_cancel_requested.",
        "cancel_callback=lambda _: CancelResponse.ACCEPT; in the loop, when is_cancel_requested: "
        "drive(0.0), goal_handle.canceled(), return the result.",
    ),
    read="Chapter 5, “Actions: long-running operations with feedback”",
)
def navigation_cancel(robot: Robot) -> None:
    """A goal that is called off stops the robot.

    Somebody steps into the aisle and the goal is cancelled: a robot that drives on to the next
    station first has not understood.
    """
    before = "a drive that was called off"
    far = int(robot.position) + robot.draws.whole("a long way", 50, 40, 60)
    with Drive(robot, far) as drive:
        drive.require_driving()
        drive.roll_on()
        drive.require_report()
        drive.require_driving()
        drive.leave_station()
        drive_ends.call_off(drive)
    with in_context(f"After {before} all goes on.", "Then:"), drive_ends.require_standing(robot):
        drive_ends.require_others(
            robot, robot.draws.number("the level after a drive", 0.35, 0.25, 0.45)
        )
    with in_next_drive(before), Drive(robot, far) as drive:
        drive.require_driving()  # and not yet at any station
        drive_ends.call_off(drive)
    drive_again(robot, before)
    TRIALS.require(robot.bench, "navigation called off")


CHOICES.add_checks(EXAM, needs=("choices_made",), read=READ_CHOICES)
