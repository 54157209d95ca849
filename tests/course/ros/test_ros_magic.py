"""``%ros`` answers as the ROS 2 command line does, on real nodes, and complains in sentences."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import rclpy
from IPython.core.completer import IPCompleter, provisionalcompleter
from IPython.core.interactiveshell import InteractiveShell
from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rclpy.action import ActionServer
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_msgs.msg import String
from std_srvs.srv import SetBool
from test_msgs.action import Fibonacci
from test_msgs.msg import BasicTypes

import course
from course.errors import CourseError
from course.ros import magic


class Robot(Node):
    """Publishes, serves, acts, and has a parameter that knows its bounds."""

    def __init__(self) -> None:
        super().__init__("robot")
        self.declare_parameter("speed", 0.5, ParameterDescriptor(description="m/s"))
        self.add_on_set_parameters_callback(self._judge)
        publisher = self.create_publisher(String, "chatter", 10)
        self.create_timer(0.02, lambda: publisher.publish(String(data="hello")))
        self.create_subscription(String, "orders", self._obey, 10)
        self.orders: list[str] = []
        self.create_service(SetBool, "lamp", self._switch)
        self._action = ActionServer(self, Fibonacci, "fibonacci", self._count)

    def _judge(self, parameters: list[Any]) -> SetParametersResult:
        fast = any(p.name == "speed" and p.value > 1 for p in parameters)
        return SetParametersResult(successful=not fast, reason="at most 1 m/s" if fast else "")

    def _obey(self, message: String) -> None:
        self.orders.append(message.data)

    def _switch(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        response.success, response.message = True, f"lamp {request.data}"
        return response

    def _count(self, goal: Any) -> Fibonacci.Result:
        goal.publish_feedback(Fibonacci.Feedback(sequence=[0, 1]))
        goal.succeed()
        return Fibonacci.Result(sequence=[0, 1, 1])


@pytest.fixture
def robot() -> Iterator[Robot]:
    node = course.run(Robot)
    assert isinstance(node, Robot)
    yield node
    course.close()


def answer(capsys: pytest.CaptureFixture[str], line: str) -> str:
    magic.ros(line)
    return capsys.readouterr().out


def test_topics(robot: Robot, capsys: pytest.CaptureFixture[str]) -> None:
    assert answer(capsys, "topic list") == "/chatter\n/orders\n"
    assert "/chatter [std_msgs/msg/String]" in answer(capsys, "topic list -t")
    assert "/rosout" in answer(capsys, "topic list -a")
    info = answer(capsys, "topic info -v chatter")
    assert "Publisher count: 1\n  Node: /robot\n  Type: std_msgs/msg/String" in info
    assert "    reliability: RELIABLE" in info
    assert "    depth: 10" in info
    assert answer(capsys, "topic echo /chatter -n 2") == "data: hello\n---\ndata: hello\n\n"


def test_the_rate_is_measured(robot: Robot, capsys: pytest.CaptureFixture[str]) -> None:
    text = answer(capsys, "topic hz /chatter")
    assert 20 < float(text.split()[2]) < 51
    assert "period: min" in text


@pytest.mark.parametrize("heard", [0, 1, 2])
def test_a_slow_rate_takes_two_messages_and_else_says_how_to_listen_longer(
    robot: Robot, capsys: pytest.CaptureFixture[str], heard: int
) -> None:
    publisher = robot.create_publisher(String, "slow", 10)
    left = iter(range(heard))

    def tick() -> None:
        if publisher.get_subscription_count() and next(left, None) is not None:
            publisher.publish(String(data="tick"))

    robot.create_timer(0.5, tick)
    line = "topic hz slow --timeout 3"
    if heard == 2:
        text = answer(capsys, line)
        assert "Hz over 2 messages" in text
        assert 0.3 < float(text.split()[2]) < 2.1
        return
    with pytest.raises(CourseError) as caught:
        magic.ros(line)
    said = str(caught.value)
    assert said.startswith("Only one message" if heard else "No message")
    assert "arrived on /slow in 3 s, and a rate takes two." in said
    assert said.endswith("A slow topic takes longer: %ros topic hz slow --timeout 12.")


def test_a_rate_of_nothing_is_not_listened_for_longer(robot: Robot) -> None:
    with pytest.raises(CourseError, match="Nobody publishes on /orders") as caught:
        magic.ros("topic hz /orders --timeout 0.2")
    assert "--timeout" not in str(caught.value)


def test_publishing_reaches_the_node(robot: Robot, capsys: pytest.CaptureFixture[str]) -> None:
    assert "Published on /orders" in answer(capsys, "topic pub /orders '{data: go}'")
    course.until(lambda: robot.orders == ["go"])


def test_nodes(robot: Robot, capsys: pytest.CaptureFixture[str]) -> None:
    assert answer(capsys, "node list") == "/robot\n"
    info = answer(capsys, "node info robot")
    assert "  Publishers:\n" in info
    assert "    /chatter: std_msgs/msg/String" in info
    assert "  Service servers:\n" in info
    assert "  Action servers:\n    /fibonacci: test_msgs/action/Fibonacci" in info


def test_services_and_actions(robot: Robot, capsys: pytest.CaptureFixture[str]) -> None:
    assert answer(capsys, "service list") == "/lamp\n"
    assert "message: lamp True" in answer(capsys, "service call /lamp '{data: true}'")
    assert answer(capsys, "action list -t") == "/fibonacci [test_msgs/action/Fibonacci]\n"
    goal = answer(capsys, "action send_goal fibonacci '{order: 2}' -f")
    assert "feedback: {'sequence': [0, 1]}" in goal
    assert goal.endswith("state: SUCCEEDED\n")


def test_parameters(robot: Robot, capsys: pytest.CaptureFixture[str]) -> None:
    assert "  speed" in answer(capsys, "param list /robot")
    assert answer(capsys, "param set robot speed 0.8") == "/robot: speed is now 0.8\n"
    assert answer(capsys, "param get /robot speed") == "0.8\n"
    refused = answer(capsys, "param set robot speed 2.0")
    assert refused == "/robot refused speed = 2.0: at most 1 m/s\n"


def test_parameters_of_odd_types(robot: Robot, capsys: pytest.CaptureFixture[str]) -> None:
    robot.declare_parameter("unset", Parameter.Type.STRING)
    robot.declare_parameter("bytes", [b"\x01"])
    assert "  unset" in answer(capsys, "param list robot")
    assert answer(capsys, "param get robot unset") == "unset of /robot has no value yet.\n"
    assert answer(capsys, "param get robot speed") == "0.5\n"
    assert answer(capsys, "param set robot unset 5") == "/robot: unset is now 5\n"
    assert answer(capsys, """param set robot unset '"7"'""") == "/robot: unset is now 7\n"
    assert answer(capsys, "param set robot bytes '[2, 3]'") == "/robot: bytes is now [2, 3]\n"
    assert answer(capsys, "param set robot speed 1e-1") == "/robot: speed is now 0.1\n"
    assert answer(capsys, "param set robot use_sim_time false").endswith("is now false\n")


def test_a_node_without_parameter_services_hides_no_other(
    robot: Robot, capsys: pytest.CaptureFixture[str]
) -> None:
    course.run(lambda: Node("bare", start_parameter_services=False))
    stuck = rclpy.create_node("forgotten", context=course.session().context)
    try:
        course.until(lambda: "/forgotten" in answer(capsys, "node list"))
        course.until(lambda: "  speed" in answer(capsys, "param list"), 30)
        text = answer(capsys, "param list")
        assert "/bare:\n  (its parameter services do not answer, or it has none)" in text
        assert "/forgotten:\n  (its parameter services do not answer" in text
        assert magic.candidates(["param", "get", "forgotten", ""]) == []
        with pytest.raises(CourseError, match="/bare has no parameter services"):
            magic.ros("param list bare")
    finally:
        stuck.destroy_node()


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("geometry_msgs/msg/PoseStamped", ["std_msgs/Header header", "\tstring frame_id"]),
        ("std_srvs/srv/SetBool", ["bool data", "---", "bool success", "string message"]),
        ("test_msgs/action/Fibonacci", ["int32 order", "---", "int32[] sequence"]),
        ("sensor_msgs/msg/BatteryState", ["uint8 POWER_SUPPLY_STATUS_CHARGING=1"]),
        ("test_msgs/msg/Constants", ["byte BYTE_CONST=50", "float32 FLOAT32_CONST=1.125"]),
        ("test_msgs/msg/Constants", ["bool BOOL_CONST=true"]),
    ],
)
def test_interfaces(capsys: pytest.CaptureFixture[str], name: str, parts: list[str]) -> None:
    lines = answer(capsys, f"interface show {name}").splitlines()
    assert all(part in lines for part in parts)


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        ("", "Usage: %ros"),
        ("topic", "Usage: %ros topic"),
        ("topic shout /x", "shout"),
        ("topic info", "The following arguments are required: topic"),
        ("topic info /nowhere", "There is no topic /nowhere: there are /chatter, /orders."),
        ("topic echo /nowhere --timeout 0.1", "/nowhere"),
        ("topic pub /orders '{dat: go}'", "std_msgs/msg/String has no field 'dat'"),
        ("topic pub /orders '{data: 3}'", "data takes string, not 3"),
        ("topic pub /new '{data: x}'", "name it with --type"),
        ("node info ghost", "There is no node /ghost: there are /robot."),
        ("service call /lamp '{data: 7}'", "data takes bool, not 7"),
        ("service call /light", "There is no service /light: there are /lamp."),
        ("action send_goal /fly", "There is no action /fly: there are /fibonacci."),
        ("param get robot colour", "/robot has no parameter 'colour'"),
        ("param set ghost speed 1", "There is no node /ghost"),
        ("interface show no_msgs/msg/Such", "There is no no_msgs/msg/Such here"),
        ("topic echo 'unfinished", "No closing quotation"),
        ("topic echo /chatter -n -3", "-n is a whole number, at least 1, not -3"),
        ("topic echo /chatter --timeout nan", "timeout is a number of seconds, 0 or more, not nan"),
        ("topic echo 'bad name'", "'bad name' is not a topic name"),
        ("topic pub 'bad name' '{}'", "'bad name' is not a topic name"),
        (
            "topic pub /b '{float32_value: 1.0e+300}' --type test_msgs/msg/BasicTypes",
            "float32_value",
        ),
        (
            "topic pub /s '{bounded_string_value: aaaaaaaaaaaaaaaaaaaaaaa}' --type "
            "test_msgs/msg/Strings",
            "at most 22 characters, not 23",
        ),
        (
            "topic pub /b '{float64_value: %s}' --type test_msgs/msg/BasicTypes" % ("9" * 400),
            "float64_value takes",
        ),
        ("topic pub /orders '{data: [}'", "is not YAML"),
        ("topic pub /orders '{}' --type os/path/join", "'os/path/join' is not the name of"),
        ("topic pub /orders '{}' --type std_srvs/srv/SetBool", "is no msg type"),
        ("service call /lamp '{}' --type std_msgs/msg/String", "is no srv type: name one such as"),
        ("service call /lamp '{}' --type os/srv/path", "There is no os/srv/path here"),
        ("param set robot speed x", "speed takes a number, not 'x'."),
        ("param set robot speed '{a: 1}'", "speed takes a number, not '{a: 1}'."),
        ("param set robot ghost 1", "/robot has no parameter 'ghost': it has speed,"),
        ("param get 'bad name' x", "'bad name' is not a node name"),
        ("interface show ''", "'' is not the name of an interface: write package/kind/Name"),
        ("interface show ../x/y", "'../x/y' is not the name of an interface"),
        ("interface show a/b/c/d", "'a/b/c/d' is not the name of an interface"),
        ("interface show String", "'String' is not the name of an interface"),
        ("interface show std_msgs/msg/sys", "There is no std_msgs/msg/sys here"),
    ],
)
def test_a_mistake_is_a_sentence(robot: Robot, line: str, sentence: str) -> None:
    with pytest.raises(CourseError) as caught:
        magic.ros(line)
    assert sentence in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["evil/b/c/d", "evil/msg/D", "evil/D", "evil/os/D"])
def test_no_file_of_the_learners_runs_for_the_name_of_a_type(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    (tmp_path / "evil.py").write_text("raise SystemExit('it ran')", encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(CourseError, match="evil"):
        magic.ros(f"interface show {name}")


def test_parts_of_an_interface_and_short_names_are_shown(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert answer(capsys, "interface show test_msgs/action/Fibonacci_Goal") == "int32 order\n"
    feedback = answer(capsys, "interface show test_msgs/action/Fibonacci_FeedbackMessage")
    assert "\tint32[] sequence" in feedback
    assert "goal" in answer(capsys, "interface show test_msgs/action/Fibonacci_SendGoal_Request")
    assert answer(capsys, "interface show std_msgs/String") == "string data\n"
    assert "string<=22 bounded_string_value" in answer(
        capsys, "interface show test_msgs/msg/Strings"
    )


def test_numbers_are_read_as_people_type_them(
    robot: Robot, capsys: pytest.CaptureFixture[str]
) -> None:
    heard: list[Any] = []
    robot.create_subscription(BasicTypes, "basic", heard.append, 10)
    answer(capsys, "topic pub /basic '{float64_value: 1e-3, float32_value: 2}'")
    course.until(lambda: heard)
    assert (heard[0].float64_value, heard[0].float32_value) == (0.001, 2.0)


@pytest.mark.parametrize("command", ["echo", "hz"])
def test_a_topic_that_is_not_there_is_waited_for_as_long_as_asked(
    robot: Robot, command: str
) -> None:
    with pytest.raises(CourseError) as caught:
        magic.ros(f"topic {command} /chattr --timeout 0.2")
    assert "Nobody publishes on /chattr (is it /chatter?), so after 0.2 s" in str(caught.value)


def test_help_is_shown_and_ends_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    assert "echo" in answer(capsys, "topic -h")


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ([""], "param"),
        (["topic", ""], "echo"),
        (["topic", "info", ""], "/chatter"),
        (["topic", "info", "-v", ""], "/chatter"),
        (["topic", "echo", "-n", "3", ""], "/chatter"),
        (["topic", "pub", "--type", "std_msgs/msg/String", ""], "/chatter"),
        (["topic", "pub", "/new", "{}", "--type", ""], "std_msgs/msg/String"),
        (["service", "call", ""], "/lamp"),
        (["action", "send_goal", ""], "/fibonacci"),
        (["param", "get", "/robot", ""], "speed"),
        (["param", "get", "robot", ""], "speed"),
        (["interface", "show", ""], "std_msgs/msg/String"),
    ],
)
def test_the_tab_key_offers_what_may_follow(robot: Robot, words: list[str], expected: str) -> None:
    course.until(lambda: expected in magic.candidates(words), 30)


@pytest.mark.parametrize(
    "words",
    [
        ["x", ""],
        ["topic", "x", "y", ""],
        ["topic", "echo", "-n", ""],
        ["param", "get", "/no", ""],
        ["param", "get", "bad name!", ""],
    ],
)
def test_the_tab_key_offers_nothing_where_nothing_can_follow(
    robot: Robot, words: list[str]
) -> None:
    assert magic.candidates(words) == []


def test_the_magic_and_its_completion_are_in_the_shell(robot: Robot) -> None:
    shell = InteractiveShell.instance()
    try:
        shell.run_line_magic("load_ext", "course")
        line = "%ros topic info /ch"
        assert isinstance(shell.Completer, IPCompleter)
        with provisionalcompleter():
            matches = {c.text for c in shell.Completer.completions(line, len(line))}
        assert "/chatter" in matches
    finally:
        InteractiveShell.clear_instance()
