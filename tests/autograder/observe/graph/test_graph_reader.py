"""The ROS graph is read off real nodes whole."""

from __future__ import annotations

from functools import partial

from geometry_msgs.msg import Twist
from nav_msgs.srv import GetPlan
from rclpy.node import Node
from sensor_msgs.msg import LaserScan
from test_msgs.action import Fibonacci

from autograder.examination.subject.server import SubjectServer
from autograder.observe.examiner.quiet_node import QuietNode
from autograder.observe.graph.graph_reader import read_graph
from autograder.observe.graph.ros_graph import GraphService, RosGraph
from course import Design, Session
from tests.autograder.observe.graphs import SCAN, topic


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
            "/plan": GraphService("/plan", "nav_msgs/srv/GetPlan", {"/planner"}, {"/navigation"})
        }
        assert seen.actions == {
            "/go": GraphService("/go", "test_msgs/action/Fibonacci", {"/navigation"}, {"/planner"})
        }


def complete(reader: Node) -> bool:
    """Whether the marker's endpoints are known by their node's name."""
    ends = reader.get_publishers_info_by_topic("/_mark_1")
    ends += reader.get_subscriptions_info_by_topic("/_mark_1")
    return [end.node_name for end in ends] == ["_mark_1"] * 2


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

        def seen() -> RosGraph:
            return read_graph(reader)

        examiner.until(lambda: seen().nodes == {"/_god", "/examiner"}, timeout=20)
        examiner.until(lambda: seen().topic("/_motors/whispers").readers, timeout=20)
        assert seen().topic("/motors/command").written_by == {"/_god"}
        assert seen().topic("/_motors/whispers").read_by == {"/examiner"}
        plan = GraphService("/plan", "nav_msgs/srv/GetPlan", {"/examiner"}, {"/_god"})
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
