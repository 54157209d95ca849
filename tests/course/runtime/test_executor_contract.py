"""One rclpy program, the same behaviour: on rclpy's own executors and on a session's.

Each test is written against rclpy's documented API and runs on four executors. Those of rclpy spin
in a thread, as a careful user lets them.
"""

from __future__ import annotations

import contextlib
import functools
import sys
import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest
import rclpy
from rclpy.action import ActionClient, ActionServer, CancelResponse
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.context import Context
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.exceptions import InvalidHandle
from rclpy.executors import (
    Executor,
    ExternalShutdownException,
    MultiThreadedExecutor,
    SingleThreadedExecutor,
)
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.task import Future
from rclpy.timer import Timer
from rclpy.waitable import NumberOfEntities, Waitable
from std_msgs.msg import String
from std_srvs.srv import Trigger
from test_msgs.action import Fibonacci

import course
from course.runtime.domains.leases import lease_domain
from course.runtime.waiting import Pulse, poll_condition

PATIENCE = 30.0


class Host:
    """What runs a program's node: an executor, spinning in the background."""

    def __init__(self, context: Context, parallel: bool, add: Callable[[Node], Any]) -> None:
        self.context = context
        self.parallel = parallel
        self._add = add

    def run(self, name: str = "program") -> Node:
        """Return a node that spins."""
        node = Node(name, context=self.context)
        self._add(node)
        return node


@contextlib.contextmanager
def plain(kind: Callable[..., Executor], *, parallel: bool) -> Iterator[Host]:
    lease = lease_domain()
    context = Context()
    context.init(
        ["--ros-args", "--disable-stdout-logs", "--disable-external-lib-logs"],
        domain_id=lease.domain_id,
    )
    executor = kind(context=context)
    nodes = []

    def spin() -> None:
        while context.ok():
            try:
                executor.spin()
            except (ExternalShutdownException, ZeroDivisionError):
                continue  # what a task raised is its creator's business
            except InvalidHandle:
                continue  # rclpy's own race between an entity's end and the executor that waits
            except RuntimeError as error:
                # rclpy's own races: Timer.cancel() and the executor that calls the timer, the
                # context's end and the executor that begins to wait.
                if "timer is canceled" not in str(error) and context.ok():
                    raise

    def add(node: Node) -> None:
        nodes.append(node)
        executor.add_node(node)

    thread = threading.Thread(target=spin)
    thread.start()
    try:
        yield Host(context, parallel, add)
    finally:
        context.shutdown()
        thread.join()
        executor.shutdown()
        for node in nodes:
            node.destroy_node()
        context.destroy()
        lease.release()


@contextlib.contextmanager
def session(threads: int) -> Iterator[Host]:
    with course.Session(threads=threads) as opened:
        yield Host(opened.context, threads > 1, opened.run)


HOSTS = {
    "SingleThreadedExecutor": lambda: plain(SingleThreadedExecutor, parallel=False),
    "MultiThreadedExecutor": lambda: plain(
        functools.partial(MultiThreadedExecutor, 4), parallel=True
    ),
    "session of 1 thread": lambda: session(1),
    "session of 4 threads": lambda: session(4),
}


@pytest.fixture(params=HOSTS)
def host(request: pytest.FixtureRequest) -> Iterator[Host]:
    with HOSTS[request.param]() as opened:
        yield opened


def wait(condition: Callable[[], object], what: str = "the condition") -> None:
    """Return when `condition` holds."""
    assert poll_condition(condition, PATIENCE, Pulse()), f"waited in vain for {what}"


def executor_of(node: Node) -> Executor:
    executor = node.executor
    assert executor is not None
    return executor


# The executor that a node has.


def test_a_nodes_executor_is_an_rclpy_executor_that_holds_the_node(host):
    node = host.run()
    executor = executor_of(node)
    assert isinstance(executor, Executor)
    assert executor.context is host.context
    assert executor.get_nodes() == [node]
    assert executor.add_node(node) is False
    executor.wake()


