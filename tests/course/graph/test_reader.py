"""The graph is read off DDS: endpoints, QoS, services, actions, and what does not connect."""

from __future__ import annotations

import pytest
from rclpy.action import ActionServer
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import (
    DurabilityPolicy,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
    qos_profile_sensor_data,
)
from std_msgs.msg import String
from std_srvs.srv import SetBool
from test_msgs.action import Fibonacci
from test_msgs.msg import Empty

from course import Session
from course.graph import graph_text, reader
from course.graph.mermaid import draw_mermaid
from course.views.graph import MAX_BOXES, GraphView

RELIABLE = QoSProfile(depth=10)
BEST_EFFORT = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)


def talker(qos: QoSProfile, name: str = "talker", msg_type: type = String) -> Node:
    node = Node(name)
    node.create_publisher(msg_type, "chatter", qos)
    return node


def listener(qos: QoSProfile, name: str = "listener") -> Node:
    node = Node(name)
    node.create_subscription(String, "chatter", lambda _message: None, qos)
    return node


def test_topics_have_their_endpoints_with_qos_and_depth(session: Session) -> None:
    session.run(talker, QoSProfile(depth=7))
    session.run(listener, BEST_EFFORT)
    view = GraphView(session)
    (topic,) = session.until(lambda: [t for t in view.graph.topics if len(t.subscriptions) == 1])
    (publisher,), (subscription,) = topic.publishers, topic.subscriptions
    assert (topic.name, topic.types) == ("/chatter", ("std_msgs/msg/String",))
    assert (publisher.node, publisher.qos["depth"]) == ("/talker", "7")
    assert graph_text.describe_qos(subscription) == "BEST_EFFORT, VOLATILE, KEEP_LAST(1)"
    assert topic.mismatches == ()


def test_services_and_actions_have_both_sides(session: Session) -> None:
    def robot() -> Node:
        node = Node("robot")
        node.create_service(SetBool, "lamp", lambda _request, response: response)
        node.create_client(SetBool, "lamp")
        node.navigate = ActionServer(node, Fibonacci, "navigate", lambda goal: Fibonacci.Result())
        return node

    session.run(robot)
    graph = GraphView(session).graph
    (service,), (action,) = graph.services, graph.actions
    assert (service.name, service.servers, service.clients) == ("/lamp", ("/robot",), ("/robot",))
    assert (action.name, action.type) == ("/navigate", "test_msgs/action/Fibonacci")
    assert graph.topics == (), "the topics of an action, /rosout and the like are plumbing"
    text = graph_text.describe_graph(graph)
    assert "action /navigate (test_msgs/action/Fibonacci)\n  served by /robot" in text


@pytest.mark.parametrize(
    ("offered", "requested", "policy"),
    [
        (qos_profile_sensor_data, RELIABLE, "RELIABILITY"),
        (
            RELIABLE,
            QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL),
            "DURABILITY",
        ),
        (RELIABLE, QoSProfile(depth=1, deadline=Duration(seconds=1)), "DEADLINE"),
        (
            RELIABLE,
            QoSProfile(depth=1, liveliness=LivelinessPolicy.MANUAL_BY_TOPIC),
            "LIVELINESS",
        ),
    ],
)
@pytest.mark.parametrize("order", ["view, reader, writer", "writer, reader, view", "remote writer"])
def test_ddss_own_event_names_what_breaks_a_pair(
    session: Session, offered: QoSProfile, requested: QoSProfile, policy: str, order: str
) -> None:
    view = GraphView(session)
    with Session(domain_id=session.domain_id) as other:
        if order == "view, reader, writer":
            assert view.widget.number
            session.run(listener, requested)
            assert view.graph.mismatches == ()
            session.run(talker, offered)
        elif order == "writer, reader, view":
            session.run(talker, offered)
            session.run(listener, requested)
            session.until(lambda: reader.read_graph(session.observer).mismatches)
            view = GraphView(session)
        else:
            other.run(talker, offered)
            session.run(listener, requested)
        check_event(session, view, policy)


def check_event(session: Session, view: GraphView, policy: str) -> None:
    ((topic, pair),) = session.until(
        lambda: [found for found in view.graph.mismatches if found[1].from_event]
    )
    assert (topic, pair.publisher, pair.subscription) == ("/chatter", "/talker", "/listener")
    assert pair.policies == (policy,)
    assert f"{policy.lower()} (" in view.words()
    assert "DDS reports it." in view.words()


