"""``%ros`` answers as the ROS 2 command line does, on real nodes, and complains in sentences."""

from __future__ import annotations

import _thread
import re
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import rclpy
from geometry_msgs.msg import PoseStamped
from IPython.core.completer import IPCompleter, provisionalcompleter
from IPython.core.interactiveshell import InteractiveShell
from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rclpy.action import ActionServer
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.time import Time
from sensor_msgs.msg import TimeReference
from std_msgs.msg import String
from std_srvs.srv import SetBool
from test_msgs.action import Fibonacci
from test_msgs.msg import BasicTypes

import course
from course.errors import CourseError
from course.ros_magic import arguments, magic, repetitions
from course.ros_magic.arguments import UsageError


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
    began = time.monotonic()
    text = answer(capsys, "topic hz /chatter")
    assert_is_a_rate(text, time.monotonic() - began)


def assert_is_a_rate(text: str, elapsed: float) -> None:
    """Of whatever a busy machine brought in ``elapsed`` s: the mean of what lies between two."""
    rate, shortest, longest = (
        float(re.search(rf"{before} ([0-9.]+)", text)[1])  # type: ignore[index]
        for before in ("average rate:", "min", "max")
    )
    messages = int(re.search(r"over (\d+) messages", text)[1])  # type: ignore[index]
    assert (messages - 1) / rate <= elapsed
    rounded = 0.0001 + 0.0005 / rate**2  # s: of a period, and of a rate, as they are printed
    assert shortest - rounded <= 1 / rate <= longest + rounded


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
        began = time.monotonic()
        text = answer(capsys, line)
        assert "Hz over 2 messages" in text
        assert_is_a_rate(text, time.monotonic() - began)
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


# What the pages of docs.ros.org for Jazzy type, with the names of this robot.
@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("topic list -t", "/orders [std_msgs/msg/String]"),
        ("topic list -c", "2\n"),
        ("topic list -v", "Published topics:\n * /chatter [std_msgs/msg/String] 1 publisher\n"),
        ("topic list --include-hidden-topics", "/rosout"),
        ("topic type /chatter", "std_msgs/msg/String\n"),
        ("topic find std_msgs/msg/String", "/chatter\n/orders\n"),
        ("topic info /chatter --verbose", "    reliability: RELIABLE"),
        ("topic echo --once /chatter", "data: hello\n"),
        ("topic echo /chatter std_msgs/msg/String --once", "data: hello\n"),
        ("topic echo /chatter std_msgs/String", "data: hello\n"),
        ("topic echo /chatter --field data", "hello\n"),
        ("topic echo --flow-style /chatter", "{data: hello}\n"),
        ("topic echo /chatter --qos-reliability best_effort --qos-depth 5", "data: hello\n"),
        ("topic echo /chatter --qos-profile sensor_data -f", "data: hello\n"),
        ("topic hz /chatter --window 5", "over 5 messages"),
        ("node list -c", "1\n"),
        ("service list --show-types", "/lamp [std_srvs/srv/SetBool]"),
        ("service list -c", "1\n"),
        ("service type /lamp", "std_srvs/srv/SetBool\n"),
        ("service info /lamp", "Type: std_srvs/srv/SetBool\nClients count: 0\nServices count: 1"),
        ("service find std_srvs/srv/SetBool", "/lamp\n"),
        ('service call /lamp std_srvs/srv/SetBool "{data: true}"', "message: lamp True"),
        ("service call /lamp std_srvs/srv/SetBool '{data: true}'", "message: lamp True"),
        ('service call lamp std_srvs/SetBool "data: true"', "message: lamp True"),
        ("service call /lamp std_srvs/srv/SetBool", "message: lamp False"),
        ("service call /lamp", "message: lamp False"),
        ('service call /lamp "{data: true}" --type std_srvs/srv/SetBool', "message: lamp True"),
        ("action list -t", "/fibonacci [test_msgs/action/Fibonacci]"),
        ("action type /fibonacci", "test_msgs/action/Fibonacci\n"),
        ("action info /fibonacci -t", "Action servers: 1\n    /robot [test_msgs/action/Fibonacci]"),
        (
            'action send_goal /fibonacci test_msgs/action/Fibonacci "{order: 2}" --feedback',
            "feedback: {'sequence': [0, 1]}",
        ),
        ('action send_goal -f /fibonacci test_msgs/action/Fibonacci "{order: 2}"', "SUCCEEDED"),
        ('action send_goal /fibonacci test_msgs/Fibonacci "order: 2"', "state: SUCCEEDED"),
        ("action send_goal /fibonacci test_msgs/action/Fibonacci", "state: SUCCEEDED"),
        ("param get --hide-type /robot speed", "0.5\n"),
        (
            "param describe /robot speed",
            "Parameter name: speed\n  Type: a number\n  Description: m/s\n",
        ),
        ("interface show std_srvs/SetBool", "bool data\n---\n"),
        ("interface list --only-actions", "test_msgs/action/Fibonacci"),
        ("interface package std_srvs", "std_srvs/srv/Empty\nstd_srvs/srv/SetBool\n"),
        ("interface packages", "std_srvs\n"),
        ("interface proto geometry_msgs/msg/Point", '"{x: 0.0, y: 0.0, z: 0.0}"\n'),
    ],
)  # fmt: skip
def test_a_line_of_a_tutorial_is_taken(
    robot: Robot, capsys: pytest.CaptureFixture[str], line: str, said: str
) -> None:
    assert said in answer(capsys, line)


