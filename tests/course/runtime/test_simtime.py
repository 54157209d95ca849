"""Simulated time: exact, whatever the machine's load."""

from __future__ import annotations

import threading

import pytest
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.duration import Duration
from rclpy.executors import Executor
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rclpy.task import Future
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Empty, String

import course
from course.errors import SessionError, WaitTimeout
from course.runtime.waiting import Pulse, poll_condition


class Sensors(Node):
    """Three timers, as a textbook has them."""

    def __init__(self):
        super().__init__("sensors")
        self.fired = {10.0: [], 1.0: [], 0.5: []}
        self.publisher = self.create_publisher(String, "readings", 10)
        for rate, times in self.fired.items():
            self.create_timer(1.0 / rate, lambda times=times: self.fire(times))

    def fire(self, times):
        times.append(self.get_clock().now().nanoseconds)
        self.publisher.publish(String())


@pytest.fixture(params=[1, 4], ids=["one thread", "four threads"])
def lab(request):
    with course.Session(sim_time=True, threads=request.param) as session:
        yield session


def test_timers_fire_exactly_as_often_as_their_rates_say(lab):
    sensors = lab.run(Sensors)
    lab.sim.advance(20.0)
    assert {rate: len(times) for rate, times in sensors.fired.items()} == {
        10.0: 200,
        1.0: 20,
        0.5: 10,
    }
    assert sensors.fired[0.5] == [2_000_000_000 * n for n in range(1, 11)]
    assert lab.sim.now == 20.0


def test_what_timers_set_off_has_happened_when_advance_returns(lab):
    lab.run(Sensors)
    listener = lab.run(Node, "listener")
    heard = []
    echo = listener.create_publisher(String, "echo", 10)
    listener.create_subscription(
        String, "readings", lambda message: (heard.append(message), echo.publish(message)), 10
    )
    recorder = lab.record("echo", String)
    for second in range(1, 6):
        lab.sim.advance(1.0)
        assert len(heard) == recorder.count == 11 * second + second // 2


def test_a_nodes_clock_sleeps_without_being_told_its_context(lab):
    class Sleeper(Node):
        def __init__(self):
            super().__init__("sleeper")
            self.woke = []
            self.thread = threading.Thread(target=self.sleep, daemon=True)
            self.thread.start()

        def sleep(self):
            clock = self.get_clock()
            start = clock.now()
            for seconds in (1.0, 2.0):
                self.woke.append(clock.sleep_until(start + Duration(seconds=seconds)))

    with course.Session(threads=2) as other:  # neither is the process's default
        sleeper = lab.run(Sleeper)
        lab.until(lambda: lab.sim.advance(0.5) or len(sleeper.woke) == 2)
        assert sleeper.woke == [True, True]
        assert other.run(Node, "other").get_clock().sleep_for(Duration(seconds=0.001))


def test_a_clock_does_not_sleep_until_a_time_that_has_passed(lab):
    clock = lab.run(Node, "late").get_clock()
    lab.sim.advance(1.0)
    woke = []
    past = clock.now() - Duration(seconds=0.5)
    thread = threading.Thread(target=lambda: woke.append(clock.sleep_until(past)), daemon=True)
    thread.start()
    lab.until(lambda: woke == [True])  # nobody moves the clock


def test_time_moves_at_once_to_the_moment_until_which_a_callback_sleeps():
    """A callback that sleeps by the clock costs a step for each nap, and not one for each 10 ms."""

    class Napper(Node):
        def __init__(self):
            super().__init__("napper")
            self.woke = []
            own = MutuallyExclusiveCallbackGroup()
            self.create_timer(0.1, self.nap, callback_group=own)

        def nap(self):
            clock = self.get_clock()
            while clock.sleep_for(Duration(seconds=0.25)):
                self.woke.append(clock.now().nanoseconds)

    with course.Session(sim_time=True, threads=2) as lab:
        napper = lab.run(Napper)
        moved = []
        lab.sim.advance(0.1)
        move_to = lab.sim._move_to
        lab.sim._move_to = lambda *move: moved.append(move[0]) or move_to(*move)
        lab.sim.advance(1.0)
        due = [350_000_000, 600_000_000, 850_000_000, 1_100_000_000]
        assert napper.woke == due
        assert moved == [200_000_000, *due]  # its timer is due once more, and has to wait for it


