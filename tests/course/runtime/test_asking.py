"""Asking the graph: next message, services, actions; and why nothing came."""

from __future__ import annotations

import threading

import pytest
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import Int32, String
from std_srvs.srv import SetBool
from test_msgs.action import Fibonacci

import course
from course.errors import SessionError, WaitTimeout

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
BEST_EFFORT = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)


@pytest.fixture
def node(any_session):
    return any_session.run(Node, "robot")


def test_next_message_gives_what_a_late_joiner_is_given(any_session, node):
    node.create_publisher(String, "map", LATCHED).publish(String(data="the map"))
    assert any_session.next_message(String, "map").data == "the map"


def test_next_message_fits_itself_to_a_best_effort_publisher(any_session, node):
    publisher = node.create_publisher(String, "images", BEST_EFFORT)
    node.create_timer(0.01, lambda: publisher.publish(String(data="image")))
    assert any_session.next_message(String, "/images").data == "image"


def test_next_message_waits_for_a_publisher_that_is_not_there_yet(any_session, node):
    def late():
        publisher = node.create_publisher(String, "map", LATCHED)
        publisher.publish(String(data="late"))

    timer = node.create_timer(0.1, lambda: (timer.cancel(), late()))
    assert any_session.next_message(String, "map").data == "late"


def test_next_message_crosses_participants(any_session, node):
    node.create_publisher(String, "map", LATCHED).publish(String(data="the map"))
    with course.Session(domain_id=any_session.domain_id) as outside:
        assert outside.next_message(String, "map", timeout=20.0).data == "the map"


def test_nobody_publishes_and_a_topic_of_a_similar_name_is_named(any_session, node):
    node.create_publisher(String, "camera/image", 10)
    with pytest.raises(WaitTimeout, match=r"Nobody publishes on /camera/imge \(is it /camera/imag"):
        any_session.next_message(String, "camera/imge", timeout=0.1)


def test_a_qos_that_does_not_fit_is_named_with_the_policy(any_session, node):
    node.create_publisher(String, "images", BEST_EFFORT)
    with pytest.raises(WaitTimeout, match=r"robot offers on /images does not fit.*[Rr]eliab"):
        any_session.next_message(String, "images", qos=10, timeout=0.1)


def test_another_type_is_named_at_once_and_silently(any_session, node, capfd):
    node.create_publisher(String, "images", 10)
    with pytest.raises(
        WaitTimeout, match=r"is of type std_msgs/msg/String, not std_msgs/msg/Int32\."
    ):
        any_session.next_message(Int32, "images", timeout=60.0)
    assert capfd.readouterr() == ("", "")


def test_a_silent_publisher_is_told_from_a_missing_one(any_session, node):
    node.create_publisher(String, "images", 10)
    with pytest.raises(WaitTimeout, match="1 publisher on /images with a QoS that fits, but noth"):
        any_session.next_message(String, "images", timeout=0.1)


@pytest.mark.parametrize("topic", ["two words", "1st", ""])
def test_what_is_no_topic_name_is_one_sentence(session, topic):
    with pytest.raises(SessionError, match=r"is not a topic name: topic name .*must not"):
        session.next_message(String, topic)


def test_call_returns_the_response(any_session, node):
    def answer(request, response):
        response.success = not request.data
        return response

    node.create_service(SetBool, "invert", answer)
    any_session.wait_for_service(SetBool, "invert")
    assert any_session.call(SetBool, "invert", SetBool.Request(data=False)).success is True


def test_a_service_that_is_not_there_is_one_sentence(any_session, node):
    node.create_service(SetBool, "set_mode", lambda request, response: response)
    with pytest.raises(WaitTimeout, match=r"Nobody offers /set_mood \(is it /set_mode\?\)"):
        any_session.wait_for_service(SetBool, "set_mood", timeout=0.1)


def test_asking_leaves_nothing_on_the_graph(any_session, node):
    node.create_service(SetBool, "set_mode", lambda request, response: response)
    node.create_publisher(String, "map", LATCHED).publish(String())
    any_session.call(SetBool, "set_mode", SetBool.Request())
    any_session.next_message(String, "map")
    any_session.until(lambda: not node.count_clients("/set_mode"))
    any_session.until(lambda: not node.count_subscribers("/map"))


def test_a_call_from_a_callback_of_the_only_thread_is_explained(session):
    errors = []

    class Waiter(Node):
        def __init__(self):
            super().__init__("waiter")
            self.create_service(SetBool, "mode", lambda request, response: response)
            self.timer = self.create_timer(0.01, self.ask)

        def ask(self):
            self.timer.cancel()
            try:
                session.call(SetBool, "mode", SetBool.Request(), timeout=0.2)
            except WaitTimeout as error:
                errors.append(str(error))

    session.run(Waiter)
    session.until(lambda: errors)
    assert "holds up all others: run with threads=2" in errors[0]


