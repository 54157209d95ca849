"""Which callbacks wait by the wall clock is what the kernel says of their threads."""

from __future__ import annotations

import queue
import select
import threading
import time
from collections.abc import Callable

import pytest
from rclpy.node import Node

from autograder.examination.subject.wall_waits import NAP_S, is_timed, wall_waits
from course import Session
from course.runtime.waiting import Pulse, poll_condition

LONG = 3600.0  # s: the threads are daemons, and end with the process

TIMED = [
    lambda: time.sleep(LONG),
    lambda: threading.Event().wait(LONG),
    lambda: queue.Queue[None]().get(timeout=LONG),
    lambda: select.select([], [], [], LONG),
    lambda: select.epoll().poll(LONG),
]


def asleep(function: Callable[[], object]) -> int:
    """Run a function in a thread that ends with this process; return its number, if it sleeps."""
    thread = threading.Thread(target=function, daemon=True)
    thread.start()
    assert thread.native_id
    return thread.native_id


@pytest.mark.parametrize("function", TIMED)
def test_a_thread_that_sleeps_for_some_time_is_in_a_call_with_a_time_in_it(
    function: Callable[[], object],
) -> None:
    native_id = asleep(function)
    assert poll_condition(lambda: is_timed(native_id), 30.0, Pulse())


def test_a_thread_that_waits_for_another_is_not() -> None:
    begun, never = threading.Barrier(2), threading.Event()

    def wait() -> None:
        begun.wait()
        never.wait()

    native_id = asleep(wait)
    begun.wait()
    assert poll_condition(lambda: not is_timed(native_id), 30.0, Pulse())
    never.set()


def test_a_thread_that_has_ended_is_not() -> None:
    assert not is_timed(0)


class Waiting(Node):
    """Has a timer whose callback waits."""

    def __init__(self, wait: Callable[[], object]) -> None:
        super().__init__("waiting")
        self.wait = wait
        self.create_timer(0.01, self.tick)

    def tick(self) -> None:
        self.wait()


def test_a_callback_that_sleeps_is_told_with_its_line() -> None:
    over = threading.Event()
    with Session(threads=2) as session:
        session.run(lambda: Waiting(lambda: over.wait(LONG)))
        told = session.until(lambda: wall_waits(session.blocked_callbacks(0.0)), timeout=30.0)
        assert told[0].startswith("Waiting.tick of /waiting (at line ")
        over.set()


@pytest.mark.parametrize("lasting", [threading.Event.wait, None])
def test_a_callback_that_waits_for_another_or_takes_naps_is_not_told(
    lasting: Callable[[threading.Event], object] | None,
) -> None:
    over = threading.Event()

    def wait() -> None:
        if lasting is not None:
            lasting(over)
        while not over.wait(NAP_S / 20):
            pass

    with Session(threads=2) as session:
        session.run(lambda: Waiting(wait))
        blocked = session.until(lambda: session.blocked_callbacks(0.2), timeout=30.0)
        assert wall_waits(blocked) == []
        over.set()
