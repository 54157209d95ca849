"""Callbacks that do not return: said, with the line and the reason, and got round."""

from __future__ import annotations

import threading

import pytest
from rclpy.action import ActionClient, ActionServer
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.node import Node
from std_srvs.srv import Trigger
from test_msgs.action import Fibonacci

import course
from course.errors import WaitTimeout


class Server(Node):
    """Answers at once."""

    def __init__(self):
        super().__init__("server")
        self.create_service(Trigger, "switch", lambda request, response: response)


class Asker(Node):
    """Asks in a callback, and waits there for the answer."""

    def __init__(self, group=None):
        super().__init__("asker")
        self.answer = None
        self.client = self.create_client(Trigger, "switch", callback_group=group)
        self.timer = self.create_timer(0.01, self.ask)

    def ask(self):
        if self.client.service_is_ready():
            self.timer.cancel()
            self.answer = self.client.call(Trigger.Request())  # waits here


class Ticker(Node):
    """Shows that callbacks run."""

    def __init__(self):
        super().__init__("ticker")
        self.count = 0
        self.create_timer(0.005, self.tick)

    def tick(self):
        self.count += 1


class Holder(Node):
    """Does not return until it is let go."""

    def __init__(self, let_go, name="holder"):
        super().__init__(name)
        self.let_go = let_go
        self.timer = self.create_timer(0.01, self.hold)

    def hold(self):
        self.timer.cancel()
        self.let_go.wait()


@pytest.fixture
def open_session():
    """Open sessions that do not wait for what is stuck in them when they close."""
    opened = []

    def open_one(**options):
        opened.append(course.Session(**options))
        return opened[-1]

    yield open_one
    for session in opened:
        session.close(timeout=0.1)


@pytest.fixture
def session(open_session):
    return open_session()


@pytest.fixture(params=[1, 3], ids=["one thread", "three threads"])
def any_session(request, open_session):
    return open_session(threads=request.param)


@pytest.fixture
def let_go():
    event = threading.Event()
    yield event
    event.set()


def blocked(session, longer_than=0.0):
    return session.until(lambda: session.blocked_callbacks(longer_than), timeout=30.0)


def ticks(session, ticker):
    count = ticker.count
    session.until(lambda: ticker.count > count + 2, timeout=30.0, what="ticks")


def test_a_callback_that_returns_is_not_blocked(any_session):
    ticks(any_session, any_session.run(Ticker))
    assert any_session.blocked_callbacks(longer_than=60.0) == []


def test_a_call_in_a_callback_on_one_thread_is_called_a_deadlock(session):
    session.run(Server)
    session.run(Asker)
    (found,) = session.until(
        lambda: [b for b in session.blocked_callbacks(0.0) if b.reason], timeout=30.0
    )
    assert (found.node, found.holds_up) == ("/asker", True)
    assert found.callback.endswith("Asker.ask")
    assert found.line.endswith("self.answer = self.client.call(Trigger.Request())  # waits here")
    assert found.reason.startswith("Deadlock: it waits for the answer of switch")
    assert "the only thread" in found.reason
    assert "call_async()" in str(found)


def test_a_call_to_a_server_on_the_same_one_thread_is_a_deadlock(session):
    """The client's own node spins elsewhere, but its server cannot answer."""
    session.run(Server)
    client = session.run(Node, "elsewhere", threads=2).create_client(Trigger, "switch")

    class Middle(Node):
        def __init__(self):
            super().__init__("middle")
            self.timer = self.create_timer(0.01, self.ask)

        def ask(self):
            self.timer.cancel()
            client.call(Trigger.Request())

    session.until(client.service_is_ready, timeout=30.0)
    session.run(Middle)
    (found,) = session.until(
        lambda: [b for b in session.blocked_callbacks(0.0) if b.node == "/middle" and b.reason],
        timeout=30.0,
    )
    assert "could take the request up" in found.reason


def test_a_call_within_one_mutually_exclusive_group_is_a_deadlock(open_session):
    session = open_session(threads=3)
    session.run(Server)
    session.run(Asker)
    (found,) = session.until(
        lambda: [b for b in session.blocked_callbacks(0.0) if b.reason], timeout=30.0
    )
    assert "same mutually exclusive callback group" in found.reason
    assert "callback group of its own" in found.advice
    assert not found.holds_up
    ticks(session, session.run(Ticker))  # the others go on


def test_the_advice_for_a_group_works():
    with course.Session(threads=2) as session:
        session.run(Server)
        asker = session.run(Asker, MutuallyExclusiveCallbackGroup())
        session.until(lambda: asker.answer is not None, timeout=30.0)


