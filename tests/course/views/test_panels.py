"""The panels over real nodes: what is typed reaches the node, and what it says reaches the view."""

from __future__ import annotations

import json
import subprocess
import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.action import ActionServer, CancelResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_srvs.srv import Trigger
from test_msgs.action import Fibonacci
from test_msgs.msg import Nested
from test_msgs.srv import Arrays

from course import Session
from course.errors import CourseError, SessionError, WaitTimeout
from course.messages.values import MisfitError
from course.runtime.requests.actions import GoalState
from course.views.shared.live_view import MAX_FRAME_BYTES, LiveView
from course.watch import forms, goals
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
    view._on_message(view.widget, message, [])


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
    assert len(json.dumps(shown(console), allow_nan=False)) < MAX_FRAME_BYTES
    assert len(console.words()) < MAX_FRAME_BYTES
    assert console.calls[0].answer is not None
    assert console.calls[0].answer["string_values"][0].endswith("… 298000 more")


def test_what_does_not_fit_is_said_beside_the_form(session: Session) -> None:
    session.run(Robot)
    view = session.action("count")
    say(view, goal={"order": "many"})
    assert view.make_frame()["problem"] == "order takes int32, not 'many'."
    with pytest.raises(MisfitError, match="order takes int32"):
        view.send(order=0.5)


def test_goals_pass_through_their_states(busy: Session) -> None:
    robot = busy.run(Robot)
    assert isinstance(robot, Robot)
    view = busy.action("count")
    say(view, goal={"order": "2"})
    busy.until(lambda: view.goals and view.goals[0].state == GoalState.EXECUTING)
    # The answer to the goal, and its state and feedback, come by different ways.
    busy.until(lambda: view.goals[0].feedback == 1 and view.goals[0].asked)
    (shown,) = view.make_frame()["goals"]
    assert shown["text"] == ["asked: {order: 2}", "feedback 1: {sequence: [0, 1]}"]
    robot.go.set()
    busy.until(lambda: view.goals[0].result is not None and view.goals[0].is_over)
    (goal,) = view.goals
    assert goal.state == GoalState.SUCCEEDED
    assert goal.result == {"sequence": [0, 1, 1]}
    assert goal.asked == {"order": 2}
    assert "SUCCEEDED" in view.words()
    assert [name for name, _ in view.make_frame()["goals"][0]["states"]][-1] == "SUCCEEDED"


def test_a_goal_of_somebody_else_is_seen_and_can_be_cancelled(busy: Session) -> None:
    busy.run(Robot)
    view = busy.action("count")
    run = busy.send_goal(Fibonacci, "count", Fibonacci.Goal(order=3))
    busy.until(lambda: view.goals and view.goals[0].state == GoalState.EXECUTING)
    say(view, cancel=view.goals[0].number)
    run.wait()
    assert run.status == GoalState.CANCELED
    busy.until(lambda: view.goals[0].is_over)
    assert view.goals[0].state == GoalState.CANCELED


def test_a_goal_sent_from_a_cell_shows_its_progress_and_its_result(busy: Session) -> None:
    robot = busy.run(Robot)
    assert isinstance(robot, Robot)
    view = busy.action("count")
    busy.send_goal(Fibonacci, "count", Fibonacci.Goal(order=3))
    busy.until(lambda: view.goals and view.goals[0].feedback)
    (goal,) = view.make_frame()["goals"]
    assert goal["text"] == ["feedback 1: {sequence: [0, 1]}"]
    assert goal["way"]["text"] == "sequence (number of values): 2"
    assert [value for _, value in goal["way"]["points"]] == [2.0]
    robot.go.set()
    busy.until(lambda: view.goals[0].result is not None)
    (goal,) = view.make_frame()["goals"]
    assert goal["outcome"] == "result: {sequence: [0, 1, 1]}"
    assert "sequence (number of values): 2; result: {sequence: [0, 1, 1]}" in view.words()


def test_a_goal_that_was_over_before_anybody_looked_has_a_result_too(busy: Session) -> None:
    robot = busy.run(Robot)
    assert isinstance(robot, Robot)
    robot.go.set()
    busy.send_goal(Fibonacci, "count", Fibonacci.Goal(order=3)).wait()
    view = busy.action("count")  # the server still lists it
    busy.until(lambda: view.goals and view.goals[0].result is not None)
    assert view.goals[0].state == GoalState.SUCCEEDED