def test_a_node_that_is_removed_runs_nothing_until_it_is_added_again(host):
    node, other = host.run(), host.run("other")
    ticks, others = [], []
    node.create_timer(0.005, lambda: ticks.append(1))
    other.create_timer(0.005, lambda: others.append(1))
    wait(lambda: ticks)
    executor = executor_of(node)
    executor.remove_node(node)
    wait(lambda: len(others) > 5)
    seen, others[:] = len(ticks), []
    wait(lambda: len(others) > 20)
    assert len(ticks) <= seen + 1  # one was ready when the node was removed
    executor.add_node(node)
    seen = len(ticks)
    wait(lambda: len(ticks) > seen)
    assert node.executor is executor


# Tasks and futures.


def test_a_task_has_the_result_of_its_function(host):
    task = executor_of(host.run()).create_task(lambda a, b: (a, b), 1, b=2)
    wait(task.done)
    assert task.result() == (1, 2)
    assert task.exception() is None


def test_a_task_of_a_coroutine_function_and_one_of_a_coroutine(host):
    async def double(number):
        return 2 * number

    executor = executor_of(host.run())
    tasks = [executor.create_task(double, 2), executor.create_task(double(3))]
    wait(lambda: all(task.done() for task in tasks))
    assert [task.result() for task in tasks] == [4, 6]


def test_a_task_keeps_what_it_raised(host):
    task = executor_of(host.run()).create_task(lambda: 1 / 0)
    wait(task.done)
    assert isinstance(task.exception(), ZeroDivisionError)


def test_a_coroutine_waits_for_a_future_while_callbacks_run(host):
    node = host.run()
    opened, ticks = Future(), []

    async def waiting():
        return await opened

    task = executor_of(node).create_task(waiting)
    node.create_timer(0.005, lambda: ticks.append(1))
    wait(lambda: len(ticks) > 3)
    assert not task.done()
    opened.set_result("now")
    wait(task.done)
    assert task.result() == "now"


def test_a_task_can_await_another(host):
    node = host.run()
    executor = executor_of(node)
    # rclpy's executors look at coroutines when something wakes them, and this one may just run.
    node.create_timer(0.005, lambda: None)

    async def inner():
        return 20

    async def outer():
        return await executor.create_task(inner) + 1

    task = executor.create_task(outer)
    wait(task.done)
    assert task.result() == 21


@pytest.mark.parametrize("threads", [1, 4])
def test_a_sessions_coroutine_goes_on_when_what_it_awaits_is_done(threads):
    """Whichever is older, whichever runs at that moment, and though nothing else happens."""
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)  # as if many cores looked for the moment in which nobody looks
    try:
        with session(threads) as host:
            executor = executor_of(host.run())

            async def inner():
                return 20

            async def outer():
                return await executor.create_task(inner) + 1

            async def after(task):
                return await task + 1

            for _ in range(100):
                task = executor.create_task(outer)
                last = executor.create_task(after, task)
                wait(last.done)
                assert (task.result(), last.result()) == (21, 22)
    finally:
        sys.setswitchinterval(interval)


def test_a_cancelled_task_never_runs(host):
    node = host.run()
    gate, ran = Future(), []

    async def waiting():
        await gate
        ran.append(True)

    task = executor_of(node).create_task(waiting)
    task.cancel()
    gate.set_result(None)
    after = executor_of(node).create_task(lambda: None)
    wait(after.done)
    assert (task.cancelled(), ran) == (True, [])


def test_done_callbacks_run_in_the_executors_threads(host):
    node = host.run()
    where = []
    task = executor_of(node).create_task(lambda: "x")
    task.add_done_callback(lambda done: where.append((done.result(), threading.current_thread())))
    wait(lambda: where)
    (result, thread) = where[0]
    assert result == "x"
    assert thread is not threading.main_thread()


def test_a_task_can_create_tasks(host):
    executor = executor_of(host.run())
    made = []
    executor.create_task(lambda: made.append(executor.create_task(lambda: "inner")))
    wait(lambda: made and made[0].done())
    assert made[0].result() == "inner"


# Entities.