@pytest.mark.parametrize(
    ("line", "orders"),
    [
        ('topic pub --once /orders std_msgs/msg/String "{data: go}"', ["go"]),
        ("topic pub -1 /orders std_msgs/msg/String '{data: go}'", ["go"]),
        ('topic pub /orders std_msgs/String "data: go" -1', ["go"]),
        ('topic pub /orders --once std_msgs/msg/String "{data: go}"', ["go"]),
        ('topic pub --once -w 1 /orders std_msgs/msg/String "data: \'go on\'"', ["go on"]),
        ("topic pub /orders std_msgs/msg/String", [""]),
        ("topic pub /orders '{data: go}' --type std_msgs/msg/String", ["go"]),
        ('topic pub -r 50 -t 3 /orders std_msgs/msg/String "{data: go}"', ["go"] * 3),
        ('topic pub --rate 50 --times 3 /orders "{data: go}" --timeout 20', ["go"] * 3),
        (
            'topic pub /orders std_msgs/msg/String "{data: go}" --qos-reliability reliable '
            "--qos-durability transient_local --qos-history keep_last --qos-depth 5",
            ["go"],
        ),
    ],
)  # fmt: skip
def test_what_a_tutorial_publishes_arrives(
    robot: Robot, capsys: pytest.CaptureFixture[str], line: str, orders: list[str]
) -> None:
    said = answer(capsys, line)
    course.until(lambda: robot.orders == orders)
    assert said.startswith("Published ")
    if len(orders) > 1:
        assert "Published 3 messages on /orders, to 1 subscription: {'data': 'go'}" in said


