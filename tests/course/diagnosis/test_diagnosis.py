"""Each diagnosis is provoked on real nodes, and says what to do."""

from __future__ import annotations

import gc
import json
import os
import re
import signal
import subprocess
import threading
import weakref
from collections.abc import Callable

import pytest
import rclpy
from rclpy.action import ActionClient
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from std_msgs.msg import String
from std_srvs.srv import SetBool, Trigger
from test_msgs.action import Fibonacci
from test_msgs.msg import Empty

from course import Session
from course.diagnosis import Diagnosis, nodes
from course.errors import WaitTimeout
from course.graph import reader
from course.runtime.domains import domain_discovery, leases, port_bases
from course.util.operating_system import bind_anywhere, new_socket
from tests.robot import Robot

EVERY_CLAIM = domain_discovery.all_claims  # before a fixture hides the others


@pytest.fixture(autouse=True)
def _no_domain_is_set(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)


def about(found: Diagnosis, name: str) -> str:
    """Return the findings of that name as one text."""
    return "\n".join(finding.as_text() for finding in found if finding.name == name)


def in_vain(session: Session) -> str:
    """Return what a wait says that times out now, knowing nothing of what it waits for."""
    with pytest.raises(WaitTimeout) as caught:
        session.until(lambda: False, timeout=0)
    text = str(caught.value)
    assert text.startswith("Waited 0 s in vain for the condition.")
    assert "\n" not in text
    return text


def talker(qos: object = 10, topic: str = "scan", name: str = "talker") -> Node:
    node = Node(name)
    node.create_publisher(String, topic, qos)
    return node


def listener(topic: str = "scan") -> Node:
    node = Node("listener")
    node.create_subscription(String, topic, lambda _message: None, 10)
    return node


def test_an_object_that_stands_for_one_that_is_gone_is_passed_over(session: Session) -> None:
    class Gone:
        """Something that a library of the learner's had a weak proxy of."""

    proxy = weakref.proxy(Gone())
    assert gc.is_tracked(proxy)
    assert not list(nodes.find_unspun(session))
    del proxy


def test_where_nothing_is_wrong_nothing_is_found(session: Session) -> None:
    session.run(talker)
    session.run(listener)
    session.until(lambda: len(session.diagnose()) == 0)
    assert repr(session.diagnose()) == "Nothing is wrong that can be seen from here."
    assert in_vain(session) == "Waited 0 s in vain for the condition."


def test_nobody_publishes_and_a_name_is_nearly_right(session: Session) -> None:
    session.run(listener, "scna")
    session.run(talker)
    session.until(lambda: "is it /scan?" in about(session.diagnose(), "topic"))
    text = about(session.diagnose(), "topic")
    assert "/listener reads /scna, and nobody publishes on it (is it /scan?)." in text
    assert "/talker publishes on /scan, and nobody reads it (is it /scna?)." in text
    said = in_vain(session)
    assert "/listener reads /scna, and nobody publishes on it (is it /scan?). Start the" in said


def test_qos_that_does_not_fit(session: Session) -> None:
    session.run(talker, qos_profile_sensor_data)
    session.run(listener)
    session.until(lambda: about(session.diagnose(), "QoS"))
    text = about(session.diagnose(), "QoS")
    assert "offers BEST_EFFORT, requests RELIABLE" in text
    assert "-> Offer RELIABLE, or request BEST_EFFORT." in text
    assert "do not connect on /scan: reliability" in in_vain(session)


def test_a_type_that_differs(session: Session) -> None:
    session.run(listener)
    with Session(domain_id=session.domain_id) as other:
        node = other.run(lambda: Node("other"))
        node.create_publisher(Empty, "scan", 10)
        session.until(lambda: about(session.diagnose(), "type"))
        assert "One topic carries one type" in about(session.diagnose(), "type")
        assert "One topic carries one type" in in_vain(session)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (
            lambda node: node.create_subscription(Empty, "scan", print, 10),
            "/scan is of type std_msgs/msg/String, not test_msgs/msg/Empty: one topic has one type",
        ),
        (
            lambda node: node.create_publisher(Empty, "scan", 10),
            "/scan is of type std_msgs/msg/String, not test_msgs/msg/Empty: one topic has one type",
        ),
        (
            lambda node: node.create_client(Trigger, "lamp"),
            "/lamp is of type std_srvs/srv/SetBool, not std_srvs/srv/Trigger: one service has one",
        ),
    ],
)
def test_a_type_that_differs_within_one_kernel(
    session: Session, make: Callable[[Node], object], said: str
) -> None:
    node = session.run(talker)
    node.create_service(SetBool, "lamp", lambda _request, response: response)

    class Other(Node):
        def __init__(self) -> None:
            super().__init__("other")
            make(self)

    session.until(lambda: session.offered(["/scan", "/lamp"]).keys() == {"/scan", "/lamp"})
    with pytest.raises(RuntimeError, match=said):
        session.run(Other)


