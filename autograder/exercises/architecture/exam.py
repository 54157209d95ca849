"""Exercise 2: the node architecture of a robot that drives to waypoints and avoids obstacles.

The design's nodes come up for real, and everything is read off the ROS graph: who publishes, reads,
serves and calls what. Nodes and topics inside the robot may be called anything, split and merged as
the task allows; only the robot's boundary has fixed names.
"""

from __future__ import annotations

from autograder.examination.exam import Exam, Failed
from autograder.exercises.architecture.missing_jobs import (
    EYES_PHRASE,
    why_no_driving,
    why_no_navigation,
    why_no_obstacles,
    why_no_planner,
    why_no_pose,
    why_no_readings,
)
from autograder.exercises.architecture.robot_jobs import (
    ACTION,
    EYES,
    MOTORS,
    SCAN,
    SENSORS,
    STREAMS,
    WHEELS,
    Jobs,
)
from autograder.observe.graph.link_faults import find_link_faults
from autograder.observe.graph.ros_graph import GraphTopic, RosGraph
from autograder.observe.marks.mark_trace import Trace
from autograder.observe.marks.marked_types import is_installed
from autograder.observe.marks.observed_design import ObservedDesign, declared_nodes
from autograder.observe.phrases import as_phrase, name_nodes

THREADS = 8
"""Threads that run the design's nodes: one that waits in a callback holds up itself alone."""
EXAM: Exam[ObservedDesign] = Exam(
    "architecture",
    declared_nodes("design", threads=THREADS),
    read="Chapter 5, “Topics: continuous data sharing”",
)

OUTSIDE = (MOTORS, ACTION)
"""What is read, or used, by somebody outside the design."""
MOST_JOBS = 2
INNER_JOBS = frozenset(("estimates the state", "plans paths", "navigates", "controls the motors"))
"""Jobs that others depend on: where one is missing, how the rest is divided can still be seen."""
MOST_FAULTS = 4

READ_NODES = "Chapter 5, “Nodes: the processing units”"
READ_SERVICES = "Chapter 5, “Services: synchronous request-response”"
READ_ACTIONS = "Chapter 5, “Actions: long-running operations with feedback”"
READ_PATTERNS = "Chapter 5, “When to use what”"


def require_none(faults: str, *, expected: str) -> None:
    """Fail if there are any faults."""
    if faults:
        raise Failed(expected=expected, actual=faults)


def require_commands(jobs: Jobs) -> None:
    """Fail if no node commands the motors: there is nothing to be followed to them."""
    if not jobs.controllers:
        raise Failed(expected=f"A node publishes {MOTORS}.", actual=f"No node publishes {MOTORS}.")


@EXAM.check(
    hints=(
        "Run the cell with your design again: does it end without an error?",
        "Try it beside the check: `design.run()` brings every node up in this notebook.",
        "The variable must be called `design`, and every name may carry one type only.",
    ),
    read=READ_NODES,
)
def design_runs(design: ObservedDesign) -> str:
    """Every node of the design comes up on the ROS graph.

    An architecture on paper never fails. What cannot be brought up cannot drive either.
    """
    design.start()
    return f"On the graph: {name_nodes(design.graph.nodes)}."


@EXAM.check(
    needs=("design_runs",),
    hints=(
        "Which sensors does the robot have, and which node speaks for each of them?",
        "A driver reads no topic: it publishes what the hardware delivers.",
        "Publish /scan as LaserScan, /camera/image as Image and /wheel/odometry as Odometry.",
    ),
)
def drivers_publish(design: ObservedDesign) -> None:
    """Drivers publish the readings of LIDAR, camera and wheel encoders.

    Everything the robot knows begins here. A driver that only drives can be swapped for another
    LIDAR, a simulator or a recording, and no other node notices.
    """
    require_none(
        why_no_readings(design.graph),
        expected="Each of the three sensors has a node that publishes its readings.",
    )


@EXAM.check(
    needs=("design_runs",),
    hints=(
        "Which pattern fits work that takes a minute, reports progress and can be cancelled?",
        "The navigation node is the server of the action navigate_to; who sends goals is outside.",
        "Give that node `.action_server('navigate_to', NavigateTo)`, and subscribe it to obstacle "
        "information, the pose, or a sensor.",
    ),
    read=READ_ACTIONS,
)
def navigation_action(design: ObservedDesign) -> None:
    """Navigation is an action server that sensor data reaches.

    Driving to a waypoint takes a while, wants feedback and must be stoppable: a service call would
    leave its caller waiting. And a navigator that hears of no sensor drives blind.
    """
    require_none(
        why_no_navigation(Jobs(design.graph)),
        expected=f"One node is the server of {ACTION}, and topics bring it what the sensors see.",
    )