def test_time_moves_in_longer_strides_past_a_callback_that_waits_until_it_is_woken():
    """Two timers wake it, one every 0.12 s, and time stops where they are due."""

    class Waiter(Node):
        def __init__(self):
            super().__init__("waiter")
            self.woke, self.over = [], False
            self.wakes = threading.Semaphore(0)
            group = ReentrantCallbackGroup()
            self.create_timer(0.12, self.wakes.release, callback_group=group)
            self.first = self.create_timer(0.1, self.wait, callback_group=group)

        def wait(self):
            self.first.cancel()
            while self.wakes.acquire() and not self.over:
                self.woke.append(self.get_clock().now().nanoseconds)

    with course.Session(sim_time=True, threads=3) as lab:
        waiter = lab.run(Waiter)
        lab.sim.advance(0.1)
        moved = []
        move_to = lab.sim._move_to
        lab.sim._move_to = lambda *move: moved.append(move[0]) or move_to(*move)
        lab.sim.advance(0.4)
        assert waiter.woke == [120_000_000, 240_000_000, 360_000_000, 480_000_000]
        assert len(moved) < 20  # of 40 steps
        waiter.over = True
        waiter.wakes.release()


def test_a_recorder_stamps_in_simulated_time(lab):
    lab.run(Sensors)
    recorder = lab.record("readings", String)
    lab.sim.advance(1.0)
    first_ten = [stamped.stamp_ns for stamped in recorder.messages][:10]
    assert first_ten == [100_000_000 * n for n in range(1, 11)]
    recorder.clear()
    lab.sim.advance(0.95)
    assert recorder.rate() == pytest.approx(10.0)


def test_a_node_that_comes_later_starts_at_the_present_time(lab):
    lab.sim.advance(5.03)
    sensors = lab.run(Sensors)
    lab.sim.advance(2.0)
    assert [len(times) for times in sensors.fired.values()] == [20, 2, 1]
    assert sensors.fired[1.0] == [6_030_000_000, 7_030_000_000]


def test_small_steps_are_seen_by_whoever_follows_the_clock(lab):
    recorder = lab.record("/clock", Clock)
    lab.sim.advance(0.25, step=0.05)
    stamps = [s.message.clock.nanosec for s in recorder.messages]
    assert stamps == [50_000_000 * n for n in range(1, 6)]


def test_without_timers_time_moves_all_the_same(lab):
    node = lab.run(Node, "idle")
    lab.sim.advance(1000.0)
    assert node.get_clock().now().nanoseconds == 1000 * 10**9


def test_a_callback_that_blocks_does_not_stop_time_if_there_are_more_threads():
    release = threading.Event()
    with course.Session(sim_time=True, threads=3) as lab:
        sensors = lab.run(Sensors)
        blocker = lab.run(Node, "blocker")
        begun = threading.Event()
        blocker.create_timer(0.5, lambda: (begun.set(), release.wait(60.0)))
        # Its own clock subscription waits for the callback: let time pass it by.
        lab.sim.advance(0.45)
        lab.pause(blocker)
        lab.resume(blocker)
        thread = threading.Thread(target=lab.sim.advance, args=(1.0,))
        thread.start()
        lab.until(begun.is_set)
        release.set()
        thread.join()
        assert len(sensors.fired[10.0]) == 14


def test_a_paused_node_is_not_waited_for(lab):
    sensors = lab.run(Sensors)
    lab.pause(sensors)
    lab.sim.advance(1.0)
    assert sensors.fired[10.0] == []


def test_a_callback_cannot_move_time(lab):
    node = lab.run(Node, "eager")
    node.create_timer(0.1, lambda: lab.sim.advance(1.0))
    lab.sim.advance(0.1)
    (error,) = lab.errors
    assert isinstance(error.exception, SessionError)


@pytest.mark.parametrize(("seconds", "step"), [(-1.0, 0.01), (1.0, 0.0), (1.0, -0.1)])
def test_time_moves_forward_only(lab, seconds, step):
    with pytest.raises(SessionError, match="moves forward"):
        lab.sim.advance(seconds, step=step)


def test_without_simulated_time_there_is_no_sim(session):
    with pytest.raises(SessionError, match="sim_time=True"):
        session.sim.advance(1.0)


def test_a_node_that_cannot_follow_is_named(monkeypatch):
    from course.runtime import simulated_time

    monkeypatch.setattr(simulated_time, "_STEP_TIMEOUT_S", 0.3)
    release = threading.Event()
    with course.Session(sim_time=True) as lab:
        stuck = lab.run(Node, "stuck")
        begun = threading.Event()
        stuck.create_guard_condition(lambda: (begun.set(), release.wait(60.0))).trigger()
        lab.until(begun.is_set)
        with pytest.raises(WaitTimeout, match=r"/stuck did not follow simulated time to 0\.01 s"):
            lab.sim.advance(1.0)
        release.set()


class Dreamer(Node):
    """Coroutines that wait for each other, and for a timer on the node's clock."""

    def __init__(self):
        super().__init__("dreamer")
        self.group = ReentrantCallbackGroup()
        self.woken = []
        self.heard = []
        self.publisher = self.create_publisher(String, "dreams", 10)
        self.create_subscription(String, "dreams", self.heard.append, 10, callback_group=self.group)
        self.create_timer(1.0, self.dream, callback_group=self.group)

    async def dream(self):
        first, second = Future(executor=self.executor), Future(executor=self.executor)
        self.executor.create_task(self.pass_on, first, second)
        timer = self.create_timer(0.3, lambda: first.set_result(None), callback_group=self.group)
        await second
        self.destroy_timer(timer)
        self.woken.append(round(self.get_clock().now().nanoseconds / 1e9, 2))
        self.publisher.publish(String())

    async def pass_on(self, first, second):
        await first
        second.set_result(None)