def test_a_deadlock_is_named_with_its_line(session: Session) -> None:
    def asker() -> Node:
        node = Node("asker")
        node.create_service(SetBool, "lamp", lambda _request, response: response)
        client = node.create_client(SetBool, "lamp")

        def switch() -> None:
            client.call(SetBool.Request(), timeout_sec=8)

        node.create_timer(0.01, lambda: switch())
        return node

    session.run(asker)
    session.until(lambda: about(session.diagnose(), "callback"))
    text = about(session.diagnose(), "callback")
    assert "Deadlock: it waits for the answer of lamp" in text
    assert re.search(r"at line \d+: client.call.*, called from line \d+: .*lambda: switch", text)
    assert "call_async()" in text
    said = in_vain(session)
    assert said.count("Deadlock: it waits for the answer of lamp") == 1
    assert "client.call(SetBool.Request(), timeout_sec=8)" in said


def test_a_node_that_nobody_spins(session: Session) -> None:
    made = rclpy.create_node("forgotten", context=session.context)
    made.create_subscription(String, "scan", lambda _message: None, 10)
    try:
        session.until(lambda: about(session.diagnose(), "executor"))
        text = about(session.diagnose(), "executor")
        assert "/forgotten was made, and nobody spins it" in text
        assert "/forgotten was made, and nobody spins it" in in_vain(session)
    finally:
        made.destroy_node()
    assert about(session.diagnose(), "executor") == ""


def test_what_a_constructor_left_behind(session: Session) -> None:
    def half() -> Node:
        node = Node("half")
        raise OSError(f"no camera at {node.get_name()}")

    with pytest.raises(OSError, match="no camera") as caught:
        session.run(half)
    found = session.diagnose()
    text = about(found, "constructor")
    assert "The constructor of /half raised OSError: no camera at half. It left the node on" in text
    assert "Nobody calls destroy_node() of a node that was never made." in text
    assert about(found, "executor") == about(found, "node") == ""
    assert "The constructor of /half raised OSError" in in_vain(session)
    session.stop("half")
    assert caught.tb is not None
    assert about(session.diagnose(), "constructor") == ""


def test_a_stolen_node_is_taken_back_and_explained(session: Session) -> None:
    node = session.run(listener)
    rclpy.spin_once(node, timeout_sec=0, executor=SingleThreadedExecutor(context=session.context))
    text = about(session.diagnose(), "executor")
    assert "/listener was taken out of this session" in text
    assert node.executor is not None


@pytest.mark.parametrize("when", ["before the wait", "in the wait"])
def test_a_wait_tells_that_a_node_was_stolen(session: Session, when: str) -> None:
    node = session.run(listener)
    thief = SingleThreadedExecutor(context=session.context)

    def steal() -> None:
        rclpy.spin_once(node, timeout_sec=0, executor=thief)

    if when == "before the wait":
        steal()
    with pytest.raises(WaitTimeout, match="/listener was taken out of this session"):
        session.until(steal if when == "in the wait" else lambda: None, timeout=0)
    assert node.executor is not None


def test_a_node_in_an_executor_of_ones_own(session: Session) -> None:
    node = session.run(listener)
    own = SingleThreadedExecutor(context=session.context)
    own.add_node(node)
    session.until(lambda: about(session.diagnose(), "executor"))
    assert "/listener is in an executor of your own" in about(session.diagnose(), "executor")
    assert in_vain(session).count("in an executor of your own") == 1
    own.remove_node(node)


def test_a_paused_node(session: Session) -> None:
    session.run(listener)
    session.pause("listener")
    assert "/listener is paused" in about(session.diagnose(), "pause")
    assert "/listener is paused" in in_vain(session)