def test_timers_subscriptions_services_and_clients(host):
    node = host.run()
    heard, answers = [], []
    node.create_subscription(String, "chatter", lambda message: heard.append(message.data), 10)
    publisher = node.create_publisher(String, "chatter", 10)

    def answer(request, response):
        response.message = "here"
        return response

    node.create_service(Trigger, "ask", answer)
    client = node.create_client(Trigger, "ask")

    def tick():
        timer.cancel()
        publisher.publish(String(data="hello"))
        future = client.call_async(Trigger.Request())
        future.add_done_callback(lambda done: answers.append(done.result().message))

    wait(client.service_is_ready)
    timer = node.create_timer(0.01, tick)
    wait(lambda: heard and answers)
    assert (heard, answers) == (["hello"], ["here"])


@pytest.mark.parametrize("kind", ["timer", "subscription", "service", "guard condition"])
def test_a_coroutine_can_be_a_callback_and_await_an_answer(host, kind):
    node = host.run()
    host.run("server").create_service(Trigger, "ask", lambda request, response: response)
    # In the group of the callback, the answer would only come after it.
    client = node.create_client(Trigger, "ask", callback_group=ReentrantCallbackGroup())
    wait(client.service_is_ready)
    answers = []

    async def callback(*args):
        if not answers:
            answers.append(await client.call_async(Trigger.Request()))
        return args[-1] if args else None

    if kind == "timer":
        node.create_timer(0.01, callback)
    elif kind == "subscription":
        node.create_subscription(String, "go", callback, 10)
        publisher = node.create_publisher(String, "go", 10)
        wait(publisher.get_subscription_count)
        publisher.publish(String())
    elif kind == "service":
        node.create_service(Trigger, "outer", callback)
        outer = host.run("asker").create_client(Trigger, "outer")
        wait(outer.service_is_ready)
        future = outer.call_async(Trigger.Request())
        wait(future.done)
        assert isinstance(future.result(), Trigger.Response)
    else:
        node.create_guard_condition(callback).trigger()
    wait(lambda: answers, "the answer")


def test_a_guard_condition_runs_its_callback_when_it_is_triggered(host):
    node = host.run()
    count = []
    guard = node.create_guard_condition(lambda: count.append(1))
    executor_of(node).wake()
    guard.trigger()
    wait(lambda: count)
    seen = len(count)
    guard.trigger()
    wait(lambda: len(count) > seen)


class Letterbox(Waitable):
    """A waitable made of a guard condition, as rclpy's documentation allows users to write."""

    def __init__(self, node):
        super().__init__(ReentrantCallbackGroup())
        self.guard = rclpy.guard_condition.GuardCondition(None, None, context=node.context)
        self.letters, self.read, self.ready, self.index = [], [], False, 0
        self.add_future(Future())
        node.add_waitable(self)

    def post(self, letter):
        self.letters.append(letter)
        self.guard.trigger()

    def __enter__(self):
        self.guard.handle.__enter__()

    def __exit__(self, *exc):
        self.guard.handle.__exit__(*exc)

    def is_ready(self, wait_set):
        return wait_set.is_ready("guard_condition", self.index) or bool(self.letters)

    def take_data(self):
        letters, self.letters = self.letters, []
        return letters

    async def execute(self, letters):
        self.read += letters

    def get_num_entities(self):
        return NumberOfEntities(num_gcs=1)

    def add_to_wait_set(self, wait_set):
        self.index = wait_set.add_guard_condition(self.guard.handle)


def test_a_waitable_of_ones_own(host):
    node = host.run()
    box = Letterbox(node)
    executor_of(node).wake()
    for letter in "abc":
        box.post(letter)
        wait(lambda letter=letter: letter in box.read, "a letter")
    assert box.read == ["a", "b", "c"]
    node.remove_waitable(box)


class OtherCallbacksFirst:
    """To be awaited: lets the executor run what else is ready, once."""

    def __await__(self):
        yield