def test_a_publisher_hears_of_a_subscription_made_from_a_cell_and_in_another_process(
    session: Session,
) -> None:
    node = session.run(talker, BEST_EFFORT)
    with Session(domain_id=session.domain_id) as other:
        other.run(listener, RELIABLE)
        view = GraphView(session)
        check_event(session, view, "RELIABILITY")
    session.until(lambda: view.graph.mismatches == ())
    node.create_subscription(String, "chatter", lambda _message: None, RELIABLE)
    session.until(lambda: view.graph.mismatches)
    session.until(lambda: view.graph.mismatches[0][1].from_event)


def test_a_pair_that_was_there_before_is_told_from_the_announced_qos(session: Session) -> None:
    session.run(talker, BEST_EFFORT)
    session.run(listener, RELIABLE)
    graph = session.until(lambda: _with_mismatch(session))
    ((_, pair),) = graph.mismatches
    assert pair.reasons == ("offers BEST_EFFORT, requests RELIABLE",)


def _with_mismatch(session: Session) -> reader.Graph | None:
    graph = reader.read_graph(session.observer)
    return graph if graph.mismatches else None


def test_a_type_clash_is_a_mismatch(session: Session) -> None:
    session.run(talker, RELIABLE)
    with Session(domain_id=session.domain_id) as other:
        other.run(talker, RELIABLE, "other", Empty)
        session.run(listener, RELIABLE)
        graph = session.until(lambda: _with_mismatch(session))
    ((_, pair),) = graph.mismatches
    assert pair.policies == ("TYPE",)
    assert pair.publisher == "/other"


def test_two_nodes_of_one_name_are_told(session: Session) -> None:
    for _ in range(2):
        session.run_beside(lambda: talker(RELIABLE))
    graph = session.until(lambda: _with_twins(session))
    assert graph.duplicate_names == ("/talker",)
    assert "Two nodes are called /talker: rename one." in graph_text.describe_graph(graph)


def _with_twins(session: Session) -> reader.Graph | None:
    graph = reader.read_graph(session.observer)
    return graph if graph.duplicate_names else None


def test_the_mermaid_text_names_everything_once_and_marks_what_is_broken(session: Session) -> None:
    view = GraphView(session)
    session.run(listener, RELIABLE)
    session.run(talker, BEST_EFFORT)
    session.until(lambda: view.graph.mismatches)
    assert view.make_frame()["title"] == "2 nodes, 1 topic, 1 pair that does not connect"
    text = str(view.mermaid)
    assert text == draw_mermaid(view.graph)
    assert text.splitlines()[0] == "flowchart LR"
    for name in ("/talker", "/listener", "/chatter<br/>String"):
        assert text.count(name) == 1
    assert '-. "reliable · volatile · 10<br/>reliability does not fit" .-x' in text
    assert "linkStyle 0,1 stroke:#c00" in text, "the whole way is red"
    assert view.mermaid._repr_mimebundle_()["text/vnd.mermaid"] == text


def test_an_empty_graph_is_said(session: Session) -> None:
    assert GraphView(session).words() == "No nodes."


def crowd(count: int) -> Node:
    node = Node("crowd")
    for number in range(count):
        node.create_publisher(String, f"topic_{number}", 10)
    return node


def test_a_graph_too_large_to_draw_is_said_and_its_words_keep_all(session: Session) -> None:
    view = GraphView(session)
    session.run(crowd, MAX_BOXES)
    session.until(lambda: len(view.graph.topics) == MAX_BOXES)
    frame, text = view.look()
    assert frame["boxes"] == ()
    assert (
        f"This graph has {MAX_BOXES + 1} boxes (nodes: 1, topics: {MAX_BOXES}, serv"
        in frame["note"]
    )
    assert "stop the nodes that you do not need" in frame["note"]
    assert "everything" not in frame["note"]
    for number in range(MAX_BOXES):
        assert f"topic /topic_{number} (std_msgs/msg/String)" in text
    assert "leave out everything=True" in GraphView(session, everything=True).make_frame()["note"]
    session.stop("crowd")
    session.run(crowd, 3)
    session.until(lambda: len(view.graph.topics) == 3)
    assert (view.make_frame()["note"], len(view.make_frame()["boxes"])) == ("", 4)
