"""Exercise 2: the node architecture of a robot that drives to waypoints and avoids obstacles.

The design's nodes come up for real, and everything is read off the ROS graph: who publishes, reads,
serves and calls what. Nodes and topics inside the robot may be called anything, split and merged as
the task allows; only the robot's boundary has fixed names.
"""

from __future__ import annotations

from autograder.examination.check_context import StudentError
from autograder.examination.exam import Exam, Failed
from autograder.exercises.architecture.link_faults import (
    describe_substitute,
    is_carried,
    join_names,
    link_faults,
    name_all_nodes,
    name_nodes,
    similar_name,
    why_no_obstacles,
    why_no_planner,
    why_no_pose,
)
from autograder.exercises.architecture.rig import ArchitectureRig, architecture_rig
from autograder.exercises.architecture.robot_roles import (
    ACTION,
    MOTORS,
    MOTORS_TYPE,
    SENSORS,
    STREAMS,
    WHEELS,
)
from autograder.exercises.architecture.traces import (
    describe_lost_mark,
    error_note,
    require_plans,
    see_scan_arrive,
)
from autograder.exercises.architecture.tracing import POURS, GoalRejectedError
from autograder.observe.marked_types import TypeNotInstalledError, load_type
from course.design import message_tags
from course.errors import WaitTimeout

EXAM: Exam[ArchitectureRig] = Exam("architecture", architecture_rig)

MOST_JOBS = 2

READ_NODES = "Chapter 5, “Nodes: the processing units”"
READ_TOPICS = "Chapter 5, “Topics: continuous data sharing”"
READ_SERVICES = "Chapter 5, “Services: synchronous request-response”"
READ_ACTIONS = "Chapter 5, “Actions: long-running operations with feedback”"
READ_PATTERNS = "Chapter 5, “When to use what”"


@EXAM.check(
    hints=(
        "Run the cell with your design again: does it end without an error?",
        "Try it beside the check: `design.run()` brings every node up in this notebook.",
        "The variable must be called `design`, and every name may carry one type only.",
    ),
    read=READ_NODES,
)
def design_runs(rig: ArchitectureRig) -> str:
    """Every node of the design comes up on the ROS graph.

    An architecture on paper never fails. What cannot be brought up cannot drive either.
    """
    try:
        rig.start()
    except StudentError as error:
        raise Failed(
            expected="The notebook has a `design` whose nodes all come up.",
            actual=error.feedback_text,
        ) from None
    if not rig.graph.nodes:
        raise Failed(
            expected="The notebook has a `design` whose nodes all come up.",
            actual="No node appeared on the ROS graph.",
        )
    return f"On the graph: {name_nodes(rig.graph.nodes)}."


