"""Proofs: what happens between a goal and its result, and what cancelling does."""

from __future__ import annotations

import pytest
from action_msgs.msg import GoalStatus
from rclpy.action import ActionClient, ActionServer, CancelResponse, GoalResponse
from rclpy.qos import QoSProfile
from rclpy.task import Future
from test_msgs.action import Fibonacci


class Drive:
    """An action server whose work stops at a gate, and the client of one goal.

    Both are in one participant, where endpoints match on both sides when they are made. Between
    participants the client's side may know of a match before the server's does, and feedback that
    is published in between reaches nobody.
    """

    def __init__(self, ros, execute=None, *, order=5, **options):
        self.ros = ros
        self.gate = Future()
        self.at_gate = []
        self.events = []
        self.feedback = []
        self.server = ros.main.keep(
            ActionServer(ros.node("robot"), Fibonacci, "drive", execute or self.execute, **options)
        )
        node = ros.node("client")
        self.client = ros.main.keep(ActionClient(node, Fibonacci, "drive"))
        # The client of rclpy drops feedback that it has not got round to when the result comes.
        self.all_feedback = []
        watcher = node.create_subscription(
            Fibonacci.Impl.FeedbackMessage, "drive/_action/feedback",
            lambda message: self.all_feedback.append(list(message.feedback.sequence)),
            QoSProfile(depth=100),
        )  # fmt: skip
        ros.until(self.client.server_is_ready, "the action server")
        ros.until(watcher.get_publisher_count, "the feedback topic")
        self.goal = Fibonacci.Goal(order=order)

    async def execute(self, handle):
        handle.publish_feedback(Fibonacci.Feedback(sequence=[1]))
        self.at_gate.append(handle)
        await self.gate
        handle.publish_feedback(Fibonacci.Feedback(sequence=[2]))
        if handle.is_cancel_requested:
            handle.canceled()
        else:
            handle.succeed()
        return Fibonacci.Result(sequence=[1, 2])

    def send(self):
        """Send the goal; return the goal handle and the future of its result."""
        sent = self.client.send_goal_async(
            self.goal, lambda message: self.feedback.append(list(message.feedback.sequence))
        )
        self.ros.until(sent.done, "the answer to the goal")
        handle = sent.result()
        assert handle.accepted
        return handle, handle.get_result_async()

    def cancel(self, handle):
        """Ask to cancel; return whether the server agreed."""
        asked = handle.cancel_goal_async()
        self.ros.until(asked.done, "the answer to the request to cancel")
        return len(asked.result().goals_canceling) == 1

    def finish(self, result):
        self.gate.set_result(None)
        self.ros.until(result.done, "the result")
        return result.result().status


def accept(goal_handle):
    return CancelResponse.ACCEPT


def test_a_goal_gives_feedback_before_its_result(ros):
    drive = Drive(ros)
    _, result = drive.send()
    ros.until(lambda: drive.feedback == [[1]], "feedback")
    assert not result.done()  # and it cannot be: the work waits at the gate
    assert drive.finish(result) == GoalStatus.STATUS_SUCCEEDED
    assert list(result.result().result.sequence) == [1, 2]


def test_the_events_of_a_goal_come_in_this_order(ros):
    events = []

    def accept_goal(request):
        events.append("the server accepts the goal")
        return GoalResponse.ACCEPT

    def execute(handle):
        handle.publish_feedback(Fibonacci.Feedback(sequence=[1]))
        events.append("the server publishes feedback")
        handle.succeed()
        events.append("the server calls `goal_handle.succeed()`")
        return Fibonacci.Result(sequence=[1])

    drive = Drive(ros, execute, goal_callback=accept_goal)
    events.append("the client sends the goal")
    _, result = drive.send()
    result.add_done_callback(lambda future: events.append("the client receives the result"))
    ros.until(result.done, "the result")
    ros.until(lambda: "the client receives the result" in events, "its callback")
    assert events == [
        "the client sends the goal",
        "the server accepts the goal",
        "the server publishes feedback",
        "the server calls `goal_handle.succeed()`",
        "the client receives the result",
    ]


