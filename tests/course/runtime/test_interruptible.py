"""Ctrl-C, or a notebook's interrupt button, ends rclpy's own spinning of a session's nodes."""

from __future__ import annotations

import signal
import subprocess
import threading
from collections.abc import Callable

import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

import course
from course.runtime.context.interruptible import SessionContext

SCRIPT = """
import course, rclpy, signal, sys
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.task import Future

class Silent(Node):
    def __init__(self):
        super().__init__("silent")

def own(executor):
    executor.add_node(node)
    executor.spin()

# Whoever started the tests in the background of a shell has had it ignored.
signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
signal.signal(signal.SIGINT, signal.default_int_handler)
node = course.run(Silent)
# They are made before: rclpy prints a traceback when the making of an executor is interrupted.
single, multi = SingleThreadedExecutor(), MultiThreadedExecutor(2)
stranger = Node("stranger")
rclpy.spin_once(stranger, timeout_sec=0)  # the global executor is there from now on
try:
    print("spinning", flush=True)
    SPIN
except KeyboardInterrupt:
    print("interrupted", flush=True)
course.close()
print("closed", flush=True)
"""
WAYS = [
    "rclpy.spin(node)",
    "rclpy.spin_once(node)",
    "rclpy.spin_until_future_complete(node, Future())",
    "rclpy.spin(stranger)",
    "own(single)",
    "own(multi)",
    "rclpy.spin(node, executor=node.executor)",
    "node.executor.spin_until_future_complete(Future())",
    "node.executor.spin()",
]


@pytest.mark.parametrize("way", WAYS)
def test_a_script_is_interrupted_while_rclpy_waits(
    start_script: Callable[[str], subprocess.Popen[str]], way: str
) -> None:
    process = start_script(SCRIPT.replace("SPIN", way))
    assert process.stdout is not None
    assert process.stdout.readline() == "spinning\n"
    # The signal may come before the wait begins: then nothing has to be woken, and all is well.
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert (process.returncode, out, err) == (0, "interrupted\nclosed\n", "")


def test_nobody_is_woken_unless_there_is_somebody_to_wake(session: course.Session) -> None:
    context = session.context
    session.run(Node, "one")
    session.until(lambda: True)
    assert isinstance(context, SessionContext)
    assert not context._wanted.is_set()
    executor = SingleThreadedExecutor(context=context)
    assert context._wanted.is_set()
    executor.shutdown()
    del executor
    session.until(lambda: not context._wanted.is_set(), timeout=30.0, what="the end of waking")


def test_an_executor_adds_no_thread_to_a_session(session: course.Session) -> None:
    """Who looks whether a node's threads have ended must not find one of the session's."""
    session.run(Node, "one")
    before = set(threading.enumerate())
    executor = SingleThreadedExecutor(context=session.context)
    assert set(threading.enumerate()) == before
    executor.shutdown()


def test_waking_is_no_work(session: course.Session) -> None:
    """A spin_once() that waits for a callback returns for a callback, not for being woken."""
    node = session.run(Node, "one")
    ran = []
    node.create_timer(0.5, lambda: ran.append(True))
    rclpy.spin_once(node, executor=SingleThreadedExecutor(context=session.context))
    assert ran == [True]


def test_waking_ends_with_the_session() -> None:
    session = course.Session()
    node = session.run(Node, "one")
    holder = SingleThreadedExecutor(context=session.context)
    holder.add_node(node)
    waker = session.context._waker
    assert waker.is_alive()
    session.close()
    assert not waker.is_alive()
    holder.shutdown()


def test_waking_ends_though_the_session_ends_while_it_falls_asleep(
    session: course.Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    context = session.context
    fall_asleep = context._wanted.clear

    def end_first() -> None:
        context._end_waking()
        fall_asleep()

    monkeypatch.setattr(context._wanted, "clear", end_first)
    SingleThreadedExecutor(context=context).shutdown()  # nobody is left to be woken
    context._waker.join(30.0)
    assert not context._waker.is_alive()