def test_a_goal_sent_in_a_callback_and_waited_for_is_a_deadlock(session):
    class Boss(Node):
        def __init__(self):
            super().__init__("boss")
            ActionServer(self, Fibonacci, "count", lambda goal: Fibonacci.Result())
            self.client = ActionClient(self, Fibonacci, "count")
            self.timer = self.create_timer(0.01, self.send)

        def send(self):
            if self.client.server_is_ready():
                self.timer.cancel()
                self.client.send_goal(Fibonacci.Goal())

    session.run(Boss)
    (found,) = session.until(
        lambda: [b for b in session.blocked_callbacks(0.0) if b.reason], timeout=30.0
    )
    assert found.reason.startswith("Deadlock: it waits for the answer of count")
    assert found.line.endswith("self.client.send_goal(Fibonacci.Goal())")


@pytest.mark.parametrize("threads", [1, 3])
def test_waiting_for_a_server_that_nobody_offers_is_named(threads, open_session):
    class Waiter(Node):
        def __init__(self):
            super().__init__("waiter")
            self.client = self.create_client(Trigger, "nowhere")
            self.create_timer(0.01, self.client.wait_for_service)

    session = open_session(threads=threads)
    session.run(Waiter)
    (found,) = session.until(
        lambda: [b for b in session.blocked_callbacks(0.0) if b.reason], timeout=30.0
    )
    assert found.reason == "It waits for nowhere, which nobody offers."


def test_a_wait_in_vain_names_the_callback_that_is_in_the_way(session, let_go):
    session.run(Holder, let_go)
    blocked(session, longer_than=1.0)
    with pytest.raises(WaitTimeout) as caught:
        session.until(lambda: False, timeout=0.1)
    sentence = str(caught.value)
    assert "Holder.hold of /holder (at line" in sentence
    assert "self.let_go.wait()) has been running for" in sentence
    assert "no other callback can run meanwhile" in sentence


def test_a_wait_in_a_callback_does_not_name_itself():
    with course.Session(threads=2) as session:
        caught = []

        class Waiter(Node):
            def __init__(self):
                super().__init__("waiter")
                self.timer = self.create_timer(0.01, self.wait)

            def wait(self):
                self.timer.cancel()
                try:
                    session.until(lambda: False, timeout=1.2)
                except WaitTimeout as error:
                    caught.append(str(error))

        session.run(Waiter)
        session.until(lambda: caught, timeout=30.0)
        assert "has been running" not in caught[0]


@pytest.mark.parametrize("again", ["another node", "the same node"])
def test_stopping_a_stuck_node_sets_the_others_going(any_session, let_go, again):
    """On one thread, and on a pool each of whose threads is stuck."""
    for number in range(any_session.threads):
        any_session.run(Holder, let_go, f"holder_{number}")
    any_session.until(
        lambda: len(any_session.blocked_callbacks(0.0)) == any_session.threads, timeout=30.0
    )
    ticker = any_session.run(Ticker)
    any_session.stop("holder_0")
    (notice,) = any_session.notices
    assert "/holder_0 was stopped, but its callback" in notice
    assert "self.let_go.wait()) goes on" in notice
    if again == "the same node":
        ticker = any_session.run(Ticker)
    ticks(any_session, ticker)
    any_session.stop()
    report = any_session.close(timeout=1.0)
    assert len(report.leaked) == any_session.threads
    assert "a callback of /holder" in report.leaked[0]


def test_a_thread_that_was_given_up_ends_with_its_callback(any_session, let_go):
    holder = any_session.run(Holder, let_go)
    blocked(any_session)
    any_session.stop(holder)
    let_go.set()
    ticks(any_session, any_session.run(Ticker))
    report = any_session.close()
    assert report.leaked == []


def test_a_deadlocked_node_can_be_replaced(session):
    session.run(Server)
    session.run(Asker)
    session.until(lambda: [b for b in session.blocked_callbacks(0.0) if b.reason], timeout=30.0)
    session.run(Asker)  # still wrong: the session lives on all the same
    (notice,) = session.notices
    assert "Deadlock: it waits for the answer of switch" in notice
    session.stop(Asker)
    ticks(session, session.run(Ticker))


def test_a_busy_loop_is_got_round_too(session):
    ended = threading.Event()

    class Busy(Ticker):
        def tick(self):
            while not ended.is_set():
                pass

    session.run(Busy)
    blocked(session)
    try:
        ticker = session.run(Ticker)  # the same name: replaces it
        ticks(session, ticker)
    finally:
        ended.set()


def test_pausing_a_stuck_node_says_so(session, let_go):
    holder = session.run(Holder, let_go)
    blocked(session)
    session.pause(holder)
    (notice,) = session.notices
    assert "/holder is paused, but a callback that had begun has not ended" in notice
    let_go.set()
    session.resume(holder)
    ticks(session, session.run(Ticker))
