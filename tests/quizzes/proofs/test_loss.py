"""Proofs: what RELIABLE repairs, and for whom, on a link that really drops.

The subscriber lives in a process that is stopped (SIGSTOP) while 16 MB are sent to it over UDP. Its
socket holds a small part of that; the operating system throws the rest away, as a network does.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import textwrap
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from rclpy.duration import Duration
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import String

MESSAGES, SIZE = 400, 40_000
LAST = MESSAGES - 1

LISTENER = textwrap.dedent(
    """
    import json
    import sys
    from rclpy.context import Context
    from rclpy.executors import SingleThreadedExecutor
    from rclpy.node import Node
    from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
    from std_msgs.msg import String

    domain, reliability, history, depth, last = sys.argv[1:]
    context = Context()
    context.init(args=["--ros-args", "--disable-stdout-logs"], domain_id=int(domain))
    node = Node("listener", context=context, start_parameter_services=False)
    heard = []
    qos = QoSProfile(
        reliability=ReliabilityPolicy[reliability], history=HistoryPolicy[history],
        depth=int(depth),
    )
    node.create_subscription(
        String, "topic", lambda message: heard.append(message.data[:8].strip()), qos
    )
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    print("ready", flush=True)
    while heard[-1:] not in ([last], ["end"]):
        executor.spin_once(timeout_sec=0.1)
    print(json.dumps([int(text) for text in heard if text != "end"]), flush=True)
    """
)


@pytest.fixture
def udp_only(monkeypatch: pytest.MonkeyPatch) -> None:
    # Between processes of one host DDS would use shared memory, which loses nothing.
    monkeypatch.setenv("FASTDDS_BUILTIN_TRANSPORTS", "UDPv4")


@pytest.fixture
def ros_over_udp(udp_only, ros, monkeypatch):
    """Participants as in `ros`, and a new one that talks over UDP only."""
    # LOCALHOST brings shared memory back; a leased domain keeps others out as well.
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET")
    return ros


class Gap:
    """What came of messages that were sent while their subscriber's process stood still."""

    def __init__(self, waiting: bool, heard: list[int]) -> None:
        self.waiting = waiting
        """Whether the publisher waited for acknowledgements: without, it repairs nothing."""
        self.heard = heard


@pytest.fixture
def across_a_gap(ros_over_udp, tmp_path: Path) -> Iterator[Callable[..., Gap]]:
    """Return a function that sends across a gap, with the QoS of both sides."""
    ros = ros_over_udp
    script = tmp_path / "listener.py"
    script.write_text(LISTENER, encoding="utf-8")
    environment = {k: v for k, v in os.environ.items() if k != "_ROS_WHEELS_BOOTSTRAP_COMPLETE"}
    processes = []

    def send(offered: QoSProfile, requested: QoSProfile) -> Gap:
        publisher = ros.participant().node("sender").create_publisher(String, "topic", offered)
        names = (requested.reliability.name, requested.history.name, str(requested.depth))
        listener = subprocess.Popen(
            [sys.executable, script, str(ros.domain_id), *names, str(LAST)],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment,
        )  # fmt: skip
        processes.append(listener)
        assert listener.stdout.readline() == "ready\n", listener.stderr.read()
        ros.matched(publisher)
        listener.send_signal(signal.SIGSTOP)
        os.waitpid(listener.pid, os.WUNTRACED)  # returns when it has really stopped
        for number in range(MESSAGES):
            publisher.publish(String(data=f"{number:<{SIZE}}"))
        waiting = not publisher.wait_for_all_acked(Duration(seconds=0))
        listener.send_signal(signal.SIGCONT)

        def ended() -> bool:
            # What is repaired comes before the last message. Where nothing is, an end must be sent.
            if not waiting:
                publisher.publish(String(data="end"))
            return listener.poll() is not None

        ros.until(ended, "the listener's report")
        return Gap(waiting, json.loads(listener.stdout.read()))

    yield send
    for process in processes:
        process.kill()
        process.communicate()


ALL, NEWEST = HistoryPolicy.KEEP_ALL, HistoryPolicy.KEEP_LAST
RELIABLE = QoSProfile(history=ALL, reliability=ReliabilityPolicy.RELIABLE)
BEST_EFFORT = QoSProfile(history=ALL, reliability=ReliabilityPolicy.BEST_EFFORT)
SHORT = QoSProfile(history=NEWEST, depth=10, reliability=ReliabilityPolicy.RELIABLE)


def test_reliable_repairs_what_a_full_socket_dropped_and_best_effort_does_not(across_a_gap):
    repaired = across_a_gap(RELIABLE, RELIABLE)
    assert repaired.waiting
    assert repaired.heard == list(range(MESSAGES))
    lost = across_a_gap(BEST_EFFORT, BEST_EFFORT)
    assert len(lost.heard) < MESSAGES


def test_a_reliable_publisher_repairs_for_a_subscriber_with_a_short_queue(across_a_gap):
    """What the socket dropped comes: it held the first messages, and the queue the last ones."""
    gap = across_a_gap(RELIABLE, SHORT)
    assert gap.waiting
    assert gap.heard[-10:] == list(range(MESSAGES - 10, MESSAGES))


def test_a_reliable_publisher_repairs_nothing_for_a_best_effort_subscriber(across_a_gap):
    gap = across_a_gap(RELIABLE, BEST_EFFORT)
    assert not gap.waiting
    assert len(gap.heard) < MESSAGES
    assert LAST not in gap.heard
