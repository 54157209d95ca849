"""However a process ends, its nodes end with it: no abort, no hang, no ghost, nothing on stderr."""

from __future__ import annotations

import signal

import pytest
from rclpy.node import Node

import course

PRELUDE = """
import sys, threading, time
import course
from rclpy.node import Node
from std_msgs.msg import String

class Talker(Node):
    def __init__(self, name="talker", block=False):
        super().__init__(name)
        self.count, self.block = 0, block
        publisher = self.create_publisher(String, "chatter", 10)
        self.create_subscription(String, "chatter", lambda message: None, 10)
        self.create_timer(0.005, lambda: self.say(publisher))

    def say(self, publisher):
        self.count += 1
        publisher.publish(String())
        print("heard by nobody")
        if self.block and self.count == 3:
            threading.Event().wait()
"""
RUNNING = "course.until(lambda: talker.count >= 3)\n"
ENDINGS = {
    "by reaching the end": ("talker = course.run(Talker)\n" + RUNNING, 0),
    "by sys.exit": ("talker = course.run(Talker, threads=3)\n" + RUNNING + "sys.exit(3)\n", 3),
    "by an exception": (
        "talker = course.run(Talker)\n" + RUNNING + "sys.excepthook = print\nraise ValueError\n",
        1,
    ),
    "with a callback that never ends": (
        "talker = course.run(Talker, block=True)\n" + RUNNING,
        0,
    ),
    "with a callback that never ends in a pool": (
        "talker = course.run(Talker, block=True, threads=3)\n"
        "course.run(Talker, 'other', threads=3)\n" + RUNNING,
        0,
    ),
    "with a callback that never pauses": (
        "talker = course.run(Talker)\n" + RUNNING + "course.run(Node, 'busy').create_timer("
        "0.001, lambda: [None for _ in iter(int, 1)])\ncourse.session().next_message\n",
        0,
    ),
    "with a session nobody closed": (
        "session = course.Session(threads=2)\ntalker = session.run(Talker)\n"
        "session.until(lambda: talker.count >= 3)\n",
        0,
    ),
    "after rclpy.shutdown": (
        "import rclpy\ntalker = course.run(Talker)\n" + RUNNING + "rclpy.shutdown()\n",
        0,
    ),
    "with a goal under way": (
        "from rclpy.action import ActionServer\nfrom test_msgs.action import Fibonacci\n"
        "node = course.run(Node, 'doer')\nbegun = threading.Event()\n"
        "ActionServer(node, Fibonacci, 'count', lambda goal: (begun.set(), time.sleep(60)))\n"
        "course.send_goal(Fibonacci, 'count', Fibonacci.Goal(order=1))\n"
        "course.until(begun.is_set)\n",
        0,
    ),
}


@pytest.mark.parametrize("how", ENDINGS)
def test_a_script_ends_cleanly(start_script, how):
    source, code = ENDINGS[how]
    process = start_script(PRELUDE + source)
    out, err = process.communicate(timeout=60)
    assert (process.returncode, err) == (code, "")
    assert "heard by nobody" not in out


SPINNING = """
with course.Session(threads=THREADS) as session:
    talker = session.run(Talker)
    session.on_close(lambda: print("closed", flush=True))
    session.until(lambda: talker.count >= 3)
    threading.Timer(0.05, lambda: print(session.domain_id, flush=True)).start()
    session.spin()
print("after the session", flush=True)
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("threads", [1, 3])
def test_a_spinning_script_ends_in_good_order_on_a_signal(start_script, number, threads):
    process = start_script(PRELUDE + SPINNING.replace("THREADS", str(threads)))
    domain_id = int(process.stdout.readline())
    with course.Session(domain_id=domain_id) as outside:
        watcher = outside.run(Node, "watcher")
        outside.until(
            lambda: "talker" in watcher.get_node_names(), timeout=30.0, what="the node to appear"
        )
        process.send_signal(number)
        out, err = process.communicate(timeout=60)
        assert (process.returncode, out, err) == (0, "closed\nafter the session\n", "")
        outside.until(
            lambda: "talker" not in watcher.get_node_names(), timeout=10.0, what="no ghost"
        )


def test_spin_returns_when_the_session_is_closed_or_shut_down(start_script):
    process = start_script(
        PRELUDE
        + "session = course.Session()\nthreading.Timer(0.1, session.close).start()\n"
        + "session.spin()\nprint('closed')\n"
        + "import rclpy\ncourse.run(Talker)\nthreading.Timer(0.1, rclpy.shutdown).start()\n"
        + "course.spin()\nprint('shut down')\n"
    )
    out, err = process.communicate(timeout=60)
    assert (process.returncode, out, err) == (0, "closed\nshut down\n", "")