def test_a_ghost_of_an_earlier_run(session: Session) -> None:
    ghost = rclpy.create_node("talker", context=session.context)
    session.run(talker)
    try:
        session.until(lambda: about(session.diagnose(), "name"))
        text = about(session.diagnose(), "name")
        assert "Several nodes are called /talker. One is in this session" in text
        assert "Several nodes are called /talker" in in_vain(session)
    finally:
        ghost.destroy_node()


def test_a_client_without_a_server(session: Session) -> None:
    node = session.run(lambda: Node("asker"))
    node.create_client(SetBool, "lamp")
    session.until(lambda: about(session.diagnose(), "service"))
    assert "uses the service /lamp, and nobody offers it" in about(session.diagnose(), "service")
    assert "/asker uses the service /lamp, and nobody offers it" in in_vain(session)


def test_a_service_whose_name_is_nearly_right(session: Session) -> None:
    node = session.run(Node, "asker")
    node.create_client(SetBool, "lampe")
    node.create_service(SetBool, "lamp", lambda _request, response: response)
    session.until(lambda: "is it /lamp?" in about(session.diagnose(), "service"))
    assert "/asker uses the service /lampe, and nobody offers it (is it /lamp?)" in in_vain(session)


def test_a_wait_that_knows_its_reason_keeps_to_it(session: Session) -> None:
    node = session.run(listener, "scna")
    node.create_client(SetBool, "lampe")
    session.run(talker)
    session.until(lambda: len(session.diagnose()) == 3)
    with pytest.raises(WaitTimeout) as caught:
        session.next_message(String, "scann", timeout=0)
    assert str(caught.value) == (
        "No message on /scann in 0 s. Nobody publishes on /scann (is it /scan?)."
    )


def test_more_than_three_reasons_are_counted(session: Session) -> None:
    node = session.run(Node, "eager")
    for number in range(5):
        node.create_client(SetBool, f"nobody_{number}")
    session.until(lambda: len(session.diagnose()) == 5)
    said = in_vain(session)
    assert said.count("nobody offers it") == 3
    assert said.endswith("session.diagnose() names 2 more.")


def test_a_session_that_need_not_explain_says_what_it_waited_for_alone(session: Session) -> None:
    session.run(listener)
    session.until(lambda: about(session.diagnose(), "topic"))
    session.explains = False
    assert in_vain(session) == "Waited 0 s in vain for the condition."
    session.explains = True
    assert "nobody publishes on it" in in_vain(session)


def test_a_recorder_and_a_goal_say_it_too(session: Session) -> None:
    robot = session.run(Robot)
    assert isinstance(robot, Robot)
    goal = session.send_goal(Fibonacci, "count", Fibonacci.Goal(order=3))
    session.pause("robot")
    try:
        with pytest.raises(WaitTimeout, match=r"has no result.*/robot is paused"):
            goal.wait(timeout=0)
        with pytest.raises(WaitTimeout, match=r"0 of 1 message arrived.*/robot is paused"):
            session.record("chatter", String).wait(timeout=0)
    finally:
        robot.go.set()


def test_a_service_of_another_type(session: Session) -> None:
    node = session.run(Node, "asker")
    node.create_client(SetBool, "lamp")
    with Session(domain_id=session.domain_id) as other:
        other.run(Node, "keeper").create_service(Trigger, "lamp", lambda _request, answer: answer)
        session.until(lambda: about(session.diagnose(), "type"))
        text = about(session.diagnose(), "type")
        assert "/asker uses the service /lamp as std_srvs/srv/SetBool, and /keeper offers" in text
        assert "it as std_srvs/srv/Trigger" in text
        assert "/keeper offers it as std_srvs/srv/Trigger" in in_vain(session)
        assert about(session.diagnose(), "service") == ""


NEXT_DOOR = """
import os
os.environ["JPY_SESSION_NAME"] = "work/ch05.ipynb"
import course
from rclpy.action import ActionServer
from rclpy.node import Node
from std_msgs.msg import String
from std_srvs.srv import SetBool, Trigger
from test_msgs.action import Fibonacci
with course.Session() as session:
    node = session.run(lambda: Node("next_door"))
    node.create_publisher(String, "weather", 10)
    node.create_service(SetBool, "gate", lambda request, answer: answer)
    server = ActionServer(node, Fibonacci, "tour", lambda goal: Fibonacci.Result())
    print(session.domain_id, flush=True)
    session.spin()
"""