def test_a_goal_can_be_cancelled_when_the_server_agrees(ros):
    drive = Drive(ros, cancel_callback=accept)
    handle, result = drive.send()
    ros.until(lambda: drive.at_gate, "the work")
    assert drive.cancel(handle)
    assert drive.finish(result) == GoalStatus.STATUS_CANCELED


def test_a_server_without_cancel_callback_declines(ros):
    drive = Drive(ros)
    handle, result = drive.send()
    ros.until(lambda: drive.at_gate, "the work")
    assert not drive.cancel(handle)
    assert not drive.at_gate[0].is_cancel_requested
    assert drive.finish(result) == GoalStatus.STATUS_SUCCEEDED


def test_a_cancelled_goal_runs_on_until_the_server_looks(ros):
    drive = Drive(ros, cancel_callback=accept)
    handle, result = drive.send()
    ros.until(lambda: drive.at_gate, "the work")
    assert drive.cancel(handle)
    # Agreed, and the work is where it was: the goal is being cancelled, not cancelled.
    assert drive.at_gate[0].status == GoalStatus.STATUS_CANCELING
    assert not result.done()
    assert drive.finish(result) == GoalStatus.STATUS_CANCELED
    ros.until(lambda: drive.all_feedback == [[1], [2]], "what the server did after it had agreed")


def test_a_goal_is_aborted_by_its_server_alone(ros):
    def give_up(handle):
        handle.abort()
        return Fibonacci.Result()

    _, given_up = Drive(ros, give_up).send()
    ros.until(given_up.done, "the result")
    assert given_up.result().status == GoalStatus.STATUS_ABORTED


def test_an_accepted_goal_has_no_result_when_its_server_ends(ros):
    drive = Drive(ros, handle_accepted_callback=lambda goal_handle: None)
    _, result = drive.send()
    ros.main.entities.remove(drive.server)
    drive.server.destroy()
    ros.until(lambda: not drive.client.server_is_ready(), "the end of the server")
    # Another server of the same name answers goals of its own, and knows nothing of this one.
    other = Drive(ros)
    _, its_result = other.send()
    assert other.finish(its_result) == GoalStatus.STATUS_SUCCEEDED
    assert not result.done()


def test_a_goal_sent_before_the_server_exists_is_lost(ros):
    client = ros.main.keep(ActionClient(ros.node("early"), Fibonacci, "drive"))
    early = client.send_goal_async(Fibonacci.Goal(order=1))
    drive = Drive(ros)
    _, result = drive.send()
    assert drive.finish(result) == GoalStatus.STATUS_SUCCEEDED
    assert len(drive.at_gate) == 1
    assert not early.done()


@pytest.mark.parametrize("order", [2, 3, 5])
def test_the_chapters_loop_gives_one_feedback_fewer_than_the_order(ros, order):
    def execute(handle):
        sequence = [0, 1]
        for i in range(1, handle.request.order):
            sequence.append(sequence[i] + sequence[i - 1])
            handle.publish_feedback(Fibonacci.Feedback(sequence=sequence))
        handle.succeed()
        return Fibonacci.Result(sequence=sequence)

    drive = Drive(ros, execute, order=order)
    _, result = drive.send()
    ros.until(result.done, "the result")
    ros.until(lambda: len(drive.all_feedback) == order - 1, "the feedback")
    # Feedback is in order, and the last one has the whole sequence: no further one can come.
    assert drive.all_feedback[-1] == list(result.result().result.sequence)
    assert len(drive.all_feedback) == order - 1


def test_an_action_is_three_services_and_two_topics(ros):
    Drive(ros)
    node = ros.main.nodes[0]
    services = node.get_service_names_and_types_by_node("robot", "/")
    topics = node.get_publisher_names_and_types_by_node("robot", "/")
    of_action = sorted(name for name, _ in services + topics if name.startswith("/drive/"))
    assert of_action == [
        "/drive/_action/cancel_goal",
        "/drive/_action/feedback",
        "/drive/_action/get_result",
        "/drive/_action/send_goal",
        "/drive/_action/status",
    ]
