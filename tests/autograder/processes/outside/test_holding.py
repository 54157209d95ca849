"""Holding threads from outside: who stands still, who goes on, and who is let go."""

from __future__ import annotations

import mmap
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import rclpy
from rclpy.node import Node
from std_msgs.msg import Int32

from autograder.processes.outside import holding
from autograder.processes.outside.holding import HoldError, hold_threads
from course import Session
from course.runtime.waiting import Deadline

LISTENER = """
import sys, rclpy
from rclpy.qos import HistoryPolicy, QoSProfile
from std_msgs.msg import Int32
rclpy.init(domain_id=int(sys.argv[1]))
node = rclpy.create_node("listener")
echo = node.create_publisher(Int32, "echo", 100)
kept = QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=3)
node.create_subscription(Int32, "count", echo.publish, kept)
print(flush=True)
rclpy.spin(node)
"""
COUNTERS = """
import os, threading, time
shared = open(os.sys.argv[1], "r+b", buffering=0)
def count(place):
    number = 0
    while True:
        number += 1
        os.pwrite(shared.fileno(), b"%08d" % number, 8 * place)
        time.sleep(0.001)
for place in range(2):
    threading.Thread(target=count, args=(place,)).start()
if os.fork() == 0:
    count(2)
print(flush=True)
while True:
    thread = threading.Thread(target=time.sleep, args=(0.001,))
    thread.start()
    thread.join()
"""


@contextmanager
def process(program: str, *arguments: object) -> Iterator[subprocess.Popen[bytes]]:
    with subprocess.Popen(
        [sys.executable, "-c", program, *map(str, arguments)],
        stdout=subprocess.PIPE, start_new_session=True,
    ) as running:  # fmt: skip
        try:
            assert running.stdout is not None
            running.stdout.readline()
            yield running
        finally:
            for pid in family(running.pid):
                subprocess.run(["kill", "-9", str(pid)], check=False)


def family(pid: int) -> list[int]:
    """Return a process and its children."""
    children = Path(f"/proc/{pid}/task/{pid}/children")
    return [pid, *map(int, children.read_text().split())] if children.exists() else [pid]


def soon(condition: Callable[[], Any], seconds: float = 30.0) -> bool:
    deadline, never = Deadline(seconds), threading.Event()
    while not condition() and deadline.seconds_left:
        never.wait(0.01)
    return bool(condition())


def test_a_held_node_receives_as_much_as_its_queue_keeps_and_hands_it_on_when_let_go() -> None:
    heard: list[int] = []
    with Session() as session, process(LISTENER, session.domain_id) as listener:
        node = session.run(lambda: Node("talker"))
        assert isinstance(node, Node)
        count = node.create_publisher(Int32, "count", 10)

        def hear(message: Any) -> None:
            heard.append(message.data)

        def probe() -> bool:
            count.publish(Int32(data=-1))
            return -1 in heard

        node.create_subscription(Int32, "echo", hear, 100)
        assert soon(lambda: count.get_subscription_count() and node.count_publishers("echo"))
        assert soon(probe)
        with hold_threads(lambda: [listener.pid]):
            before = list(heard)
            for number in range(10):
                count.publish(Int32(data=number))
            # What is acknowledged was received by threads of DDS.
            assert count.wait_for_all_acked()
            assert heard == before
        assert soon(lambda: 9 in heard)
        assert [number for number in heard if number >= 0] == [7, 8, 9]


def test_own_threads_and_children_stand_still_and_go_on(tmp_path: Path) -> None:
    shared = tmp_path / "counts"
    shared.write_bytes(b"%08d" % 0 * 3)

    def counts() -> list[int]:
        text = shared.read_bytes()
        return [int(text[at : at + 8]) for at in (0, 8, 16)]

    def all_grow(before: list[int]) -> bool:
        return all(a > b for a, b in zip(counts(), before, strict=True))

    with process(COUNTERS, shared) as running:
        for _ in range(3):
            first = counts()
            assert soon(lambda first=first: all_grow(first))  # type: ignore[misc]
            with hold_threads(lambda: family(running.pid)) as hold:
                assert hold.threads >= 4
                assert not hold.is_jammed()
                before = counts()
                threading.Event().wait(0.05)  # fifty turns of each
                assert counts() == before


def test_a_thread_with_a_name_of_those_of_dds_is_held_all_the_same(tmp_path: Path) -> None:
    shared = tmp_path / "counts"
    shared.write_bytes(b"%08d" % 0 * 3)
    name = "open('/proc/thread-self/comm', 'w').write('dds.udp.7400')"
    with process(name + COUNTERS, shared) as running:
        comm = Path(f"/proc/{running.pid}/comm")
        assert comm.read_bytes() == b"dds.udp.7400\n"
        with hold_threads(lambda: family(running.pid)):
            before = shared.read_bytes()
            threading.Event().wait(0.05)
            assert shared.read_bytes() == before


def test_code_counts_as_that_of_dds_only_where_ros_is_installed(tmp_path: Path) -> None:
    rclpy.get_rmw_implementation_identifier()  # its libraries are loaded by the first who asks
    installed = holding.code_of("/proc/self", holding.DDS_LIBRARIES)
    assert installed
    # Its path looks like a line of its own where a carriage return ends one, or like a longer path.
    for folder in ("plain", "a\r00400000-7fff00000000 r-xp 0 0 0 ", f"other {sys.prefix}/lib"):
        own = tmp_path / folder / "libfastrtps.so"
        own.parent.mkdir(parents=True)
        own.write_bytes(bytes(mmap.PAGESIZE))
        with own.open("rb") as file:
            mapped = mmap.mmap(file.fileno(), 0, mmap.MAP_PRIVATE, mmap.PROT_READ | mmap.PROT_EXEC)
        with mapped:
            assert own.name in Path("/proc/self/maps").read_text()
            assert holding.code_of("/proc/self", holding.DDS_LIBRARIES) == installed


def test_who_is_killed_while_held_is_gone_at_once() -> None:
    with process("print(flush=True); import time; time.sleep(600)") as running:
        with hold_threads(lambda: [running.pid]):
            running.kill()
            assert running.wait(timeout=30) == -9
        assert holding._has_ended(running.pid)


def test_a_signal_that_comes_while_held_is_not_lost() -> None:
    with process("print(flush=True); import time; time.sleep(600)") as running:
        with hold_threads(lambda: [running.pid]):
            running.terminate()
            with pytest.raises(subprocess.TimeoutExpired):
                running.wait(timeout=0.1)
        assert running.wait(timeout=30) == -15


def test_where_nobody_may_trace_a_sentence_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: int) -> None:
        raise PermissionError

    with process("print(flush=True); import time; time.sleep(600)") as running:
        with monkeypatch.context() as patch:
            patch.setattr(holding, "_ptrace", refuse)
            refused = pytest.raises(HoldError, match="does not let the grader trace")
            with refused, hold_threads(lambda: [running.pid]):
                pass
        assert soon(lambda: holding._thread_state(running.pid) == b"S")