def test_an_action_with_feedback_and_a_cancelled_goal(host):
    node = host.run()
    cancelled = threading.Event()

    async def execute(goal):
        if goal.request.order == 0:
            while not goal.is_cancel_requested:
                await OtherCallbacksFirst()
            goal.canceled()
            cancelled.set()
            return Fibonacci.Result()
        goal.publish_feedback(Fibonacci.Feedback(sequence=[0, 1]))
        goal.succeed()
        return Fibonacci.Result(sequence=[0, 1, 1])

    server = ActionServer(
        node,
        Fibonacci,
        "count",
        execute,
        cancel_callback=lambda goal: CancelResponse.ACCEPT,
        callback_group=ReentrantCallbackGroup(),
    )
    client_node = host.run("client")
    client = ActionClient(client_node, Fibonacci, "count")
    wait(client.server_is_ready)
    # rclpy notes a request after it has sent it: ask where no answer can come in between.
    sent = executor_of(client_node).create_task(client.send_goal_async, Fibonacci.Goal(order=3))
    wait(lambda: sent.done() and sent.result().done())
    handle = sent.result().result()
    assert handle.accepted
    asked = executor_of(client_node).create_task(handle.get_result_async)
    wait(lambda: asked.done() and asked.result().done())
    assert list(asked.result().result().result.sequence) == [0, 1, 1]
    endless = executor_of(client_node).create_task(client.send_goal_async, Fibonacci.Goal(order=0))
    wait(lambda: endless.done() and endless.result().done())
    executor_of(client_node).create_task(endless.result().result().cancel_goal_async)
    wait(cancelled.is_set)
    executor = executor_of(node)
    if not isinstance(executor, SingleThreadedExecutor | MultiThreadedExecutor):
        return  # the session destroys them
    # One that is destroyed while another thread adds it to its wait set ends rclpy's spin.
    for each in (node, client_node):
        executor.remove_node(each)
    passed = executor.create_task(lambda: None)
    wait(passed.done)
    server.destroy()
    client.destroy()


# Callback groups.


class Crowd:
    """Counts how many callbacks are inside at once; each waits for company, and gives up soon."""

    def __init__(self, company):
        self.inside, self.most, self.visits = 0, 0, 0
        self.company = company
        self.changed = threading.Condition()

    def visit(self):
        with self.changed:
            self.inside += 1
            self.most = max(self.most, self.inside)
            self.changed.notify_all()
            self.changed.wait_for(lambda: self.most >= self.company, timeout=0.05)
            self.inside -= 1
            self.visits += 1


def test_callbacks_of_one_mutually_exclusive_group_never_overlap(host):
    node = host.run()
    crowd = Crowd(company=2)
    group = MutuallyExclusiveCallbackGroup()
    for _ in range(3):
        node.create_timer(0.005, crowd.visit, callback_group=group)
    wait(lambda: crowd.visits > 10)
    assert crowd.most == 1


def test_callbacks_of_different_groups_overlap_if_there_are_threads(host):
    node = host.run()
    crowd = Crowd(company=2)
    for _ in range(2):
        node.create_timer(0.005, crowd.visit, callback_group=MutuallyExclusiveCallbackGroup())
    wait(lambda: crowd.most >= 2 if host.parallel else crowd.visits > 10)
    assert crowd.most == (2 if host.parallel else 1)


def test_a_reentrant_callback_overlaps_itself_if_there_are_threads(host):
    node = host.run()
    crowd = Crowd(company=2)
    node.create_timer(0.005, crowd.visit, callback_group=ReentrantCallbackGroup())
    wait(lambda: crowd.most >= 2 if host.parallel else crowd.visits > 10)
    assert (crowd.most >= 2) == host.parallel


def test_a_blocking_call_in_a_callback_works_with_a_group_for_the_client(host):
    node = host.run()
    host.run("server").create_service(Trigger, "ask", lambda request, response: response)
    client = node.create_client(Trigger, "ask", callback_group=ReentrantCallbackGroup())
    wait(client.service_is_ready)
    answers = []

    def tick():
        timer.cancel()
        answers.append(client.call(Trigger.Request(), timeout_sec=PATIENCE if host.parallel else 0))

    timer = node.create_timer(0.01, tick)
    wait(lambda: answers)
    assert isinstance(answers[0], Trigger.Response if host.parallel else type(None))