def test_what_is_missed_here_is_in_another_notebook(
    session: Session,
    start_script: Callable[[str], subprocess.Popen[str]],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    process = start_script(NEXT_DOOR)
    assert process.stdout is not None
    domain = int(process.stdout.readline())
    monkeypatch.setattr(domain_discovery, "all_claims", EVERY_CLAIM)
    session.run(listener, "weather")
    asker = session.run(Node, "asker")
    asker.create_client(SetBool, "gate")
    client = ActionClient(asker, Fibonacci, "tour")
    session.until(lambda: len(about(session.diagnose(), "domain").splitlines()) >= 3, 30)
    text = about(session.diagnose(), "domain")
    for name in ("/weather", "/gate", "/tour"):
        assert f"{name} is offered by /next_door on domain {domain}, in ch05.ipynb" in text
    assert f"this session is on domain {session.domain_id}" in text
    assert f"course.session(domain_id={domain})" in text
    with pytest.raises(WaitTimeout, match=f"/weather is offered by /next_door on domain {domain}"):
        session.next_message(String, "weather", timeout=0)
    with pytest.raises(WaitTimeout, match=f"/gate is offered by /next_door on domain {domain}"):
        session.call(SetBool, "gate", SetBool.Request(), timeout=0)
    with pytest.raises(WaitTimeout, match=f"/tour is offered by /next_door on domain {domain}"):
        session.send_goal(Fibonacci, "tour", Fibonacci.Goal(), timeout=0)
    asker.create_publisher(String, "weather", 10)  # then it is not missed
    session.until(lambda: "/weather" not in about(session.diagnose(), "domain"))
    os.kill(process.pid, signal.SIGSTOP)
    try:  # nobody waits for who does not answer
        assert "/next_door" not in about(session.diagnose(), "domain")
    finally:
        os.kill(process.pid, signal.SIGCONT)
    client.destroy()


def test_whoever_asks_nonsense_gets_no_answer_and_does_no_harm(session: Session) -> None:
    session.run(talker)
    session.until(lambda: session.offered(["/scan"]))
    claim = leases.lease_claim(session.domain_id, port_bases.current_base())
    with new_socket() as sock:
        claim.send(sock, b"")  # from nowhere
        bind_anywhere(sock)
        sock.settimeout(10)
        for nonsense in (b"", b"{", b"5", b"[1, null, {}]", b'["not a name", "~"]', b"[" * 9000):
            claim.send(sock, nonsense)
        claim.send(sock, b'["/scan"]')
        while not (answer := json.loads(sock.recv(65536)))["offers"]:
            pass
    assert answer["offers"] == {"/scan": ["/talker"]}
    assert answer["domain_id"] == session.domain_id


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
    session.until(lambda: "/remote" in reader.read_graph(session.observer).nodes, 30)
    session.until(lambda: session.observer.count_services("/remote/list_parameters"), 30)
    session.until(lambda: not about(session.diagnose(), "node"), 30)
    os.kill(process.pid, signal.SIGSTOP)
    try:
        session.until(lambda: about(session.diagnose(), "node"), 30)
        text = about(session.diagnose(), "node")
        assert "/remote is on the graph, but did not answer" in text
        assert "/remote is on the graph, but did not answer within 1 s" in in_vain(session)
    finally:
        os.kill(process.pid, signal.SIGCONT)


def test_two_domains_in_one_kernel_and_one_set_in_vain(
    session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", "111")
    with Session() as other:
        other.run(talker)
        text = about(session.diagnose(), "domain")
        said = in_vain(session)
    assert f"another one of this kernel, with /talker, is on {other.domain_id}" in said
    assert said.index("another one of this kernel") < said.index("ROS_DOMAIN_ID is 111")
    assert f"another one of this kernel, with /talker, is on {other.domain_id}" in text
    assert "ROS_DOMAIN_ID is 111" in text


def test_a_wait_in_vain_says_what_a_diagnosis_says(session: Session) -> None:
    session.run(talker, qos_profile_sensor_data)
    session.run(listener)
    session.until(lambda: about(session.diagnose(), "QoS"))
    with pytest.raises(WaitTimeout, match="do not connect on /scan: reliability"):
        session.until(threading.Event().is_set, timeout=0.05)


def test_a_diagnosis_is_escaped_in_a_notebook(session: Session) -> None:
    from course.doctor.finding import make_problem

    shown = Diagnosis([make_problem("x", "<b>", "a & b")])._repr_html_()
    assert "&lt;b&gt;" in shown
    assert "a &amp; b" in shown
