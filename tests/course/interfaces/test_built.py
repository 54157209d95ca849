"""The built types at work: on the wire between real nodes, and field by field."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from rclpy.action import ActionServer
from rclpy.node import Node
from rclpy.serialization import deserialize_message, serialize_message

from course import interfaces
from course.learner_session.session import Session

pytestmark = pytest.mark.usefixtures("here")

EVERYTHING = """
bool truth true
byte raw 255
char letter 97
float32 narrow 1.5
float64 wide -2.25e3
int8 i8 -128
uint8 u8 0xff
int16 i16 -32768
uint16 u16 65535
int32 i32 -2147483648
uint32 u32 4294967295
int64 i64 -9223372036854775808
uint64 u64 18446744073709551615
string text "quoted 'text'"
string greek 'π'
wstring wide_text "Zoë's"
string<=5 short_text
int32[] numbers [1, 2, 3]
float64[3] triple
string[<=2] names ['a', 'b']
bool[2] flags [true, false]
geometry_msgs/Pose[] path
builtin_interfaces/Time stamp
uint8 STOPPED=0
float64 RATE=10.5
string GREETING='hello there'
"""


class Server(Node):
    """Serves AddTwoInts and Fibonacci as the chapter does."""

    def __init__(self) -> None:
        from example_interfaces.action import Fibonacci
        from example_interfaces.srv import AddTwoInts

        super().__init__("server")
        self.create_service(AddTwoInts, "add", self.add)
        self.fibonacci = ActionServer(self, Fibonacci, "fibonacci", self.count)

    def add(self, request: Any, response: Any) -> Any:
        response.sum = request.a + request.b
        return response

    def count(self, goal: Any) -> Any:
        from example_interfaces.action import Fibonacci

        sequence = [0, 1]
        for _ in range(1, goal.request.order):
            sequence.append(sequence[-1] + sequence[-2])
            goal.publish_feedback(Fibonacci.Feedback(sequence=sequence))
        goal.succeed()
        return Fibonacci.Result(sequence=sequence)


def test_service_and_action_work_under_their_ros_names() -> None:
    from example_interfaces.action import Fibonacci
    from example_interfaces.srv import AddTwoInts

    with Session() as session:
        node = session.run(Server)
        assert session.call(AddTwoInts, "/add", AddTwoInts.Request(a=2, b=40)).sum == 42
        run = session.send_goal(Fibonacci, "/fibonacci", Fibonacci.Goal(order=4))
        run.wait(10.0)
        assert list(run.result.sequence) == [0, 1, 1, 2, 3]
        assert [list(f.sequence) for f in run.feedback] == [
            [0, 1, 1],
            [0, 1, 1, 2],
            [0, 1, 1, 2, 3],
        ]
        services = dict(node.get_service_names_and_types())
        assert services["/add"] == ["example_interfaces/srv/AddTwoInts"]
        assert services["/fibonacci/_action/send_goal"] == [
            "example_interfaces/action/Fibonacci_SendGoal"
        ]


def test_a_learners_message_carries_its_type_hash_to_other_nodes(built: Path) -> None:
    reading = interfaces.define("wire_msgs/msg/Reading", "float64 celsius 21.5\nstring sensor\n")
    (described,) = built.glob("*/wire_msgs/*/include/wire_msgs/msg/Reading.json")
    expected = json.loads(described.read_text(encoding="utf-8"))["type_hashes"][0]["hash_string"]

    class Talker(Node):
        def __init__(self) -> None:
            super().__init__("talker")
            self.publisher = self.create_publisher(reading, "reading", 10)
            self.create_timer(0.05, lambda: self.publisher.publish(reading(sensor="roof")))

    with Session() as session:
        node = session.run(Talker)
        message = session.next_message(reading, "/reading")
        assert (message.celsius, message.sensor) == (21.5, "roof")
        (info,) = node.get_publishers_info_by_topic("/reading")
        assert info.topic_type == "wire_msgs/msg/Reading"
        assert f"RIHS01_{bytes(info.topic_type_hash.value).hex()}" == expected


def test_every_kind_of_field_survives_serialisation() -> None:
    from geometry_msgs.msg import Pose

    everything = interfaces.define("field_msgs/msg/Everything", EVERYTHING)
    from field_msgs.msg import Everything

    assert Everything is everything
    message = everything()
    assert (message.truth, message.raw, message.letter, message.narrow) == (True, b"\xff", 97, 1.5)
    assert (message.i64, message.u64) == (-(2**63), 2**64 - 1)
    assert (message.text, list(message.numbers), message.names) == (
        "quoted 'text'",
        [1, 2, 3],
        ["a", "b"],
    )
    assert (everything.STOPPED, everything.RATE, everything.GREETING) == (0, 10.5, "hello there")
    assert (message.greek, message.wide_text) == ("π", "Zoë's")
    message.wide_text, message.short_text, message.triple = "ěščř", "short", [1.0, 2.0, 3.0]
    message.path = [Pose(), Pose()]
    message.path[1].position.x = 4.0
    assert deserialize_message(serialize_message(message), everything) == message
    with pytest.raises(AssertionError):
        message.i8 = 128


CHAIN = [
    ("chain_msgs/msg/Point2", "float64 x 1.0\nfloat64 y"),
    ("chain_msgs/msg/Leg", "Point2 begin\nPoint2[2] ends"),
    ("chain_msgs/srv/Plan", "Leg first\n---\nchain_msgs/Leg[] legs"),
    ("chain_msgs/action/Walk", "Leg[] legs\n---\n---\nPoint2 at"),
]


def test_types_of_one_package_build_on_each_other(python: Any, built: Path) -> None:
    for name, text in CHAIN:
        interfaces.define(name, text)
    from chain_msgs.action import Walk
    from chain_msgs.msg import Leg, Point2
    from chain_msgs.srv import Plan, Plan_Request

    assert Plan.Request is Plan_Request
    response = Plan.Response(legs=[Leg(begin=Point2(y=2.0))])
    again = deserialize_message(serialize_message(response), Plan.Response)
    assert (again.legs[0].begin.x, again.legs[0].begin.y) == (1.0, 2.0)
    walk = Walk.Goal(legs=[Leg()])
    assert deserialize_message(serialize_message(walk), Walk.Goal) == walk
    # A later process, without a compiler, finds all of it.
    code = (
        f"for name, text in {CHAIN!r}: interfaces.define(name, text)\n"
        "from chain_msgs.srv import Plan\n"
        "print(Plan.Request().first.begin.x)"
    )
    done = python(code, COURSE_INTERFACES_CACHE=str(built), PATH="/nonexistent")
    assert (done.stdout, done.stderr) == ("1.0\n", "")


def test_awkward_names_that_ros_allows_build() -> None:
    # The words of IDL are no words of C, C++ or Python: a text may use them.
    words = ["sequence", "module", "interface", "fixed", "any", "object", "string", "boolean"]
    text = "".join(f"int32 {word}\n" for word in words)
    made = interfaces.define("odd_msgs/msg/HTTPWords2D", text)
    assert list(made.get_fields_and_field_types()) == words
    empty = interfaces.define("odd_msgs/srv/Nothing", "---\n")
    assert deserialize_message(serialize_message(empty.Request()), empty.Request) == empty.Request()