@EXAM.check(
    needs=("design_runs",),
    hints=(
        "Which sensors does the robot have, and which node speaks for each of them?",
        "A driver reads no topic: it publishes what the hardware delivers.",
        "Publish /scan as LaserScan, /camera/image as Image and /wheel/odometry as Odometry.",
    ),
    read=READ_TOPICS,
)
def drivers_publish(rig: ArchitectureRig) -> None:
    """Drivers publish the readings of LIDAR, camera and wheel encoders.

    Everything the robot knows begins here. A driver that only drives can be swapped for another
    LIDAR, a simulator or a recording, and no other node notices.
    """
    faults = []
    for name, wanted in SENSORS.items():
        types = {end.type for end in rig.graph.get_topic(name).writers}
        if not types:
            faults.append(f"Nobody publishes on {name}{similar_name(name, rig.graph)}.")
        elif wanted not in types:
            faults.append(f"{name} is published as {', '.join(sorted(types))}, not as {wanted}.")
    if faults:
        raise Failed(
            expected="Each of the three sensors has a node that publishes its readings.",
            actual=" ".join(faults),
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
def navigation_action(rig: ArchitectureRig) -> None:
    """Navigation is an action server that sensor data reaches.

    Driving to a waypoint takes a while, wants feedback and must be stoppable: a service call would
    leave its caller waiting. And a navigator that hears of no sensor drives blind.
    """
    expected = "One node is the server of /navigate_to, and topics bring it what the sensors see."
    servers = rig.jobs.navigators
    if not servers:
        raise Failed(
            expected=expected, actual=f"No node is its server{describe_substitute(rig.graph)}."
        )
    if len(servers) > 1:
        raise Failed(
            expected=expected, actual=f"It has {len(servers)} servers: {name_nodes(servers)}."
        )
    if not rig.jobs.informed_navigators:
        raise Failed(
            expected=expected,
            actual=f"{name_nodes(servers)} is the server, but no topic brings it readings, "
            "obstacle information or the pose: it would drive blind.",
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
    read=READ_TOPICS,
)
def obstacle_information(rig: ArchitectureRig) -> str:
    """Obstacle detection turns sensor topics into obstacle information that steers the robot.

    Detection runs at the rate of the sensors, navigation at its own. In a node of its own it can be
    tested with recorded scans, improved and restarted while the robot goes on.
    """
    found = rig.jobs.obstacle_topics
    if not found:
        raise Failed(
            expected="A node reads /scan or /camera/image and publishes on a topic what is in the "
            "way; another node reads that, and it leads to the motors.",
            actual=why_no_obstacles(rig.jobs),
        )
    return " ".join(is_carried(topic) for topic in found[:3])


@EXAM.check(
    needs=("design_runs",),
    hints=(
        "How does the robot know where it is, and who tells the other nodes?",
        "State estimation subscribes to sensors and publishes the pose on a topic of its own.",
        "For example: state_estimation subscribes to wheel/odometry and publishes pose as "
        "PoseStamped or PoseWithCovarianceStamped.",
    ),
    read=READ_TOPICS,
)
def pose_published(rig: ArchitectureRig) -> None:
    """State estimation reads sensors and publishes the robot's pose.

    Wheels slip: the pose is estimated from several sensors, many times a second. Navigation,
    planning and displays all need the same pose, so one node publishes it for everyone.
    """
    if not rig.jobs.pose_topics:
        raise Failed(
            expected="A node that reads sensors publishes the pose, as Odometry or one of the Pose "
            "types, on a topic other than /wheel/odometry.",
            actual=why_no_pose(rig.jobs),
        )
    poses = [topic.name for topic in rig.jobs.pose_topics]
    if rig.jobs.pose_of_wheels and not rig.has_pose_estimate(poses):
        raise Failed(
            expected="While the wheel encoders report, the pose is published.",
            actual=f"Odometry came in on {WHEELS}, and nothing was ever published on "
            f"{join_names(poses, 'or')}{error_note(rig)}.",
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
def planner_service(rig: ArchitectureRig) -> None:
    """A path-planning service knows the map and gets the goal.

    A path is needed when there is a goal, not ten times a second: one request, one answer. In a
    node of its own the planner may take its time while the robot goes on avoiding obstacles.
    """
    if reasons := why_no_planner(rig.jobs):
        raise Failed(
            expected="A node that reads the map serves path planning; another node, which has the "
            "goal, calls it.",
            actual=reasons,
        )


@EXAM.check(
    needs=("design_runs",),
    hints=(
        "Which node has the last word on how fast each wheel turns?",
        "One node, and only one, publishes on motors/command; it follows what navigation says.",
        "For example: controller subscribes to velocity, which navigation publishes, and publishes "
        "motors/command as Twist.",
    ),
    read=READ_TOPICS,
)
def motors_driven(rig: ArchitectureRig) -> None:
    """One controller drives the motors, by order of navigation.

    Two nodes that both command the motors make a robot that jerks between two wills; one that
    listens to nobody drives past every goal.
    """
    expected = "One node publishes /motors/command as Twist, and navigation leads to it."
    drivers = rig.jobs.controllers
    types = {end.type for end in rig.graph.get_topic(MOTORS).writers}
    if not drivers:
        raise Failed(
            expected=expected,
            actual=f"Nobody publishes on {MOTORS}{similar_name(MOTORS, rig.graph)}.",
        )
    if types != {MOTORS_TYPE}:
        raise Failed(expected=expected, actual=f"It is published as {join_names(sorted(types))}.")
    if len(drivers) > 1:
        raise Failed(expected=expected, actual=f"{name_all_nodes(drivers)} command the motors.")
    if twins := drivers & rig.graph.namesakes:
        raise Failed(
            expected=expected, actual=f"Two nodes called {name_nodes(twins)} command them."
        )
    if not drivers & rig.jobs.goal_reaches:
        raise Failed(
            expected=expected,
            actual=f"{name_nodes(drivers)} drives the motors, but nothing leads there from the "
            f"server of {ACTION}.",
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
def links_connect(rig: ArchitectureRig) -> None:
    """Every topic has a writer and a reader, every call a server, and DDS connects them.

    A wrong name or profile raises no error in ROS 2: the link simply stays silent, and you look for
    the mistake everywhere else.
    """
    faults = link_faults(rig.graph)
    if not any(rig.graph.iterate_links(("topic",))):
        faults.append("No topic leads from one node to another.")
    if faults:
        more = f" And {len(faults) - 4} more." if len(faults) > 4 else ""
        raise Failed(
            expected=f"Nothing dangles, apart from {MOTORS} and {ACTION} at the robot's boundary.",
            actual=" ".join(faults[:4]) + more,
        )


@EXAM.check(
    needs=("obstacle_information", "motors_driven"),
    hints=(
        "Follow the obstacle information to the motors: is there a node that has to ask for it?",
        "An answer is as old as the question. What changes all the time is pushed, not fetched.",
        "Put topics (or action goals) all the way from the obstacle information to the controller.",
    ),
    read=READ_PATTERNS,
)
def streams_are_topics(rig: ArchitectureRig) -> None:
    """What is in the way reaches the motors as a stream, not by asking.

    A robot that asks once a second whether the way is free has driven half a metre between two
    questions, and if the answer is late it stands still or, worse, drives on.
    """
    if not any(rig.jobs.leads_to_motors(topic, STREAMS) for topic in rig.jobs.obstacle_topics):
        raise Failed(
            expected=f"From the obstacle information to {MOTORS} there are topics (or action "
            "goals) all the way.",
            actual=f"{join_names([t.name for t in rig.jobs.obstacle_topics])} gets there only by "
            f"way of the service {join_names(rig.jobs.services_on_the_way(), 'or')}.",
        )


@EXAM.check(
    needs=(
        "drivers_publish",
        "navigation_action",
        "obstacle_information",
        "pose_published",
        "planner_service",
        "motors_driven",
    ),
    hints=(
        "Which node would you have to change for a new LIDAR, and which for a new motor?",
        "List for each node which of the six jobs it does.",
        "Split the node that is named above, until no node does more than two of the jobs.",
    ),
    read=READ_NODES,
)
def jobs_divided(rig: ArchitectureRig) -> None:
    """No node does everything: each takes on at most two of the robot's six jobs.

    A node that does it all cannot be tested in parts, and when it fails the whole robot fails.
    """
    busy = {n: jobs for n, jobs in rig.jobs.of_each_node().items() if len(jobs) > MOST_JOBS}
    if busy:
        raise Failed(
            expected="No node drives sensors, estimates, detects, plans, navigates and controls: "
            "two of these jobs at most.",
            actual=" ".join(f"{name_nodes([n])} {join_names(jobs)}." for n, jobs in busy.items()),
        )


@EXAM.check(
    needs=("navigation_action", "motors_driven", "links_connect"),
    hints=(
        "Follow the goal from navigate_to from node to node: which one does not pass it on?",
        "Each link on the way must carry data: a message without a number or a text cannot.",
        "If you wrote nodes yourself, let them call `course.design.carry(received, sent)`.",
    ),
    read=READ_PATTERNS,
)
def goal_reaches_motors(rig: ArchitectureRig) -> None:
    """A navigation goal that goes in comes out at the motors.

    This is the dye test: each node passes on marked messages, and the mark of a goal has to arrive
    at the motors. Lines on a drawing carry nothing; links do.
    """
    expected = f"The mark of a goal sent to {ACTION} is seen on {MOTORS}."
    name = rig.graph.get_action(ACTION).type
    try:
        action_type = load_type(name)
    except TypeNotInstalledError:
        raise Failed(
            expected=expected,
            actual=f"{ACTION} is of type {name}, which is not installed where the examiner runs.",
        ) from None
    if not message_tags.has_room(action_type.Goal):
        raise Failed(expected=expected, actual=f"A goal of {name} holds neither number nor text.")
    try:
        poured = rig.colour_goal(ACTION, action_type, [MOTORS])
    except WaitTimeout as timeout:
        raise Failed(expected=expected, actual=str(timeout)) from None
    except GoalRejectedError:
        raise Failed(
            expected=expected,
            actual=f"The server of {ACTION} rejected each of {POURS} goals, with sensor readings "
            "coming in between.",
        ) from None
    if not poured.enough and not (poured.arrived and poured.turned_away):
        raise Failed(expected=expected, actual=describe_lost_mark(rig, poured, [MOTORS]))
    if poured.turned_away:
        raise Failed(
            expected=f"The server of {ACTION} takes a goal whenever the one before is over.",
            actual=f"It took a goal, and after that was over it rejected "
            f"{'the next' if poured.turned_away == 1 else f'{poured.turned_away} others'}.",
        )
    require_plans(rig)


@EXAM.check(
    needs=("drivers_publish", "obstacle_information", "motors_driven", "links_connect"),
    hints=(
        "Follow a scan from /scan to the obstacle information, and from there to the motors.",
        "Somewhere a node reads and does not write, or a message has no room for what it says.",
        "If you wrote nodes yourself, let them call `course.design.carry(received, sent)`; make "
        "all of their endpoints in the constructor.",
    ),
    read=READ_PATTERNS,
)
def scan_reaches_motors(rig: ArchitectureRig) -> None:
    """A scan becomes obstacle information, and that reaches the motors.

    The second dye test: a scan that never gets to the motors is an obstacle that the robot hits.
    """
    topics = {topic.name: topic for topic in rig.jobs.obstacle_topics if rig.knows_type(topic)}
    if not topics:
        topic = rig.jobs.obstacle_topics[0]
        raise Failed(
            expected="Obstacle information has a message type that is installed.",
            actual=f"{topic.name} is of type {join_names(topic.types)}, unknown to the examiner.",
        )
    see_scan_arrive(rig, topics)
    if faults := rig.new_faults():
        raise Failed(
            expected="Every endpoint is there as soon as its node is, and those that come later "
            "keep to the same rules.",
            actual=f"While marks were poured in, this was new on the graph: {' '.join(faults[:4])}",
        )