def test_coroutines_that_await_do_not_hold_up_time(lab):
    dreamer = lab.run(Dreamer)
    lab.sim.advance(3.5)
    assert dreamer.woken == [1.3, 2.3, 3.3]
    assert len(dreamer.heard) == 3


def test_a_coroutine_that_awaits_for_ever_does_not_hold_up_time(lab):
    node = lab.run(Sensors)

    async def wait():
        await Future(executor=node.executor)

    node.executor.create_task(wait)
    lab.sim.advance(1.0)
    assert len(node.fired[10.0]) == 10


class Poller(Sensors):
    """Looks again and again, in short callbacks, whether it is late enough."""

    def __init__(self, how):
        super().__init__()
        self.group = ReentrantCallbackGroup()
        self.nap = threading.Event().wait
        self.naps, self.late = 0, None
        self.starter = self.create_timer(0.1, getattr(self, how), callback_group=self.group)

    def is_late(self):
        self.naps += 1
        now = self.get_clock().now().nanoseconds / 1e9
        if now < 0.5:
            return False
        self.late = now
        return True

    async def by_await(self):
        self.starter.cancel()
        while not self.is_late():
            done = Future(executor=self.executor)
            self.executor.create_task(lambda done=done: (self.nap(0.01), done.set_result(None)))
            await done

    def by_tasks(self):
        self.starter.cancel()
        self.nap(0.01)
        if not self.is_late():
            self.executor.create_task(self.by_tasks)


@pytest.mark.parametrize("how", ["by_await", "by_tasks"])
def test_callbacks_that_follow_each_other_without_end_do_not_stop_time(lab, how):
    poller = lab.run(Poller, how)
    lab.sim.advance(0.8)
    assert len(poller.fired[10.0]) == 8
    assert poller.naps > 10
    assert 0.5 <= poller.late < 0.6


def test_a_nudge_is_heard_and_waits_for_no_callback(lab):
    node = lab.run(Sensors)
    lab.sim.advance(1.0)
    fired = {rate: len(times) for rate, times in node.fired.items()}
    lab.sim.nudge()
    assert poll_condition(
        lambda: node.get_clock().now().nanoseconds == lab.sim.now_ns, 5.0, Pulse()
    )
    assert lab.sim.now_ns == 1_000_000_001
    assert fired == {rate: len(times) for rate, times in node.fired.items()}

    begun, go_on = threading.Event(), threading.Event()

    def block(_):
        begun.set()
        go_on.wait()

    node.create_subscription(Clock, "/clock", block, qos_profile_sensor_data)
    try:
        # In the thread that calls, the callback would wait for what comes after the nudge.
        assert poll_condition(lambda: lab.sim.nudge() or begun.is_set(), 5.0, Pulse())
    finally:
        go_on.set()


def test_a_nudge_resumes_a_callback_that_awaits_in_the_group_of_the_clock(lab):
    node = lab.run(Node, "awaits")
    awaited, done = Future(), threading.Event()
    begun = threading.Event()

    async def work(_):
        begun.set()
        await awaited
        done.set()

    node.create_subscription(Empty, "work", work, 10)
    publisher = node.create_publisher(Empty, "work", 10)
    assert poll_condition(lambda: publisher.get_subscription_count(), 30.0, Pulse())
    publisher.publish(Empty())
    assert begun.wait(30.0)
    awaited.set_result(None)  # from another thread, and in an executor that knows nothing of it
    assert poll_condition(lambda: lab.sim.nudge() or done.is_set(), 30.0, Pulse())


def test_patience_bounds_what_a_callback_may_hold_up():
    # With one thread a callback runs in the thread that moves time, and holds it up for good.
    with course.Session(sim_time=True, threads=4) as lab:
        node = lab.run(Sensors)
        go_on = threading.Event()
        node.create_timer(0.05, go_on.wait)
        try:
            with pytest.raises(WaitTimeout, match=r"has been running for 0\.3 s"):
                lab.sim.advance(1.0, patience=0.3)
        finally:
            go_on.set()


def test_a_step_waits_on_no_executor_whose_nodes_have_nothing_to_wait_on(lab, monkeypatch):
    sensors = lab.run(Sensors)
    here, waited = threading.get_ident(), set()
    wait = Executor.wait_for_ready_callbacks

    def watched(executor, *args):
        if threading.get_ident() == here:
            waited.add(executor)
        return wait(executor, *args)

    monkeypatch.setattr(Executor, "wait_for_ready_callbacks", watched)
    lab.sim.advance(1.0)
    assert len(sensors.fired[10.0]) == 10
    assert waited == {sensors.executor}
