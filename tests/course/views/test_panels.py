"""The panels over real nodes: what is typed reaches the node, and what it says reaches the view."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import pytest
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from rclpy.node import Node
from rclpy.parameter import Parameter
from test_msgs.action import Fibonacci
from test_msgs.msg import Nested
from test_msgs.srv import Arrays

from course import Session
from course.errors import CourseError, SessionError, WaitTimeout
from course.runtime.actions import GoalState
from course.values import MisfitError
from course.views.live import MAX_FRAME, LiveView
from course.watch import forms
from course.watch.parameter_values import ParameterError
from tests.robot import Robot


@pytest.fixture
def busy() -> Iterator[Session]:
    """Give a session whose nodes may block in one of three threads."""
    with Session(threads=3) as opened:
        yield opened


def shown(view: LiveView) -> dict[str, Any]:
    frame: dict[str, Any] = view.widget.frame
    return frame


def say(view: LiveView, **message: Any) -> None:
    """Do what the browser does."""
    view._heard(view.widget, message, [])


def test_a_service_is_called_by_its_form(session: Session) -> None:
    session.run(Robot)
    console = session.service("lamp")
    (field,) = shown(console)["fields"]
    assert (field["path"], field["kind"], field["default"]) == ("data", "checkbox", "false")
    say(console, call={"data": True})
    session.until(lambda: [c["answer"] for c in shown(console)["calls"] if c["answer"]])
    (call,) = shown(console)["calls"]
    assert call["answer"] == {"success": True, "message": "lamp"}
    assert call["time"].endswith(" ms")
    assert "1: {data: true} -> {success: true, message: lamp}" in console.words()


def test_a_service_that_is_gone_is_a_sentence_in_the_view(session: Session) -> None:
    session.run(Robot)
    console = session.service("lamp", timeout=0.2)
    session.stop("robot")
    say(console, call={"data": True})
    session.until(lambda: [c["problem"] for c in shown(console)["calls"] if c["problem"]])
    assert "Nobody offers /lamp" in shown(console)["calls"][0]["problem"]


def test_long_answers_still_fit_into_a_frame(session: Session) -> None:
    def serve() -> Node:
        node = Node("talkative")

        def answer(_request: Arrays.Request, response: Arrays.Response) -> Arrays.Response:
            response.string_values = ["z" * 300_000] * 3
            response.float64_values = [float("nan"), float("inf"), 0.0]
            return response

        node.create_service(Arrays, "big", answer)
        return node

    session.run(serve)
    console = session.service("big")
    for _ in range(10):
        say(console, call={})
    session.until(lambda: sum(c["answer"] is not None for c in shown(console)["calls"]) == 10, 20)
    assert len(json.dumps(shown(console), allow_nan=False)) < MAX_FRAME
    assert len(console.words()) < MAX_FRAME
    assert console.calls[0].answer is not None
    assert console.calls[0].answer["string_values"][0].endswith("… 298000 more")


def test_what_does_not_fit_is_said_beside_the_form(session: Session) -> None:
    session.run(Robot)
    view = session.action("count")
    say(view, goal={"order": "many"})
    assert view.frame()["problem"] == "order takes int32, not 'many'."
    with pytest.raises(MisfitError, match="order takes int32"):
        view.send(order=0.5)


def test_goals_pass_through_their_states(busy: Session) -> None:
    robot = busy.run(Robot)
    assert isinstance(robot, Robot)
    view = busy.action("count")
    say(view, goal={"order": "2"})
    busy.until(lambda: view.goals and view.goals[0].state == GoalState.EXECUTING)
    busy.until(lambda: view.goals[0].feedback == 1)
    robot.go.set()
    busy.until(lambda: view.goals[0].result is not None and view.goals[0].over)
    (goal,) = view.goals
    assert goal.state == GoalState.SUCCEEDED
    assert goal.result == {"sequence": [0, 1, 1]}
    assert goal.asked == {"order": 2}
    assert "SUCCEEDED" in view.words()
    assert [name for name, _ in view.frame()["goals"][0]["states"]][-1] == "SUCCEEDED"


def test_a_goal_of_somebody_else_is_seen_and_can_be_cancelled(busy: Session) -> None:
    busy.run(Robot)
    view = busy.action("count")
    run = busy.send_goal(Fibonacci, "count", Fibonacci.Goal(order=3))
    busy.until(lambda: view.goals and view.goals[0].state == GoalState.EXECUTING)
    say(view, cancel=view.goals[0].number)
    run.wait()
    assert run.status == GoalState.CANCELED
    busy.until(lambda: view.goals[0].over)
    assert view.goals[0].state == GoalState.CANCELED


def test_a_rejected_goal_is_said(busy: Session) -> None:
    busy.run(Robot)
    view = busy.action("count")
    view.send(order=-1)
    busy.until(lambda: view.goals)
    assert view.goals[0].problem == "The server rejected this goal."
    assert view.goals[0].over


def test_parameters_have_controls_from_their_descriptors(session: Session) -> None:
    session.run(Robot)
    panel = session.parameters("robot")
    kinds = {entry.name: entry.kind for entry in panel.entries}
    assert kinds == {"speed": "slider", "name": "text", "lights": "checkbox", "legs": "number"}
    speed = next(entry for entry in panel.entries if entry.name == "speed")
    assert (speed.least, speed.most, speed.step, speed.description) == (0.0, 2.0, 0.5, "m/s")
    assert "speed: 0.5 (0 to 2)  # m/s" in panel.words()


def test_a_parameter_is_changed_and_a_refusal_has_its_reason(session: Session) -> None:
    robot = session.run(Robot)
    panel = session.parameters(robot)
    say(panel, set="speed", value="1.5")
    assert robot.get_parameter("speed").value == 1.5
    say(panel, set="legs", value="100")
    assert "no insect has so many" in panel.frame()["problem"]
    assert robot.get_parameter("legs").value == 4
    say(panel, set="legs", value="6")
    assert panel.frame()["problem"] == ""
    session.until(lambda: {e["name"]: e["value"] for e in shown(panel)["entries"]}["legs"] == 6)


@pytest.mark.parametrize(
    ("name", "value", "sentence"),
    [
        ("legs", "two", "legs takes a whole number, not 'two'."),
        ("legs", "2.5", "legs takes a whole number, not '2.5'."),
        ("speed", "fast", "speed takes a number, not 'fast'."),
        ("speed", "9.0", "refused speed = 9.0"),
        ("wings", "1", "/robot has no parameter 'wings': it has legs, lights,"),
        ("lights", "perhaps", "lights takes true or false, not 'perhaps'."),
        ("legs", ".inf", "legs takes a whole number, not '.inf'."),
        ("legs", str(2**70), f"legs takes {-(2**63)} to {2**63 - 1}, not {2**70}."),
        ("legs", "9" * 5000, "legs takes a whole number, not '9999"),
        ("legs", "", "legs takes a whole number, not ''."),
        ("legs", "[a", "legs takes a whole number, not '[a'."),
        ("name", "a\0b", "name takes text, not"),
    ],
)
def test_a_value_that_does_not_fit_is_a_sentence(
    session: Session, name: str, value: str, sentence: str
) -> None:
    session.run(Robot)
    with pytest.raises(CourseError) as caught:
        session.parameters("robot").set(name, value)
    assert sentence in str(caught.value)


class Odd(Node):
    """Has parameters of every type, one without a value, and one that may change its type."""

    def __init__(self) -> None:
        super().__init__("odd")
        for name, value in ODD.items():
            self.declare_parameter(name, value)
        self.declare_parameter("unset", Parameter.Type.INTEGER)
        endless = FloatingPointRange(from_value=0.0, to_value=float("inf"))
        about = ParameterDescriptor(floating_point_range=[endless])
        self.declare_parameter("endless", 1.0, about)
        self.declare_parameter("any", None, ParameterDescriptor(dynamic_typing=True))


ODD = {
    "bytes": [b"\x01", b"\xff"],
    "bools": [True, False],
    "wholes": [1, 2**60],
    "numbers": [0.5, float("inf")],
    "texts": ["a, b", "5", "true"],
    "limit": float("inf"),
    "none": float("nan"),
    "big": 2**62,
}


def test_parameters_of_every_type_are_shown_and_set_as_they_are_shown(session: Session) -> None:
    node = session.run(Odd)
    panel = session.parameters("odd")
    frame = shown(panel)
    json.dumps(frame, allow_nan=False)
    entries = {entry["name"]: entry for entry in frame["entries"]}
    assert set(entries) == {*ODD, "unset", "any", "endless"}
    assert entries["endless"]["kind"] == "number"
    assert entries["bytes"]["value"] == "[1, 255]"
    assert entries["texts"]["value"] == "['a, b', '5', 'true']"
    assert entries["limit"]["value"] == ".inf"
    assert entries["unset"]["value"] is None
    assert "  unset: not set" in panel.words()
    for name in ODD:
        before = repr(node.get_parameter(name).get_parameter_value())
        say(panel, set=name, value=str(entries[name]["value"]))
        assert panel.frame()["problem"] == ""
        assert repr(node.get_parameter(name).get_parameter_value()) == before, name
    assert panel.widget.ended == ""


def test_a_parameter_without_a_value_gets_one(session: Session) -> None:
    node = session.run(Odd)
    panel = session.parameters("odd")
    with pytest.raises(ParameterError, match="unset takes a whole number, not 'soon'"):
        panel.set("unset", "soon")
    panel.set("unset", "3")
    assert node.get_parameter("unset").value == 3
    for typed, value in (("1e-3", 0.001), ("[1, 2]", [1, 2]), ("word", "word"), ("7", 7)):
        panel.set("any", typed)
        found = node.get_parameter("any").value
        assert (list(found) if isinstance(value, list) else found) == value
    with pytest.raises(ParameterError, match="any takes a value, or a list of one kind of value"):
        panel.set("any", "{a: 1}")


def test_a_change_from_elsewhere_is_shown(session: Session) -> None:
    robot = session.run(Robot)
    panel = session.parameters("robot")
    assert shown(panel)["entries"]
    robot.set_parameters([Parameter("name", value="c3")])
    session.until(lambda: "c3" in [e["value"] for e in shown(panel)["entries"]])


def test_the_log_panel_has_the_latest_lines(session: Session) -> None:
    robot = session.run(Robot)
    panel = session.log_panel()
    for number in range(300):
        robot.get_logger().info(f"line {number}")
    session.until(lambda: shown(panel)["rows"] and shown(panel)["rows"][-1][3] == "line 299")
    assert len(shown(panel)["rows"]) == 200
    assert shown(panel)["rows"][-1][1:3] == ["INFO", "/robot"]
    assert "line 299" in panel.words()


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda s: s.service("lampe"), "Nobody offers the service /lampe"),
        (lambda s: s.action("cont"), "Is it /count?"),
        (lambda s: s.log_panel(level="LOUD"), "no log level 'LOUD'"),
        (lambda s: s.service("bad name"), "'bad name' is not a service name: "),
        (lambda s: s.service(""), "'' is not a service name: "),
        (lambda s: s.service(5), "The service is a string, such as '/reset', not 5."),
        (lambda s: s.service("lamp", Fibonacci), "The type is a service class"),
        (lambda s: s.service("lamp", timeout="long"), "timeout is a number of seconds"),
        (lambda s: s.action("1 bad"), "'1 bad' is not an action name: "),
        (lambda s: s.action("count", Nested), "The type is an action class"),
        (lambda s: s.parameters("bad name"), "'bad name' is not a node name: "),
        (lambda s: s.parameters(""), "'' is not a node name: node name must not be empty."),
        (lambda s: s.parameters(5), "The name of a node is a string, such as '/camera', not 5."),
    ],
)
def test_what_is_not_there_is_named(session: Session, make: Any, sentence: str) -> None:
    session.run(Robot)
    with pytest.raises(SessionError) as caught:
        make(session)
    assert sentence in str(caught.value)


def test_a_panel_of_no_node_says_so(session: Session) -> None:
    with pytest.raises(WaitTimeout, match="/ghost/list_parameters"):
        session.parameters("ghost")


def test_forms_flatten_nested_messages() -> None:
    fields = {field.path: field for field in forms.fields(Nested)}
    assert fields["basic_types_value.bool_value"].kind == "checkbox"
    message = forms.message(Nested, {"basic_types_value.int8_value": "-3"})
    assert message.basic_types_value.int8_value == -3
