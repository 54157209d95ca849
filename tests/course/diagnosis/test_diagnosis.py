"""Each diagnosis is provoked on real nodes, and says what to do."""

from __future__ import annotations

import os
import signal
import subprocess
import threading
from collections.abc import Callable

import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from std_msgs.msg import String
from std_srvs.srv import SetBool
from test_msgs.msg import Empty

from course import Session
from course.diagnosis import Diagnosis
from course.errors import WaitTimeout
from course.graph import reader


def about(found: Diagnosis, name: str) -> str:
    """Return the findings of that name as one text."""
    return "\n".join(finding.text() for finding in found if finding.name == name)


def talker(qos: object = 10, topic: str = "scan", name: str = "talker") -> Node:
    node = Node(name)
    node.create_publisher(String, topic, qos)
    return node


def listener(topic: str = "scan") -> Node:
    node = Node("listener")
    node.create_subscription(String, topic, lambda _message: None, 10)
    return node


def test_where_nothing_is_wrong_nothing_is_found(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)
    session.run(talker)
    session.run(listener)
    session.until(lambda: len(session.diagnose()) == 0)
    assert repr(session.diagnose()) == "Nothing is wrong that can be seen from here."


def test_nobody_publishes_and_a_name_is_nearly_right(session: Session) -> None:
    session.run(listener, "scna")
    session.run(talker)
    session.until(lambda: "is it /scan?" in about(session.diagnose(), "topic"))
    text = about(session.diagnose(), "topic")
    assert "/listener reads /scna, and nobody publishes on it (is it /scan?)." in text
    assert "/talker publishes on /scan, and nobody reads it (is it /scna?)." in text


def test_qos_that_does_not_fit(session: Session) -> None:
    session.run(talker, qos_profile_sensor_data)
    session.run(listener)
    session.until(lambda: about(session.diagnose(), "QoS"))
    text = about(session.diagnose(), "QoS")
    assert "offers BEST_EFFORT, requests RELIABLE" in text
    assert "-> Offer RELIABLE, or request BEST_EFFORT." in text


def test_a_type_that_differs(session: Session) -> None:
    session.run(listener)
    with Session(domain_id=session.domain_id) as other:
        node = other.run(lambda: Node("other"))
        node.create_publisher(Empty, "scan", 10)
        session.until(lambda: about(session.diagnose(), "type"))
        assert "One topic carries one type" in about(session.diagnose(), "type")


def test_a_deadlock_is_named_with_its_line(session: Session) -> None:
    def asker() -> Node:
        node = Node("asker")
        node.create_service(SetBool, "lamp", lambda _request, response: response)
        client = node.create_client(SetBool, "lamp")
        node.create_timer(0.01, lambda: client.call(SetBool.Request(), timeout_sec=8))
        return node

    session.run(asker)
    session.until(lambda: about(session.diagnose(), "callback"))
    text = about(session.diagnose(), "callback")
    assert "Deadlock: it waits for the answer of lamp" in text
    assert "client.call(SetBool.Request(), timeout_sec=8)" in text
    assert "call_async()" in text


def test_a_node_that_nobody_spins(session: Session) -> None:
    made = rclpy.create_node("forgotten", context=session.context)
    made.create_subscription(String, "scan", lambda _message: None, 10)
    try:
        session.until(lambda: about(session.diagnose(), "executor"))
        text = about(session.diagnose(), "executor")
        assert "/forgotten was made, and nobody spins it" in text
        with pytest.raises(WaitTimeout, match="nobody spins it"):
            session.until(lambda: False, timeout=0.1)
    finally:
        made.destroy_node()
    assert about(session.diagnose(), "executor") == ""


def test_a_stolen_node_is_taken_back_and_explained(session: Session) -> None:
    node = session.run(listener)
    rclpy.spin_once(node, timeout_sec=0, executor=SingleThreadedExecutor(context=session.context))
    text = about(session.diagnose(), "executor")
    assert "/listener was taken out of this session" in text
    assert node.executor is not None


def test_a_node_in_an_executor_of_ones_own(session: Session) -> None:
    node = session.run(listener)
    own = SingleThreadedExecutor(context=session.context)
    own.add_node(node)
    session.until(lambda: about(session.diagnose(), "executor"))
    assert "/listener is in an executor of your own" in about(session.diagnose(), "executor")
    own.remove_node(node)


def test_a_paused_node(session: Session) -> None:
    session.run(listener)
    session.pause("listener")
    assert "/listener is paused" in about(session.diagnose(), "pause")


def test_a_ghost_of_an_earlier_run(session: Session) -> None:
    ghost = rclpy.create_node("talker", context=session.context)
    session.run(talker)
    try:
        session.until(lambda: about(session.diagnose(), "name"))
        text = about(session.diagnose(), "name")
        assert "Several nodes are called /talker. One is in this session" in text
    finally:
        ghost.destroy_node()


def test_a_client_without_a_server(session: Session) -> None:
    node = session.run(lambda: Node("asker"))
    node.create_client(SetBool, "lamp")
    session.until(lambda: about(session.diagnose(), "service"))
    assert "uses the service /lamp, and nobody offers it" in about(session.diagnose(), "service")


REMOTE = """
import course
from rclpy.node import Node
with course.Session(domain_id={domain}) as session:
    session.run(lambda: Node("remote"))
    print("ready", flush=True)
    session.spin()
"""


def test_a_dead_service_in_another_process(
    session: Session, start_script: Callable[[str], subprocess.Popen[str]]
) -> None:
    process = start_script(REMOTE.format(domain=session.domain_id))
    assert process.stdout is not None
    assert process.stdout.readline().strip() == "ready"
    session.until(lambda: "/remote" in reader.read(session.observer).nodes, 30)
    session.until(lambda: session.observer.count_services("/remote/list_parameters"), 30)
    session.until(lambda: not about(session.diagnose(), "node"), 30)
    os.kill(process.pid, signal.SIGSTOP)
    try:
        session.until(lambda: about(session.diagnose(), "node"), 30)
        text = about(session.diagnose(), "node")
        assert "/remote is on the graph, but did not answer" in text
    finally:
        os.kill(process.pid, signal.SIGCONT)


def test_two_domains_in_one_kernel_and_one_set_in_vain(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", "111")
    with Session() as other:
        other.run(talker)
        text = about(session.diagnose(), "domain")
    assert f"another one of this kernel, with /talker, is on {other.domain_id}" in text
    assert "ROS_DOMAIN_ID is 111" in text


def test_a_wait_in_vain_says_what_a_diagnosis_says(session: Session) -> None:
    session.run(talker, qos_profile_sensor_data)
    session.run(listener)
    session.until(lambda: about(session.diagnose(), "QoS"))
    with pytest.raises(WaitTimeout, match="do not connect on /scan: reliability"):
        session.until(threading.Event().is_set, timeout=0.05)


def test_a_diagnosis_is_escaped_in_a_notebook(session: Session) -> None:
    from course.doctor.finding import problem

    shown = Diagnosis([problem("x", "<b>", "a & b")])._repr_html_()
    assert "&lt;b&gt;" in shown
    assert "a &amp; b" in shown