@pytest.mark.parametrize(
    "host", [name for name in HOSTS if "Multi" in name or "4" in name], indirect=True
)
def test_a_rate_sleeps_in_a_callback_where_there_are_threads(host):
    """On one thread it would wait for itself, as rclpy's documentation says."""
    node = host.run()
    rate = node.create_rate(100.0)
    naps = []

    def tick():
        timer.cancel()
        for _ in range(3):
            rate.sleep()
            naps.append(1)

    timer = node.create_timer(0.01, tick)
    wait(lambda: len(naps) == 3)


# Coming and going.


def test_entities_come_and_go_while_their_node_spins(host):
    node = host.run()
    for round_number in range(20):
        heard = []
        subscription = node.create_subscription(String, "chatter", heard.append, 10)
        publisher = node.create_publisher(String, "chatter", 10)
        wait(publisher.get_subscription_count)
        publisher.publish(String(data=str(round_number)))
        wait(lambda heard=heard: heard)
        done = executor_of(node).create_task(node.destroy_subscription, subscription)
        wait(done.done)
        node.destroy_publisher(publisher)


def test_an_event_is_told_while_callbacks_follow_each_other(host):
    node, ticks, told = host.run(), threading.Event(), threading.Event()
    node.create_timer(0.001, ticks.set)
    assert ticks.wait(PATIENCE)
    asked = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE)
    offered = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
    events = SubscriptionEventCallbacks(incompatible_qos=lambda _: told.set())
    node.create_subscription(String, "words", lambda _: None, asked, event_callbacks=events)
    node.create_publisher(String, "words", offered)
    assert told.wait(PATIENCE)


def test_a_cancelled_timer_stops_and_a_reset_one_goes_on(host):
    node = host.run()
    ticks = []
    timer = node.create_timer(0.005, lambda: ticks.append(1))
    wait(lambda: len(ticks) > 3)
    timer.cancel()
    assert timer.is_canceled()
    seen = len(ticks)
    timer.reset()
    wait(lambda: len(ticks) > seen + 3)


def test_a_node_made_in_a_callback_can_be_added_there(host):
    node = host.run()
    ticks = []

    def make():
        timer.cancel()
        made = Node("made", context=host.context)
        nodes.append(made)
        made.create_timer(0.005, lambda: ticks.append(1))
        executor_of(node).add_node(made)

    nodes: list[Node] = []
    timer = node.create_timer(0.01, make)
    wait(lambda: ticks)
    done = executor_of(node).create_task(
        lambda: (executor_of(node).remove_node(nodes[0]), nodes[0].destroy_node())
    )
    wait(done.done)


# Spinning a node that spins already: what a student's own code may do in a cell.


@pytest.fixture(params=[1, 4], ids=["session of 1 thread", "session of 4 threads"])
def opened(request):
    with course.Session(threads=request.param) as opened:
        yield opened


def test_spinning_a_sessions_executor_waits_for_it(opened):
    node = opened.run(Node, "program")
    executor, ticks = executor_of(node), []
    timer = node.create_timer(0.005, lambda: ticks.append(1))
    for _ in range(5):
        seen = len(ticks)
        executor.spin_once(timeout_sec=PATIENCE)
        rclpy.spin_once(node, executor=executor, timeout_sec=PATIENCE)
        wait(lambda seen=seen: len(ticks) > seen)
    future = Future()
    waits = node.create_timer(0.05, lambda: future.done() or future.set_result("done"))
    rclpy.spin_until_future_complete(node, future, executor=executor, timeout_sec=PATIENCE)
    assert future.result() == "done"
    executor.spin_until_future_complete(Future(), timeout_sec=0.05)
    timer.cancel()
    waits.cancel()
    executor.spin_once(timeout_sec=0.05)  # nothing left to run: the time is up
    assert opened.errors == []