def test_what_has_a_rate_and_no_end_ends_by_itself(
    robot: Robot, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(repetitions, "TIMEOUT_S", 0.5)
    said = answer(capsys, "topic pub -r 10 /nobody std_msgs/msg/String")
    assert said == (
        "Published 5 messages on /nobody, to nobody: no subscription fits: {'data': ''}\n"
    )
    said = answer(capsys, 'service call -r 10 /lamp std_srvs/srv/SetBool "{data: true}"')
    assert said.count("message: lamp True") == 5


def test_an_interrupt_ends_what_has_a_rate_without_an_error(
    robot: Robot, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(repetitions, "TIMEOUT_S", 60.0)

    stopped: list[bool] = []

    def stop(_message: String) -> None:
        if len(robot.orders) >= 3 and not stopped:  # two may have come before this looks
            stopped.append(True)
            _thread.interrupt_main()

    robot.create_subscription(String, "orders", stop, 10)
    # A kernel has this handler; a worker of the tests may have none of Python's, and ignores it.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        said = answer(capsys, 'topic pub -r 20 /orders std_msgs/msg/String "{data: go}"')
    finally:
        signal.signal(signal.SIGINT, before or signal.SIG_DFL)
    assert said.startswith("Published ")
    assert 3 <= int(said.split()[1]) < 1000


def test_headers_and_times_are_filled_in(robot: Robot, capsys: pytest.CaptureFixture[str]) -> None:
    heard: list[Any] = []
    robot.create_subscription(PoseStamped, "pose", heard.append, 10)
    robot.create_subscription(TimeReference, "reference", heard.append, 10)
    before = time.time_ns()
    answer(capsys, "topic pub -1 /pose '{header: \"auto\", pose: {position: {x: 1.0}}}'")
    answer(
        capsys,
        "topic pub -1 /reference sensor_msgs/msg/TimeReference "
        '\'{header: "auto", time_ref: "now", source: "dumper"}\'',
    )
    course.until(lambda: len(heard) == 2)
    pose, reference = sorted(heard, key=lambda one: hasattr(one, "source"))
    assert pose.pose.position.x == 1.0
    for stamp in (pose.header.stamp, reference.header.stamp, reference.time_ref):
        assert before <= Time.from_msg(stamp).nanoseconds <= time.time_ns()


@pytest.mark.parametrize(
    ("line", "sentence"),
    [
        (
            'topic pub --once /orders std_msgs/msg/Int32 "{data: 3}"',
            "/orders is of type std_msgs/msg/String, not std_msgs/msg/Int32: DDS connects equal",
        ),
        ("topic echo /orders std_msgs/msg/Int32", "/orders is of type std_msgs/msg/String, not"),
        ("service call /lamp std_srvs/srv/Trigger", "/lamp is of type std_srvs/srv/SetBool, not"),
        (
            "action send_goal /fibonacci test_msgs/action/NestedMessage",
            "/fibonacci is of type test_msgs/action/Fibonacci, not test_msgs/action/NestedMessage",
        ),
        ("topic echo /chatter --field dat", "--field dat: 'dat' is no field there, it has data."),
        ("topic echo /chatter --field data.x", "'x' is no field there, it has none."),
        ("topic pub /orders -r 0", "--rate is above 0 and at most 1000 a second, not 0."),
        ("topic pub /orders -r nan", "--rate is above 0 and at most 1000 a second, not nan."),
        ("topic pub /orders -t 0", "--times is a whole number, at least 1, not 0"),
        ("topic pub /orders -1 -t 2", "--once and --times say different things"),
        ("topic pub --once -w 2 /orders --timeout 0.1", "in vain for 2 subscriptions of /orders"),
        ("topic pub /orders std_msgs/msg/String std_msgs/msg/String", "takes fields, as in"),
        ("topic find std_srvs/srv/SetBool", "is no msg type"),
        ("service type /light", "There is no service /light: there are /lamp."),
        ("action info /fly", "There is no action /fly: there are /fibonacci."),
        ("param describe robot colour", "/robot has no parameter 'colour'"),
    ],
)
def test_what_does_not_fit_is_a_sentence(robot: Robot, line: str, sentence: str) -> None:
    test_a_mistake_is_a_sentence(robot, line, sentence)


COMMANDS = [
    (noun, verb) for noun, module in arguments.noun_modules().items() for verb in module.VERBS
]


@pytest.mark.parametrize(("noun", "verb"), COMMANDS)
def test_an_unknown_argument_shows_the_usage_of_its_verb(noun: str, verb: str) -> None:
    with pytest.raises(UsageError) as caught:
        magic.ros(f"{noun} {verb} a b c d e --nonsense")
    sentence, usage, *rest = str(caught.value).splitlines()
    assert sentence.startswith(("Unrecognized arguments:", "The following arguments"))
    assert "--nonsense" in sentence
    assert usage.startswith(f"usage: %ros {noun} {verb}")
    assert len(rest) <= 22
    assert all(len(line) < 100 for line in rest)


@pytest.mark.parametrize(
    ("line", "sentence", "usage"),
    [
        ("", "A word is missing after %ros.", "usage: %ros NOUN VERB"),
        ("topic", "A word is missing after %ros topic.", "usage: %ros topic VERB"),
        ("topic shout /x", "'shout' is none of its words after %ros topic.", "  echo   "),
        ("rostopic list", "'rostopic' is none of its words after %ros.", "  topic   "),
        ("topic info", "The following arguments are required: TOPIC.", "usage: %ros topic info"),
        ("topic pub /a -r x", "Argument -r/--rate: invalid float value: 'x'.", "usage: %ros topic"),
        ("topic pub /a std_msgs/msg/String data: hi", "Unrecognized arguments: hi.", "in quotes"),
        ("topic bw /x", "'bw' is none of its words after %ros topic.", "  hz   "),
        ("topic echo /x --qos-durability often", "(choose from", "usage: %ros topic echo"),
    ],
)
def test_a_line_that_says_nothing_shows_the_usage(line: str, sentence: str, usage: str) -> None:
    with pytest.raises(UsageError) as caught:
        magic.ros(line)
    first, *block = str(caught.value).splitlines()
    assert sentence in first
    assert usage in "\n".join(block)


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
        assert magic.find_candidates(["param", "get", "forgotten", ""]) == []
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
        ("topic info /nowhere", "There is no topic /nowhere: there are /chatter, /orders."),
        ("topic echo /nowhere --timeout 0.1", "/nowhere"),
        ("topic pub /orders '{dat: go}'", "std_msgs/msg/String has no field 'dat'"),
        ("topic pub /orders '{data: 3}'", "data takes string, not 3"),
        ("topic pub /new '{data: x}'", "its type is unknown: name it behind the topic"),
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
    assert "interface" in answer(capsys, "-h")
    assert "echo" in answer(capsys, "topic -h")
    assert "-r N, --rate N" in answer(capsys, "topic pub --help")


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
        (["service", "call", "/lamp", ""], "std_srvs/srv/SetBool"),
        (["topic", "pub", "/orders", ""], "std_msgs/msg/String"),
        (["topic", "pub", "-r", "3", ""], "/orders"),
        (["topic", "pub", "/new", ""], "std_msgs/msg/Int32"),
        (["topic", "find", ""], "std_msgs/msg/Int32"),
        (["interface", "package", ""], "std_msgs"),
        (["action", "send_goal", ""], "/fibonacci"),
        (["param", "get", "/robot", ""], "speed"),
        (["param", "get", "robot", ""], "speed"),
        (["interface", "show", ""], "std_msgs/msg/String"),
    ],
)
def test_the_tab_key_offers_what_may_follow(robot: Robot, words: list[str], expected: str) -> None:
    course.until(lambda: expected in magic.find_candidates(words), 30)


