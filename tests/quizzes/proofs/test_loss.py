"""Proof: what RELIABLE repairs is lost for good with BEST_EFFORT, on a link that really drops.

The subscribers live in a process that is stopped (SIGSTOP) while 16 MB are sent to it over UDP. Its
socket holds a small part of that; the operating system throws the rest away, as a network does.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path

import pytest
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from std_msgs.msg import String

MESSAGES, SIZE = 400, 40_000

LISTENERS = textwrap.dedent(
    """
    import sys
    from rclpy.context import Context
    from rclpy.executors import SingleThreadedExecutor
    from rclpy.node import Node
    from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
    from std_msgs.msg import String

    context = Context()
    context.init(args=["--ros-args", "--disable-stdout-logs"], domain_id=int(sys.argv[1]))
    node = Node("listeners", context=context, start_parameter_services=False)
    heard = {}

    def listen(name):
        texts = heard[name] = []
        node.create_subscription(
            String, name.lower(), lambda message: texts.append(message.data[:8].strip()),
            QoSProfile(
                history=HistoryPolicy.KEEP_ALL, reliability=ReliabilityPolicy[name]
            ),
        )

    listen("RELIABLE")
    listen("BEST_EFFORT")
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    print("ready", flush=True)
    # The test sends "end" on both topics until both have arrived.
    while not all(texts and texts[-1] == "end" for texts in heard.values()):
        executor.spin_once(timeout_sec=0.1)
    for name, texts in heard.items():
        print(name, len([text for text in texts if text != "end"]), flush=True)
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


@pytest.fixture
def listeners(ros_over_udp, tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    script = tmp_path / "listeners.py"
    script.write_text(LISTENERS, encoding="utf-8")
    environment = {k: v for k, v in os.environ.items() if k != "_ROS_WHEELS_BOOTSTRAP_COMPLETE"}
    process = subprocess.Popen(
        [sys.executable, script, str(ros_over_udp.domain_id)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment,
    )
    yield process
    process.kill()
    process.communicate()


def test_reliable_repairs_what_a_full_socket_dropped_and_best_effort_does_not(
    ros_over_udp, listeners
):
    ros = ros_over_udp
    sender = ros.participant().node("sender")
    publishers = {
        name: sender.create_publisher(
            String,
            name.lower(),
            QoSProfile(history=HistoryPolicy.KEEP_ALL, reliability=ReliabilityPolicy[name]),
        )
        for name in ("RELIABLE", "BEST_EFFORT")
    }
    assert listeners.stdout.readline() == "ready\n", listeners.stderr.read()
    for publisher in publishers.values():
        ros.matched(publisher)

    listeners.send_signal(signal.SIGSTOP)
    os.waitpid(listeners.pid, os.WUNTRACED)  # returns when it has really stopped
    for number in range(MESSAGES):
        for publisher in publishers.values():
            publisher.publish(String(data=f"{number:<{SIZE}}"))
    listeners.send_signal(signal.SIGCONT)

    def ended():
        for publisher in publishers.values():
            publisher.publish(String(data="end"))
        return listeners.poll() is not None

    ros.until(ended, "the listeners' report")
    report = dict(line.split() for line in listeners.stdout)
    assert int(report["RELIABLE"]) == MESSAGES
    assert int(report["BEST_EFFORT"]) < MESSAGES