@EXAM.check(
    needs=("design_runs",),
    hints=(
        "Who turns thousands of distances and pixels into “there is something on the left”?",
        "One node subscribes to /scan or /camera/image and publishes what it found; navigation or "
        "the controller subscribes to that.",
        "For example: obstacle_detection subscribes to scan and publishes obstacles as PoseArray, "
        "and the navigation node subscribes to obstacles.",
    ),
)
def obstacle_information(design: ObservedDesign) -> str:
    """Obstacle detection turns sensor topics into obstacle information that steers the robot.

    Detection runs at the rate of the sensors, navigation at its own. In a node of its own it can be
    tested with recorded scans, improved and restarted while the robot goes on.
    """
    jobs = Jobs(design.graph)
    require_none(
        why_no_obstacles(jobs),
        expected=f"A node reads {EYES_PHRASE} and publishes on a topic what is in the way; another "
        "node reads that, and it leads to the motors.",
    )
    return " ".join(
        f"It is on {topic.name} ({topic.types[0].rsplit('/', 1)[-1]}), from "
        f"{name_nodes(topic.written_by)}."
        for topic in jobs.obstacle_topics[:3]
    )


@EXAM.check(
    needs=("design_runs",),
    hints=(
        "How does the robot know where it is, and who tells the other nodes?",
        "State estimation subscribes to sensors and publishes the pose on a topic of its own.",
        "For example: state_estimation subscribes to wheel/odometry and publishes pose as "
        "PoseStamped or PoseWithCovarianceStamped.",
    ),
)
def pose_published(design: ObservedDesign) -> None:
    """State estimation reads sensors and publishes the robot's pose.

    Wheels slip: the pose is estimated from several sensors, many times a second. Navigation,
    planning and displays all need the same pose, so one node publishes it for everyone.
    """
    jobs = Jobs(design.graph)
    require_none(
        why_no_pose(jobs),
        expected="A node that reads sensors publishes the pose, as Odometry or one of the Pose "
        f"types, on a topic other than {WHEELS}.",
    )
    poses = [topic.name for topic in jobs.pose_topics]
    sensors = design.inputs([WHEELS, SCAN])
    if jobs.pose_of_wheels and not design.tracer.gets_message(poses, sensors, free=EYES):
        raise Failed(
            expected="While the wheel encoders report, the pose is published.",
            actual=f"Odometry came in on {WHEELS}, and nothing was ever published on "
            f"{as_phrase(poses, 'or')}{design.tracer.error_note()}.",
        )


@EXAM.check(
    needs=("design_runs",),
    hints=(
        "“Which way leads there?” is a short question with one answer. Which pattern is that?",
        "The planner serves, and knows the map; the node that has the goal calls it.",
        "For example: path_planner serves plan_path as GetPlan and subscribes to map; navigation "
        "calls plan_path.",
    ),
    read=READ_SERVICES,
)
def planner_service(design: ObservedDesign) -> None:
    """A path-planning service knows the map and gets the goal.

    A path is needed when there is a goal, not ten times a second: one request, one answer. In a
    node of its own the planner may take its time while the robot goes on avoiding obstacles.
    """
    require_none(
        why_no_planner(Jobs(design.graph)),
        expected="A node that reads the map serves path planning; another node, which has the "
        "goal, calls it.",
    )


@EXAM.check(
    needs=("design_runs",),
    hints=(
        "Which node has the last word on how fast each wheel turns?",
        "One node, and only one, publishes on motors/command; it follows what navigation says.",
        "For example: controller subscribes to velocity, which navigation publishes, and publishes "
        "motors/command as Twist.",
    ),
)
def motors_driven(design: ObservedDesign) -> None:
    """One controller drives the motors, by order of navigation.

    Two nodes that both command the motors make a robot that jerks between two wills; one that
    listens to nobody drives past every goal.
    """
    require_none(
        why_no_driving(Jobs(design.graph)),
        expected=f"One node publishes {MOTORS} as Twist, and navigation leads to it.",
    )


