"""The ROS graph as data: where information can flow, and what does not connect."""

from __future__ import annotations

from contextlib import suppress

from nav_msgs.srv import GetPlan
from rclpy.qos import QoSProfile, ReliabilityPolicy

from autograder.observe.examiner.quiet_node import QuietNode
from autograder.observe.graph.graph_reader import read_graph
from autograder.observe.graph.link_faults import find_link_faults
from autograder.observe.graph.ros_graph import End, GraphService, GraphTopic
from course import Design, Session
from course.errors import WaitTimeout
from tests.autograder.observe.graphs import ARRAY, SCAN, TWIST, graph, topic


def test_information_flows_along_the_kinds_that_are_asked_for() -> None:
    seen = graph(
        topic("/scan", SCAN, "lidar", "navigation"),
        services=[GraphService("/plan", "", {"/planner"}, {"/navigation"})],
        actions=[GraphService("/follow", "", {"/controller"}, {"/navigation"})],
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


def test_only_endpoints_that_came_later_are_new() -> None:
    velocity = topic("/velocity", TWIST, "navigation", "controller")
    plan = GraphService("/plan", "", {"/planner"}, {"/navigation"})
    earlier = graph(velocity, topic("/path", ARRAY, "navigation", ""), services=[plan])
    later = graph(
        velocity,
        topic("/goal", ARRAY, "", "planner"),
        services=[plan, GraphService("/reset", "", set(), {"/controller"})],
    )
    assert find_link_faults(later.added_since(earlier)) == [
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
            examiner.until(lambda: find_link_faults(read_graph(reader)) == told, timeout=20)
        assert find_link_faults(read_graph(reader)) == told


def test_ends_that_disagree_about_a_type_are_a_fault() -> None:
    text = End("/display", "std_msgs/msg/String")
    velocity = topic("/velocity", TWIST, "navigation", "controller")
    clash = GraphTopic(velocity.name, velocity.writers, (*velocity.readers, text))
    (fault,) = find_link_faults(graph(clash))
    assert fault == f"/velocity has more than one type: {TWIST} and std_msgs/msg/String."
