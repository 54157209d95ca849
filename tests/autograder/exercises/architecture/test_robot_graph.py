"""The robot's graph: read off real nodes whole, and reasoned about as data."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from typing import Any

import pytest
from geometry_msgs.msg import Twist
from nav_msgs.srv import GetPlan
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Bool
from test_msgs.action import Fibonacci

from autograder.examination.subject.server import SubjectServer
from autograder.exercises.architecture.link_faults import link_faults, why_no_obstacles
from autograder.exercises.architecture.robot_graph import End, Offer, RobotGraph, Topic, read_graph
from autograder.exercises.architecture.robot_roles import Jobs
from autograder.observe.quiet_node import QuietNode
from course import Design, Session
from course.errors import WaitTimeout

QOS = QoSProfile(depth=1)


def topic(name: str, kind: str, writers: str, readers: str) -> Topic:
    def ends(nodes: str) -> tuple[End, ...]:
        return tuple(End(f"/{node}", kind, QOS) for node in nodes.split())

    return Topic(name, ends(writers), ends(readers))


def graph(*topics: Topic, services: Any = (), actions: Any = ()) -> RobotGraph:
    nodes = {end.node for t in topics for end in (*t.writers, *t.readers)}
    for offer in (*services, *actions):
        nodes |= offer.servers | offer.clients
    return RobotGraph(
        frozenset(nodes),
        {t.name: t for t in topics},
        {o.name: o for o in services},
        {o.name: o for o in actions},
    )


SCAN, ARRAY, TWIST = (
    "sensor_msgs/msg/LaserScan",
    "geometry_msgs/msg/PoseArray",
    "geometry_msgs/msg/Twist",
)


def test_everything_of_a_design_is_read_and_nothing_of_the_infrastructure() -> None:
    with Session() as subject, Session(domain_id=subject.domain_id) as examiner:
        design = Design()
        design.node("lidar", namespace="front").publishes("/scan", LaserScan)
        design.node("navigation").subscribes("scan", LaserScan).action_server(
            "go", Fibonacci
        ).calls("plan", GetPlan)
        design.node("planner").serves("plan", GetPlan).action_client("go", Fibonacci)
        subject.run(Node, "with_parameters_and_a_log")
        design.run(subject)
        reader = examiner.run(QuietNode, "examiner")
        harness = SubjectServer(lambda *_: subject, {})
        assert harness._answer({"op": "mark", "name": "_mark_1"})["ok"]
        examiner.until(
            lambda: reader.count_publishers("/_mark_1") and reader.count_subscribers("/_mark_1"),
            timeout=20,
        )
        examiner.until(partial(complete, reader), timeout=20)
        seen = read_graph(reader, ["/_mark_1"])
        assert seen.nodes == {
            "/front/lidar", "/navigation", "/planner", "/with_parameters_and_a_log"
        }  # fmt: skip
        assert seen.topics == {"/scan": topic("/scan", SCAN, "front/lidar", "navigation")}
        assert seen.services == {
            "/plan": Offer("/plan", "nav_msgs/srv/GetPlan", {"/planner"}, {"/navigation"})
        }
        assert seen.actions == {
            "/go": Offer("/go", "test_msgs/action/Fibonacci", {"/navigation"}, {"/planner"})
        }


def complete(reader: Node) -> bool:
    """Whether the marker's endpoints are known by their node's name."""
    ends = reader.get_publishers_info_by_topic("/_mark_1")
    ends += reader.get_subscriptions_info_by_topic("/_mark_1")
    return [end.node_name for end in ends] == ["_mark_1"] * 2


def test_information_flows_along_the_kinds_that_are_asked_for() -> None:
    seen = graph(
        topic("/scan", SCAN, "lidar", "navigation"),
        services=[Offer("/plan", "", {"/planner"}, {"/navigation"})],
        actions=[Offer("/follow", "", {"/controller"}, {"/navigation"})],
    )
    assert seen.reachable_nodes({"/lidar"}, ("topic",)) == {"/lidar", "/navigation"}
    assert "/planner" in seen.reachable_nodes({"/lidar"}, ("topic", "request"))
    assert "/controller" in seen.reachable_nodes({"/lidar"}, ("topic", "goal"))
    assert seen.reachable_nodes({"/planner"}, ("topic", "request")) == {"/planner"}
    assert "/navigation" in seen.reachable_nodes({"/planner"}, ("response",))
    assert "/navigation" in seen.reachable_nodes({"/controller"}, ("feedback",))


def test_a_cycle_ends() -> None:
    seen = graph(topic("/a", TWIST, "x", "y"), topic("/b", TWIST, "y", "x"))
    assert seen.reachable_nodes({"/x"}, ("topic",)) == {"/x", "/y"}


def test_a_filtered_scan_is_still_a_scan() -> None:
    jobs = Jobs(
        graph(
            topic("/scan", SCAN, "lidar", "filter"),
            topic("/scan/filtered", SCAN, "filter", "detector"),
            topic("/obstacles", ARRAY, "detector", "controller"),
            topic("/motors/command", TWIST, "controller", ""),
        )
    )
    assert [t.name for t in jobs.obstacle_topics] == ["/obstacles"]


@pytest.mark.parametrize(
    ("kind", "readers"),
    [
        (SCAN, "controller"),
        (TWIST, "controller"),
        ("geometry_msgs/msg/PoseStamped", "controller"),
        (f"std_msgs/msg/{Bool.__name__}", "controller"),
        (ARRAY, "display"),
        (ARRAY, "detector"),
        (ARRAY, ""),
    ],
)
def test_not_everything_that_a_detector_publishes_is_obstacle_information(
    kind: str, readers: str
) -> None:
    jobs = Jobs(
        graph(
            topic("/scan", SCAN, "lidar", "detector"),
            topic("/obstacles", kind, "detector", readers),
            topic("/motors/command", TWIST, "controller", ""),
        )
    )
    assert jobs.obstacle_topics == []


def test_a_map_is_known_by_topic_by_service_and_by_costmap() -> None:
    grid = "nav_msgs/msg/OccupancyGrid"
    jobs = Jobs(
        graph(
            topic("/map", grid, "server", "costmap localization"),
            topic("/costmap", grid, "costmap", "planner"),
            topic("/pose", "geometry_msgs/msg/PoseStamped", "localization", "display"),
            services=[Offer("/map/get", "nav_msgs/srv/GetMap", {"/server"}, {"/other"})],
        )
    )
    assert jobs.map_readers == {"/costmap", "/localization", "/planner", "/other"}


def test_without_a_navigator_the_goal_gets_where_anything_leads_from_another_node() -> None:
    command = topic("/motors/command", TWIST, "lone controller", "")
    own = topic("/scan", SCAN, "lone", "lone")
    jobs = Jobs(graph(own, topic("/velocity", TWIST, "planner", "controller"), command))
    assert jobs.controllers == {"/lone", "/controller"}
    assert jobs.goal_reaches == {"/controller"}


def test_only_services_on_the_way_to_the_motors_are_named() -> None:
    jobs = Jobs(
        graph(
            topic("/scan", SCAN, "lidar", "detector"),
            topic("/obstacles", ARRAY, "detector", "navigation"),
            topic("/motors/command", Twist.__name__, "controller", ""),
            services=[
                Offer("/plan", "", {"/planner"}, {"/navigation"}),
                Offer("/set_velocity", "", {"/controller"}, {"/navigation"}),
            ],
        )
    )
    assert jobs.services_on_the_way() == ["/set_velocity"]
    assert not jobs.leads_to_motors(jobs.obstacle_topics[0], ("topic", "goal"))


def test_obstacle_information_that_is_asked_for_beside_a_log_is_told_so() -> None:
    topics = [
        topic("/scan", SCAN, "lidar", "detector"),
        topic("/obstacles", ARRAY, "detector", "log"),
        topic("/motors/command", TWIST, "controller", ""),
    ]
    asked = Offer("/nearest", "nav_msgs/srv/GetPlan", {"/detector"}, {"/controller"})
    told = why_no_obstacles(Jobs(graph(*topics, services=[asked])))
    assert "only by way of the service /nearest, which controller calls" in told
    asked.type = "std_srvs/srv/Trigger"
    told = why_no_obstacles(Jobs(graph(*topics, services=[asked])))
    assert told.endswith("/obstacles ends at log, from where nothing leads to /motors/command.")


def test_navigation_that_detects_beside_a_node_that_only_reads_is_named() -> None:
    jobs = Jobs(
        graph(
            topic("/scan", SCAN, "lidar", "navigation log"),
            topic("/obstacles", ARRAY, "navigation", "controller"),
            topic("/motors/command", TWIST, "controller", ""),
            actions=[Offer("/navigate_to", "", {"/navigation"})],
        )
    )
    assert why_no_obstacles(jobs).startswith("navigation, not log, publishes /obstacles: ")


def test_a_pose_that_comes_from_no_sensor_is_not_held_against_navigation() -> None:
    pose = "geometry_msgs/msg/PoseStamped"
    made_up = topic("/pose", pose, "estimator", "navigation")
    actions = [Offer("/navigate_to", "", {"/navigation"})]
    assert Jobs(graph(made_up, actions=actions)).informed_navigators == {"/navigation"}
    estimated = [
        topic("/wheel/odometry", "nav_msgs/msg/Odometry", "wheels", "odometer"),
        topic("/odometry", "nav_msgs/msg/Odometry", "odometer", "display"),
    ]
    assert not Jobs(graph(made_up, *estimated, actions=actions)).informed_navigators


def test_a_debugging_pose_is_not_held_against_a_busy_node() -> None:
    pose, odometry = "geometry_msgs/msg/PoseStamped", "nav_msgs/msg/Odometry"
    topics = [
        topic("/wheel/odometry", odometry, "driver", "estimator pilot"),
        topic("/pose", pose, "estimator", "pilot"),
        topic("/target", pose, "pilot", "display"),
        topic("/map", "nav_msgs/msg/OccupancyGrid", "server", "pilot"),
        topic("/motors/command", TWIST, "pilot", ""),
    ]
    services = [Offer("/plan", "", {"/pilot"}, {"/navigation"})]
    jobs = Jobs(graph(*topics, services=services)).of_each_node()
    assert jobs["/pilot"] == ["plans paths", "controls the motors"]
    assert jobs["/estimator"] == ["estimates the state"]
    alone = Jobs(graph(topics[0], *topics[2:], services=services)).of_each_node()
    assert alone["/pilot"] == ["estimates the state", "plans paths", "controls the motors"]


def test_ends_that_disagree_about_a_type_are_a_fault() -> None:
    text = End("/display", "std_msgs/msg/String", QOS)
    velocity = topic("/velocity", TWIST, "navigation", "controller")
    clash = Topic(velocity.name, velocity.writers, (*velocity.readers, text))
    (fault,) = link_faults(graph(clash))
    assert fault == f"/velocity has more than one type: {TWIST} and std_msgs/msg/String."


def test_only_endpoints_that_came_later_are_new() -> None:
    velocity = topic("/velocity", TWIST, "navigation", "controller")
    plan = Offer("/plan", "", {"/planner"}, {"/navigation"})
    earlier = graph(velocity, topic("/path", ARRAY, "navigation", ""), services=[plan])
    later = graph(
        velocity,
        topic("/goal", ARRAY, "", "planner"),
        services=[plan, Offer("/reset", "", set(), {"/controller"})],
    )
    assert link_faults(later.added_since(earlier)) == [
        "planner reads /goal, but nobody publishes on it.",
        "controller calls /reset, but no node is its server.",
    ]


def test_who_calls_a_service_that_offers_less_is_told() -> None:
    with Session() as subject, Session(domain_id=subject.domain_id) as examiner:
        less = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
        design = Design()
        design.node("navigation").calls("plan", GetPlan, less)
        design.node("planner").serves("plan", GetPlan)
        design.run(subject)
        reader = examiner.run(QuietNode, "examiner")
        told = [
            "navigation offers BEST_EFFORT on /plan, and planner requests RELIABLE, so DDS never "
            "connects them."
        ]
        # Its four endpoints come one by one, and what is there by then has faults of its own.
        with suppress(WaitTimeout):
            examiner.until(lambda: link_faults(read_graph(reader)) == told, timeout=20)
        assert link_faults(read_graph(reader)) == told


def test_two_nodes_of_one_name_are_told_apart_from_one() -> None:
    with Session() as subject, Session(domain_id=subject.domain_id) as examiner:
        for _ in range(2):
            subject.run_beside(partial(Node, "twin"))
        subject.run(Node, "single")
        reader = examiner.run(QuietNode, "examiner")
        examiner.until(lambda: read_graph(reader).namesakes, timeout=20)
        assert read_graph(reader).namesakes == {"/twin"}


def test_hidden_nodes_and_those_that_bear_the_examiners_name_count() -> None:
    with Session() as subject, Session(domain_id=subject.domain_id) as examiner:
        reader = examiner.run(QuietNode, "examiner")
        hidden, posing = (
            subject.run_beside(partial(Node, name, namespace=space))
            for name, space in (("_god", "/"), ("examiner", "/"))
        )
        hidden.create_publisher(Twist, "motors/command", 1)
        hidden.create_client(GetPlan, "plan")
        posing.create_subscription(Twist, "_motors/whispers", lambda _: None, 1)
        posing.create_service(GetPlan, "plan", lambda _, response: response)
        mine = reader.create_publisher(Twist, "motors/command", 1)

        def seen() -> RobotGraph:
            return read_graph(reader)

        examiner.until(lambda: seen().nodes == {"/_god", "/examiner"}, timeout=20)
        examiner.until(lambda: seen().get_topic("/_motors/whispers").readers, timeout=20)
        assert seen().get_topic("/motors/command").written_by == {"/_god"}
        assert seen().get_topic("/_motors/whispers").read_by == {"/examiner"}
        plan = Offer("/plan", "nav_msgs/srv/GetPlan", {"/examiner"}, {"/_god"})
        examiner.until(lambda: seen().services == {"/plan": plan}, timeout=20)
        assert not seen().namesakes
        reader.destroy_publisher(mine)


def test_one_name_in_two_participants_is_two_nodes() -> None:
    subject = Session()
    same = subject.domain_id
    with subject, Session(domain_id=same) as other, Session(domain_id=same) as examiner:
        for session in (subject, other):
            session.run(Node, "controller").create_publisher(Twist, "motors/command", 1)
        reader = examiner.run(QuietNode, "examiner")
        examiner.until(lambda: read_graph(reader).namesakes, timeout=20)
        assert read_graph(reader).namesakes == {"/controller"}