@EXAM.check(
    needs=("design_runs",),
    hints=(
        "Show the drawing of your design: has every topic an arrow in and an arrow out?",
        "The text form of the design, `print(design)`, lists under “Look again” what dangles.",
        "Add who is missing, or take the endpoint out; where QoS does not fit, offer more or ask "
        "for less.",
    ),
    read="Chapter 5, “Experiment 2: two ends that do not fit”",
)
def links_connect(design: ObservedDesign) -> None:
    """Every topic has a writer and a reader, every call a server, and DDS connects them.

    A wrong name or profile raises no error in ROS 2: the link simply stays silent, and you look for
    the mistake everywhere else.
    """
    faults = find_link_faults(design.graph, OUTSIDE)
    if not any(design.graph.links(("topic",))):
        faults.append("No topic leads from one node to another.")
    more = len(faults) - MOST_FAULTS
    require_none(
        " ".join(faults[:MOST_FAULTS]) + (f" And {more} more." if more > 0 else ""),
        expected=f"Nothing dangles, apart from {MOTORS} and {ACTION} at the robot's boundary.",
    )


@EXAM.check(
    needs=("obstacle_information",),
    builds_on=("motors_driven",),
    hints=(
        "Follow the obstacle information to the motors: is there a node that has to ask for it?",
        "An answer is as old as the question. What changes all the time is pushed, not fetched.",
        "Put topics (or action goals) all the way from the obstacle information to the controller.",
    ),
    read=READ_PATTERNS,
)
def streams_are_topics(design: ObservedDesign) -> None:
    """What is in the way reaches the motors as a stream, not by asking.

    A robot that asks once a second whether the way is free has driven half a metre between two
    questions, and if the answer is late it stands still or, worse, drives on.
    """
    jobs = Jobs(design.graph)
    topics = jobs.obstacle_topics
    require_commands(jobs)
    if not any(jobs.leads_to_motors(topic, STREAMS) for topic in topics):
        raise Failed(
            expected=f"From the obstacle information to {MOTORS} there are topics (or action "
            "goals) all the way.",
            actual=f"{as_phrase(topic.name for topic in topics)} gets there only by way of the "
            f"service {as_phrase(jobs.services_on_the_way(), 'or')}.",
        )


@EXAM.check(
    needs=("design_runs",),
    builds_on=("navigation_action", "pose_published", "planner_service", "motors_driven"),
    hints=(
        "Which node would you have to change for a new LIDAR, and which for a new motor?",
        "List for each node which of the six jobs it does.",
        "Split the node that is named above, until no node does more than two of the jobs.",
    ),
    read=READ_NODES,
)
def jobs_divided(design: ObservedDesign) -> None:
    """No node does everything: each takes on at most two of the robot's six jobs.

    A node that does it all cannot be tested in parts, and when it fails the whole robot fails.
    """
    jobs_of = Jobs(design.graph).of_each_node()
    busy = [
        f"{name_nodes([node])} {as_phrase(jobs)}."
        for node, jobs in jobs_of.items()
        if len(jobs) > MOST_JOBS
    ]
    done = {job for jobs in jobs_of.values() for job in jobs}
    if len(lacking := INNER_JOBS - done) > 1:
        raise Failed(
            expected="The robot's jobs are done by somebody.",
            actual=f"No node {as_phrase(sorted(lacking), 'or')}.",
        )
    require_none(
        " ".join(busy),
        expected="No node drives sensors, estimates, detects, plans, navigates and controls: two "
        "of these jobs at most.",
    )


@EXAM.check(
    needs=("motors_driven",),  # of two that command the motors, either may have passed it on
    builds_on=("navigation_action",),
    hints=(
        "Follow the goal from navigate_to from node to node: which one does not pass it on?",
        "Each link on the way must carry data: a message without a number or a text cannot.",
        "If you wrote nodes yourself, let them call `course.design.carry(received, sent)`.",
    ),
    read=READ_PATTERNS,
)
def goal_reaches_motors(design: ObservedDesign) -> None:
    """A navigation goal that goes in comes out at the motors.

    This is the dye test: each node passes on marked messages, and the mark of a goal has to arrive
    at the motors. Lines on a drawing carry nothing; links do.
    """
    if (goals := design.goals(ACTION)) is None:
        raise Failed(
            expected=f"A goal of {ACTION} can bear a mark: it holds a number or a text.",
            actual=f"Its type, {design.graph.action(ACTION).type}, has no room for one, or is not "
            "installed where the examiner runs.",
        )
    trace = design.tracer.trace_goals(
        goals, [MOTORS], beside=design.inputs([WHEELS]), seeing=design.inputs(EYES)
    )
    if trace.arrived:
        goals.require_next_taken()
    trace.require_arrival(f"a goal sent to {ACTION}")
    require_plans(design)