def test_a_callback_can_spin_until_a_future_is_complete(opened):
    """Nested, as many students write it; on rclpy's pool it is a ValueError."""
    opened.run(Node, "server").create_service(Trigger, "ask", lambda request, response: response)
    node = opened.run(Node, "program")
    client = node.create_client(Trigger, "ask", callback_group=ReentrantCallbackGroup())
    wait(client.service_is_ready)
    answers, ticks = [], []

    def tick():
        timer.cancel()
        future = client.call_async(Trigger.Request())
        executor_of(node).spin_until_future_complete(future, timeout_sec=PATIENCE)
        answers.append(future.result())

    timer = node.create_timer(0.01, tick)
    wait(lambda: answers)
    assert isinstance(answers[0], Trigger.Response)
    node.create_timer(0.005, lambda: ticks.append(1))
    wait(lambda: len(ticks) > 3)
    assert opened.errors == []


@pytest.mark.parametrize("where", ["in a cell", "in a callback"])
def test_a_sessions_executor_can_be_shut_down_and_the_next_node_gets_another(opened, where):
    node = opened.run(Node, "program")
    executor = executor_of(node)
    if where == "in a cell":
        assert executor.shutdown(timeout_sec=PATIENCE)
    else:
        done = executor.create_task(executor.shutdown)
        wait(done.done)
    ticks = []
    other = opened.run(Node, "other")
    other.create_timer(0.005, lambda: ticks.append(1))
    wait(lambda: ticks)
    assert other.executor is not executor
    assert (opened.errors, opened.notices) == ([], [])


def test_a_node_removed_by_hand_is_taken_back(opened):
    """`rclpy.spin(node, executor=...)` removes the node at its end, whoever added it."""
    node = opened.run(Node, "program")
    executor_of(node).remove_node(node)
    ticks = []
    node.create_timer(0.005, lambda: ticks.append(1))
    opened.until(lambda: ticks)
    assert "/program was taken out" in opened.notices[0]


class CancelledAsItFires(Timer):
    """A timer that another thread cancels between rclpy's look whether it is due, and its call."""

    @property
    def handle(self):
        handle = super().handle
        if sys._getframe(1).f_code.co_name == "_take_timer" and "cancelled" not in vars(self):
            self.cancelled = True
            handle.cancel_timer()
        return handle


@pytest.mark.parametrize("threads", [1, 3])
def test_a_timer_that_is_cancelled_as_it_fires_leaves_its_node_alive(opened, threads):
    node = opened.run(Node, "program", threads=threads)
    fired, ticks = [], []
    timer = node.create_timer(0.005, lambda: fired.append(1))
    timer.__class__ = CancelledAsItFires
    wait(lambda: hasattr(timer, "cancelled"))
    count = len(fired)
    node.create_timer(0.005, lambda: ticks.append(1))  # in the same callback group
    wait(lambda: ticks)
    assert len(fired) == count
    timer.reset()
    wait(lambda: len(fired) > count)
    assert opened.errors == []


@pytest.mark.parametrize("threads", [1, 3])
def test_what_cannot_be_taken_is_said_and_its_node_lives(opened, threads):
    class Wrong(Letterbox):
        def __init__(self, node):
            super().__init__(node)
            self.callback_group = node.default_callback_group
            self.callback_group.add_entity(self)

        def take_data(self):
            letters = super().take_data()
            if letters == ["torn"]:
                raise ValueError("torn")
            return letters

    node = opened.run(Node, "program", threads=threads)
    ticks = []
    with executor_of(node).hold_still():
        box = Wrong(node)
    for letter in ("torn", "a"):
        box.post(letter)
        wait(lambda: not box.letters)
    wait(lambda: box.read == ["a"])
    assert "raised ValueError: torn" in str(opened.errors[0])
    node.create_timer(0.005, lambda: ticks.append(1))
    wait(lambda: ticks)


def test_a_waitable_with_a_mistake_is_said_and_the_session_goes_on(opened):
    class Wrong(Letterbox):
        def get_num_entities(self):
            raise TypeError("how many?")

    node = opened.run(Node, "program")
    box = Wrong(node)
    executor_of(node).wake()
    wait(lambda: opened.errors)
    assert "raised TypeError: how many?" in str(opened.errors[0])
    node.remove_waitable(box)
    ticks = []
    opened.run(Node, "other").create_timer(0.005, lambda: ticks.append(1))
    wait(lambda: ticks)
