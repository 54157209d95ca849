"""Which threads of another process sleep by the wall clock, as it is seen from outside."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from autograder.processes.outside.process_usage import thread_ids
from autograder.processes.outside.sleeping import Sleeper, find_sleepers
from course.runtime.waiting import Pulse, poll_condition

WAITS = {
    "time.sleep": "time.sleep(300)",
    "an event with a time-out": "threading.Event().wait(300)",
    "a lock with a time-out": "lock = threading.Lock(); lock.acquire(); lock.acquire(timeout=300)",
    "a queue with a time-out": "queue.Queue().get(timeout=300)",
    "select": "select.select([], [], [], 300)",
    "poll": "select.poll().poll(300_000)",
    "epoll": "select.epoll().poll(300)",
}
FOR_EVER = {
    "an event": "threading.Event().wait()",
    "a lock": "lock = threading.Lock(); lock.acquire(); lock.acquire()",
    "a queue": "queue.SimpleQueue().get()",
    "a pipe": "os.read(os.pipe()[0], 1)",
    "poll": "select.poll().poll()",
    "loops": "while True: pass",
    "an executor, whose next timer is due in 300 s": """
import rclpy; rclpy.init(domain_id=93); node = rclpy.create_node("sleeps")
node.create_timer(300.0, print); rclpy.spin(node)""",
}


@contextmanager
def running(wait: str) -> Iterator[str]:
    program = f"import os, queue, select, threading, time; print('up', flush=True)\n{wait}"
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE) as process:
        try:
            assert process.stdout is not None
            process.stdout.readline()
            yield f"/proc/{process.pid}"
        finally:
            process.kill()


def asleep(process: str) -> list[Sleeper]:
    return find_sleepers(process, thread_ids(process), {})


@pytest.mark.parametrize("wait", WAITS.values(), ids=[*WAITS])
def test_a_thread_that_waits_for_a_time_is_seen_with_what_is_left_of_it(wait: str) -> None:
    with running(wait) as process:
        assert poll_condition(lambda: asleep(process), 30.0, Pulse())
        (sleeper,) = asleep(process)
    assert 200 < sleeper.left_s <= 300
    assert sleeper.to_the_end is (wait == WAITS["time.sleep"])


@pytest.mark.parametrize("wait", FOR_EVER.values(), ids=[*FOR_EVER])
def test_one_that_waits_for_something_else_is_not(wait: str) -> None:
    with running(wait) as process:
        seen: list[int] = []
        poll_condition(lambda: seen.extend(s.thread for s in asleep(process)), 1.5, Pulse())
        assert not asleep(process)
        assert len(seen) < 20  # while it starts, some may


def test_a_process_that_has_ended_has_no_threads_though_its_parent_has_not_heard_of_it() -> None:
    process = subprocess.Popen([sys.executable, "-c", ""])
    try:
        assert poll_condition(lambda: not thread_ids(f"/proc/{process.pid}"), 30.0, Pulse())
        assert process.returncode is None
        assert not asleep(f"/proc/{process.pid}")
    finally:
        process.wait()
