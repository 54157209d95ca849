"""Proofs: who runs callbacks, and what a synchronous call inside one needs."""

from __future__ import annotations

import pytest
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from std_msgs.msg import String
from std_srvs.srv import Trigger

GIVE_UP = 1.0
"""Seconds until a call that cannot return gives up. That it cannot does not hang on the figure."""
LONG = 60.0
"""Seconds for a call that does return, on however busy a machine."""


class Asking:
    """A client whose timer callback makes one synchronous call."""

    def __init__(self, node, timeout, group=None):
        self.client = node.create_client(Trigger, "ask", callback_group=group)
        self.timeout = timeout
        self.outcomes = []
        self.served_when_the_call_ended = []
        self.served = []
        self.timer = node.create_timer(0.01, self.ask)

    def ask(self):
        if self.client.service_is_ready():
            self.timer.cancel()
            response = self.client.call(Trigger.Request(), timeout_sec=self.timeout)
            self.served_when_the_call_ended.append(len(self.served))
            self.outcomes.append(response and response.message)


def serve(node, served):
    def answer(request, response):
        served.append(request)
        response.message = "here you are"
        return response

    node.create_service(Trigger, "ask", answer)


def test_callbacks_run_only_while_something_spins(ros):
    publisher = ros.node("camera").create_publisher(String, "images", 10)
    viewer = ros.node("viewer", spun=False)
    seen = []
    viewer.create_subscription(String, "images", seen.append, 10)
    fired = []
    viewer.create_timer(0.001, lambda: fired.append(True))
    ros.matched(publisher)  # the endpoint is there and matches, spun or not
    for _ in range(3):
        publisher.publish(String())
    assert publisher.wait_for_all_acked()  # so all three have reached the viewer's queue
    assert (seen, fired) == ([], [])
    ros.main.executor.add_node(viewer)
    ros.until(lambda: len(seen) == 3 and fired, "the callbacks")


def test_a_synchronous_call_in_a_callback_starves_one_thread(ros):
    asking = Asking(ros.node("client"), GIVE_UP)
    serve(ros.node("server"), asking.served)
    ros.main.spin_in_thread(SingleThreadedExecutor(context=ros.main.context))
    ros.until(lambda: asking.outcomes, "the end of the call")
    assert asking.outcomes == [None]
    assert asking.served_when_the_call_ended == [0]  # the server's callback had no thread


def test_a_server_elsewhere_does_not_save_a_single_thread(ros):
    asking = Asking(ros.node("client"), GIVE_UP)
    there = ros.participant()
    serve(there.node("server"), asking.served)
    there.spin_in_thread()
    ros.main.spin_in_thread(SingleThreadedExecutor(context=ros.main.context))
    ros.until(lambda: asking.outcomes, "the end of the call")
    assert asking.outcomes == [None]
    ros.until(lambda: asking.served, "the server, which has answered all the same")


def test_threads_do_not_help_within_one_mutually_exclusive_group(ros):
    asking = Asking(ros.node("client"), GIVE_UP)
    serve(ros.node("server"), asking.served)
    ros.main.spin_in_thread(MultiThreadedExecutor(4, context=ros.main.context))
    ros.until(lambda: asking.outcomes, "the end of the call")
    assert asking.outcomes == [None]


@pytest.mark.parametrize("group", [MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup])
def test_a_synchronous_call_returns_with_threads_and_another_group(ros, group):
    asking = Asking(ros.node("client"), LONG, group())
    serve(ros.node("server"), asking.served)
    ros.main.spin_in_thread(MultiThreadedExecutor(4, context=ros.main.context))
    ros.until(lambda: asking.outcomes, "the end of the call")
    assert asking.outcomes == ["here you are"]