def require_plans(design: ObservedDesign) -> None:
    """Fail if path planning never answers, which a node of the library that asks does not notice.

    By now goals have been driven to, so one that raised before it had a map, say, can answer. One
    with which nobody connects is a matter of another check.
    """
    offered = Jobs(design.graph).planning_services
    services = [one for one in offered if not find_link_faults(RosGraph.of(services=[one]))]
    if services and not any(design.tracer.is_answered(service) for service in services):
        servers = {node for service in services for node in service.servers}
        raise Failed(
            expected="Path planning answers each request: its callback returns the response that "
            "it was given.",
            actual=f"{as_phrase(service.name for service in services)} did not answer a request"
            f"{design.tracer.error_note(servers)}.",
        )


@EXAM.check(
    needs=("obstacle_information", "motors_driven"),
    hints=(
        "Follow a scan from /scan to the obstacle information, and from there to the motors.",
        "Somewhere a node reads and does not write, or a message has no room for what it says.",
        "If you wrote nodes yourself, let them call `course.design.carry(received, sent)`; make "
        "all of their endpoints in the constructor.",
    ),
    read=READ_PATTERNS,
)
def scan_reaches_motors(design: ObservedDesign) -> None:
    """A scan becomes obstacle information, and that reaches the motors.

    The second dye test: a scan that never gets to the motors is an obstacle that the robot hits.
    """
    every = Jobs(design.graph).obstacle_topics
    topics = [topic for topic in every if is_installed(topic.types)]
    if not topics:
        raise Failed(
            expected="Obstacle information has a message type that is installed.",
            actual=f"{every[0].name} is of type {as_phrase(every[0].types)}, unknown to the "
            "examiner.",
        )
    require_stream(design, follow_scan(design, topics))
    now = design.read_again()
    faults = find_link_faults(now.added_since(design.graph), OUTSIDE)
    if len(now.topic(MOTORS).written_by) > 1:
        faults.insert(0, why_no_driving(Jobs(now)))
    if faults:
        raise Failed(
            expected="Every endpoint is there as soon as its node is, and those that come later "
            "keep to the same rules.",
            actual="While marks were poured in, this was new on the graph: "
            + " ".join(faults[:MOST_FAULTS]),
        )


def follow_scan(design: ObservedDesign, topics: list[GraphTopic]) -> Trace:
    """Follow the mark of a scan to obstacle information, and from just there to the motors.

    What the scan's mark does not get to is no way for it: where one way is a dead end, the others
    are tried by themselves.
    """
    lost: Failed | None = None
    while topics:
        eye = Jobs(design.graph).source_sensor(topics)
        trace = trace_messages(design, [design.graph.topic(eye)], [t.name for t in topics])
        if not trace.is_enough:
            raise lost or trace.finding(f"{'a scan' if eye == SCAN else 'an image'} on {eye}")
        reached = [t for t in topics if design.tracer.seen_on([t.name], trace.arrived)]
        trace = trace_messages(design, reached, [MOTORS])
        if trace.is_enough:
            return trace
        lost = lost or trace.finding(f"a message on {as_phrase((t.name for t in reached), 'or')}")
        topics = [topic for topic in topics if topic not in reached]
    assert lost is not None
    raise lost


def trace_messages(design: ObservedDesign, topics: list[GraphTopic], wanted: list[str]) -> Trace:
    """Follow marked messages, while the other sensors go on and a goal is under way."""
    others = SENSORS.keys() - {topic.name for topic in topics}
    return design.tracer.trace_messages(
        topics, wanted, beside=design.inputs(others), goals=design.goals(ACTION)
    )


def require_stream(design: ObservedDesign, trace: Trace) -> None:
    """Fail if what arrived at the motors came by no topic that their node reads: it was asked for.

    A node that carries out goals gets it with these.
    """
    drivers = Jobs(design.graph).controllers
    by_goal = any(drivers & action.servers for action in design.graph.actions.values())
    last = [t for t in design.graph.topics.values() if t.writers and t.read_by & drivers]
    if by_goal or not last or not all(is_installed(topic.types) for topic in last):
        return
    if not design.tracer.await_mark([topic.name for topic in last], trace.arrived):
        raise Failed(
            expected=f"Obstacle information gets to {MOTORS} over topics or action goals.",
            actual=f"Its mark was seen on {MOTORS}, but on no topic that {name_nodes(drivers)} "
            f"reads ({as_phrase(topic.name for topic in last)}): it came with a request of a "
            "service, or an answer, only when somebody asked.",
        )