@pytest.mark.parametrize(
    "words",
    [
        ["x", ""],
        ["topic", "x", "y", ""],
        ["topic", "echo", "-n", ""],
        ["topic", "pub", "-t", ""],
        ["param", "get", "/no", ""],
        ["param", "get", "bad name!", ""],
    ],
)
def test_the_tab_key_offers_nothing_where_nothing_can_follow(
    robot: Robot, words: list[str]
) -> None:
    assert magic.find_candidates(words) == []


def test_braces_are_yaml_also_where_a_variable_has_the_name_of_a_field(
    robot: Robot, capsys: pytest.CaptureFixture[str]
) -> None:
    shell = InteractiveShell.instance()
    try:
        shell.run_line_magic("load_ext", "course")
        shell.push({"data": "another", "order": 9})
        shell.run_cell("%ros topic pub /orders std_msgs/msg/String '{data: go}'")
        shell.run_cell("%ros topic pub /orders '{data: $data}'")
        course.until(lambda: robot.orders == ["go", "$data"])
        shell.run_cell("%ros topic pub /orders --nonsense")
        shown = capsys.readouterr().out
        assert "UsageError: Unrecognized arguments: --nonsense.\nusage: %ros topic pub" in shown
        assert "Traceback" not in shown
    finally:
        InteractiveShell.clear_instance()


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
