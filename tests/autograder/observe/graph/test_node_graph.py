"""What a node lacks on the graph, what is left of it, and what is an earlier one's."""

from __future__ import annotations

from typing import Any

from rclpy.node import Node
from std_msgs.msg import Int32, String
from std_srvs.srv import Trigger

from autograder.observe.examiner.quiet_node import QuietNode
from autograder.observe.graph.node_graph import NodeGraph, node_phrase
from autograder.observe.nouns import Service, Topic
from autograder.observe.participants import NAMELESS
from course import Session

COUNT, RESET = Topic("count", Int32), Service("reset", Trigger)


def answer(request: Any, response: Any) -> Any:
    """Answer at once."""
    return response


def test_what_is_missing_what_is_there_and_what_is_a_ghost() -> None:
    with Session() as session:
        eyes = session.run(QuietNode, "eyes")
        counter = session.run(Node, "counter")
        graph = NodeGraph(eyes, publishes=[COUNT], serves=[RESET])
        assert graph.list_missing("/counter") == [
            "There is no publisher on count on the graph.",
            "There is no service reset on the graph.",
        ]
        counter.create_publisher(String, "count", 1)
        counter.create_service(Trigger, "reset", answer)
        session.until(lambda: len(graph.list_endpoints("/counter")) == 3)
        assert graph.list_missing("/counter") == [
            "There is a publisher on count of the type std_msgs/msg/String, not std_msgs/msg/Int32."
        ]
        assert graph.list_endpoints("/counter") == [
            "a publisher on count",
            "a service reset",
            "the node /counter",
        ]
        graph.ignore_present()
        assert graph.list_endpoints("/counter") == []
        counter.create_publisher(String, "count", 1)
        session.until(lambda: graph.count("a publisher on count") == 1)


def test_only_nodes_beside_those_that_were_started_are_listed() -> None:
    with Session() as session:
        eyes = session.run(QuietNode, "eyes")
        graph = NodeGraph(eyes)
        session.run(Node, "counter")
        session.run(Node, "mark_1")
        assert graph.list_nodes() == []
        graph.note_started("/counter")
        graph.note_mark("mark_1")
        session.until(lambda: {*graph.list_nodes()} == {"/eyes", "/counter"})


def test_a_node_whose_name_is_forgotten_is_told_by_what_it_publishes() -> None:
    assert "its publisher on /parameter_events" in node_phrase(f"/{NAMELESS}")