def test_a_result_that_comes_late_is_asked_for_again(
    busy: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(goals, "ANSWER_TIMEOUT_S", 0.2)
    release = threading.Event()

    class Dawdler(Server):
        def _execute(self, goal: Any) -> Fibonacci.Result:
            goal.succeed()
            release.wait()
            return Fibonacci.Result(sequence=[7])

    busy.run(Dawdler)
    view = busy.action("fib")
    view.send(order=1)
    busy.until(lambda: view.goals and view.goals[0].note)
    (goal,) = view.make_frame()["goals"]
    assert (goal["outcome"], goal["bad"]) == ("Its server has not given its result yet.", False)
    release.set()
    busy.until(lambda: view.goals[0].result == {"sequence": [7]})
    assert view.goals[0].note == ""


def test_a_rejected_goal_is_said(busy: Session) -> None:
    busy.run(Robot)
    view = busy.action("count")
    view.send(order=-1)
    busy.until(lambda: view.goals)
    assert view.goals[0].problem == "The server rejected this goal."
    assert view.goals[0].is_over


class Server(Node):
    """Serves an action whose goals end when `go` is set, and which nobody can cancel."""

    def __init__(self) -> None:
        super().__init__("server")
        self.go = threading.Event()
        self._action = ActionServer(
            self, Fibonacci, "fib", self._execute, callback_group=ReentrantCallbackGroup(),
            cancel_callback=lambda _goal: CancelResponse.REJECT,
        )  # fmt: skip

    def _execute(self, goal: Any) -> Fibonacci.Result:
        self.go.wait()
        goal.succeed()
        return Fibonacci.Result(sequence=[goal.request.order])


def test_a_refused_cancel_is_said_until_the_goal_ends(busy: Session) -> None:
    server = busy.run(Server)
    assert isinstance(server, Server)
    view = busy.action("fib")
    view.send(order=3)
    busy.until(lambda: view.goals and view.goals[0].state == GoalState.EXECUTING)
    view.cancel(1)
    (goal,) = view.make_frame()["goals"]
    assert (goal["over"], goal["outcome"]) == (False, "The server refused to cancel.")
    server.go.set()
    busy.until(lambda: view.goals[0].is_over and view.goals[0].result)
    (goal,) = view.make_frame()["goals"]
    assert (goal["over"], goal["outcome"]) == (True, "result: {sequence: [3]}")


def test_several_goals_at_once_are_told_apart(busy: Session) -> None:
    busy.run(Robot)
    view = busy.action("count")
    for order in (1, 2):
        view.send(order=order)
    busy.until(lambda: [g.state for g in view.goals] == [GoalState.EXECUTING] * 2)
    busy.until(lambda: {g.asked["order"] for g in view.goals if g.asked} == {1, 2})
    first = view.goals[0].number
    view.cancel(first)
    busy.until(lambda: view.goals[0].state == GoalState.CANCELED)
    assert [g.state for g in view.goals[1:]] == [GoalState.EXECUTING]


def test_goals_that_were_let_go_of_do_not_come_back(
    busy: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(goals, "KEPT_GOALS", 8)
    server = busy.run(Server)
    assert isinstance(server, Server)
    server.go.set()
    view = busy.action("fib")
    for order in range(30):  # the server lists all of them for minutes, in each status message
        run = busy.send_goal(Fibonacci, "fib", Fibonacci.Goal(order=order))
        run.wait()
    busy.until(lambda: len(view.goals) == 8 and all(goal.is_over for goal in view.goals))
    assert [goal.number for goal in view.goals] == list(range(23, 31))
    server.go.clear()
    busy.send_goal(Fibonacci, "fib", Fibonacci.Goal(order=1))
    busy.until(lambda: view.goals[-1].state == GoalState.EXECUTING)
    server.go.set()
    busy.until(lambda: all(goal.is_over for goal in view.goals))
    assert [goal.number for goal in view.goals] == list(range(24, 32))


def test_parameters_have_controls_from_their_descriptors(session: Session) -> None:
    session.run(Robot)
    panel = session.parameters("robot")
    kinds = {entry.name: entry.kind for entry in panel.entries}
    assert kinds == {"speed": "slider", "name": "text", "lights": "checkbox", "legs": "number"}
    speed = next(entry for entry in panel.entries if entry.name == "speed")
    assert (speed.least, speed.most, speed.step, speed.description) == (0.0, 2.0, 0.5, "m/s")
    assert "speed: 0.5 (0 to 2)  # m/s" in panel.words()


def test_a_slider_moves_in_whole_steps_for_whole_numbers_alone(session: Session) -> None:
    def dial() -> Node:
        node = Node("dial")
        wide = ParameterDescriptor(
            floating_point_range=[FloatingPointRange(from_value=0.0, to_value=2.0)]
        )
        node.declare_parameter("gain", 1.0, wide)
        whole = ParameterDescriptor(integer_range=[IntegerRange(from_value=0, to_value=9)])
        node.declare_parameter("gear", 1, whole)
        return node

    session.run(dial)
    entries = {entry["name"]: entry for entry in shown(session.parameters("dial"))["entries"]}
    assert {name: entry["kind"] for name, entry in entries.items()} == {
        "gain": "slider", "gear": "slider",
    }  # fmt: skip
    assert (entries["gain"]["step"], entries["gear"]["step"]) == (None, 1)


def test_a_node_without_parameters_says_so(session: Session) -> None:
    session.run(lambda: Node("bare"))
    panel = session.parameters("bare")
    assert shown(panel)["entries"] == []
    assert "  none: declare_parameter(…) makes one" in panel.words()


def test_a_parameter_is_changed_and_a_refusal_has_its_reason(session: Session) -> None:
    robot = session.run(Robot)
    panel = session.parameters(robot)
    say(panel, set="speed", value="1.5")
    assert robot.get_parameter("speed").value == 1.5
    say(panel, set="legs", value="100")
    assert "no insect has so many" in panel.make_frame()["problem"]
    assert robot.get_parameter("legs").value == 4
    say(panel, set="legs", value="6")
    assert panel.make_frame()["problem"] == ""
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
        assert panel.make_frame()["problem"] == ""
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


REMOTE = """
import course
from rclpy.node import Node
with course.Session(domain_id={domain}) as session:
    node = session.run(lambda: Node("remote", namespace="far"))
    session.run(lambda: Node("robot")).get_logger().info("of the same name")
    node.get_logger().debug("not on the topic")
    node.get_logger().warning("battery low")
    session.spin()
"""


def test_the_log_panel_has_what_nodes_of_other_programs_log(
    session: Session, start_script: Callable[[str], subprocess.Popen[str]]
) -> None:
    robot = session.run(Robot)
    panel = session.log_panel()
    start_script(REMOTE.format(domain=session.domain_id))
    robot.get_logger().info("here")
    session.until(lambda: "battery low" in panel.words(), 30)
    rows = [row[1:] for row in panel.make_frame()["rows"]]
    assert ["WARN", "/far/remote", "battery low"] in rows
    # What this process runs comes on the topic, too, and is there once.
    assert [row for row in rows if row[2] == "here"] == [["INFO", "/robot", "here"]]
    panel.filter("ERROR")
    assert panel.make_frame()["found"] == 0


def test_the_log_panel_filters_before_it_cuts(session: Session) -> None:
    robot = session.run(Robot)
    panel = session.log_panel()
    robot.get_logger().error("the battery is empty")
    for number in range(1200):
        robot.get_logger().info(f"line {number}")
    session.until(lambda: shown(panel)["rows"] and shown(panel)["rows"][-1][3] == "line 1199")
    say(panel, filter={"level": "ERROR", "search": ""})
    session.until(lambda: [row[3] for row in shown(panel)["rows"]] == ["the battery is empty"])
    assert "the battery is empty" in panel.words()
    say(panel, filter={"level": "INFO", "search": "Line 100"})
    session.until(lambda: len(shown(panel)["rows"]) == 10)  # 200 to 1199 are kept
    assert shown(panel)["rows"][0][3] == "line 1000"
    for message in ({"filter": {"level": []}}, {"filter": {"level": "LOUD"}}, {"filter": 3}):
        say(panel, **message)
    assert panel.widget.ended == ""


def test_long_lines_and_answers_are_cut_with_a_mark_and_fit_a_frame(session: Session) -> None:
    robot = session.run(Robot)
    panel = session.log_panel()
    for _ in range(25):
        robot.get_logger().info("y" * 20_000)
    for _ in range(200):
        robot.get_logger().info("\N{SNOWMAN}" * 600)
    robot.get_logger().info("later")
    session.until(lambda: shown(panel)["rows"] and shown(panel)["rows"][-1][3] == "later")
    assert shown(panel)["rows"][-2][3].endswith("… [100 more characters]")
    assert "more characters]" in panel.words()
    assert len(json.dumps(panel.look())) < MAX_FRAME_BYTES

    def big() -> Node:
        node = Node("big")

        def answer(_request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
            response.message = "\N{SNOWMAN}" * 300_000
            return response

        node.create_service(Trigger, "big", answer)
        node.declare_parameter("map", "m" * 100_000)
        return node

    session.run(big)
    console = session.service("big")
    for _ in range(10):
        say(console, call={})
    session.until(lambda: [c["time"] for c in shown(console)["calls"] if c["time"]][9:])
    assert shown(console)["calls"][0]["answer"]["message"].endswith("more characters]")
    assert len(json.dumps(console.look())) < MAX_FRAME_BYTES
    sheet = session.parameters("big")
    (entry,) = shown(sheet)["entries"]
    assert (len(entry["value"]) < 3000, entry["read_only"]) == (True, True)
    assert "too long to be edited here" in entry["description"]


def test_a_panel_of_a_node_that_has_gone_says_so_in_words(session: Session) -> None:
    session.run(Robot)
    panel = session.parameters("robot")
    assert shown(panel)["problem"] == ""
    session.stop("robot")
    # What was asked just before may still run into its time limit, which is said first.
    session.until(lambda: "Nobody offers" in shown(panel)["problem"], timeout=30.0)
    assert "Nobody offers" in panel.words()


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
    fields = {field.path: field for field in forms.form_fields(Nested)}
    assert fields["basic_types_value.bool_value"].kind == "checkbox"
    message = forms.build_message(Nested, {"basic_types_value.int8_value": "-3"})
    assert message.basic_types_value.int8_value == -3