class Counter(Node):
    """Counts to the order of the goal, one feedback each; waits before the last if told to."""

    def __init__(self):
        super().__init__("counter")
        self.go_on = threading.Event()
        self.server = ActionServer(
            self,
            Fibonacci,
            "count",
            self.execute,
            goal_callback=lambda goal: (
                GoalResponse.REJECT if goal.order < 0 else GoalResponse.ACCEPT
            ),
            cancel_callback=lambda handle: CancelResponse.ACCEPT,
            callback_group=ReentrantCallbackGroup(),
        )

    def execute(self, handle: ServerGoalHandle) -> Fibonacci.Result:
        for number in range(handle.request.order):
            handle.publish_feedback(Fibonacci.Feedback(sequence=[number]))
        if handle.request.order >= 100:
            while not handle.is_cancel_requested and not self.go_on.wait(0.001):
                pass
        if handle.is_cancel_requested:
            handle.canceled()
            return Fibonacci.Result(sequence=[-1])
        handle.succeed()
        return Fibonacci.Result(sequence=list(range(handle.request.order)))


def test_a_goal_runs_to_its_result_with_every_feedback(any_session):
    any_session.run(Counter)
    heard = []
    goal = any_session.send_goal(
        Fibonacci, "count", Fibonacci.Goal(order=5), on_feedback=heard.append
    )
    assert goal.accepted
    assert list(goal.wait().sequence) == [0, 1, 2, 3, 4]
    assert [list(feedback.sequence) for feedback in goal.feedback] == [[0], [1], [2], [3], [4]]
    assert heard == goal.feedback
    assert (goal.status, goal.status.name, goal.done) == (4, "SUCCEEDED", True)
    assert repr(goal) == "<Goal on count: SUCCEEDED, 5 feedback messages>"


def test_a_goal_can_be_cancelled():
    with course.Session(threads=3) as session:
        session.run(Counter)
        goal = session.send_goal(Fibonacci, "count", Fibonacci.Goal(order=100))
        with pytest.raises(WaitTimeout, match=r"no result after 0\.1 s; its state is"):
            goal.wait(timeout=0.1)
        assert goal.cancel() is True
        assert list(goal.wait().sequence) == [-1]
        assert goal.status.name == "CANCELED"


def test_a_rejected_goal_has_no_result(any_session):
    any_session.run(Counter)
    goal = any_session.send_goal(Fibonacci, "count", Fibonacci.Goal(order=-1))
    assert (goal.accepted, goal.done, goal.wait(), goal.result) == (False, True, None, None)
    assert goal.cancel() is False
    assert "REJECTED" in repr(goal)


def test_a_server_that_refuses_to_cancel(any_session):
    class Stubborn(Counter):
        def __init__(self):
            super().__init__()
            self.server.register_cancel_callback(lambda handle: CancelResponse.REJECT)

    counter = any_session.run(Stubborn, threads=3)
    goal = any_session.send_goal(Fibonacci, "count", Fibonacci.Goal(order=100))
    assert goal.cancel() is False
    counter.go_on.set()
    goal.wait()
    assert goal.status.name == "SUCCEEDED"


def test_an_action_that_is_not_there_is_one_sentence(any_session):
    any_session.run(Counter)
    with pytest.raises(WaitTimeout, match=r"count_up was not ready.*Nobody offers /count_up"):
        any_session.send_goal(Fibonacci, "count_up", Fibonacci.Goal(order=1), timeout=0.1)


@pytest.mark.parametrize(
    ("ask", "sentence"),
    [
        (lambda s: s.publish("x", 5), "The message is made from its class"),
        (lambda s: s.publish("x", String), "The message is made from its class"),
        (lambda s: s.publish("x", SetBool.Request()), "The message is made from its class"),
        (lambda s: s.publish("x", String(), qos="a"), "qos is a whole number"),
        (lambda s: s.publish("x", String(), qos=0), "qos is a whole number, at least 1"),
        (lambda s: s.publish("x", String(), timeout="a"), "timeout is a number of seconds"),
        (lambda s: s.record("x", String, qos=2**40), "qos is at most 2147483647"),
        (lambda s: s.record("x", String, limit=2**70), "limit is at most 2147483647"),
        (lambda s: s.record("x", timeout=-1), "timeout is a number of seconds, 0 or more"),
        (lambda s: s.record("x", String).save(5), "The path is a string, such as 'scan.mcap'"),
        (lambda s: s.send_goal(Fibonacci, "1 bad", Fibonacci.Goal()), "'1 bad' is not an action"),
        (lambda s: s.send_goal(Fibonacci, "", Fibonacci.Goal()), "'' is not an action name"),
        (lambda s: s.timeline(("x", 5)), "The type is a message class"),
        (lambda s: s.timeline(("x", String, 5)), "A topic is a string, such as '/scan', not"),
        (lambda s: s.timeline(("x", String), window="a"), "window is a number of seconds"),
        (lambda s: s.timeline(("x", String)).save(5), "The path is a string"),
        (lambda s: s.qos_lab("x"), "qos is a whole number"),
        (lambda s: s.timeline(5), "A topic is a string, such as '/scan', not 5."),
    ],
)
def test_what_cannot_be_asked_is_a_sentence(session, ask, sentence):
    with pytest.raises(course.SessionError) as caught:
        ask(session)
    assert sentence in str(caught.value)


def test_a_wait_without_end_publishes_all_the_same(session):
    with session.record("words", String) as recorder:
        session.publish("words", String(data="now"), timeout=float("inf"))
        assert recorder.wait(1)[0].message.data == "now"
