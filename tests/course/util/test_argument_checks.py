"""Wrong arguments: one clear sentence each, and the session goes on."""

from __future__ import annotations

import pytest
from rclpy.node import Node
from std_msgs.msg import String
from std_srvs.srv import Trigger
from test_msgs.action import Fibonacci

import course
from course.errors import CourseError, SessionError

NAN = float("nan")

WRONG = {
    "run a name": (lambda s: s.run("Talker"), r"needs a Node class.*run\(Talker\).*'Talker'"),
    "run nothing": (lambda s: s.run(None), "it was None"),
    "run a node with arguments": (
        lambda s: s.run(Node("made", context=s.context), "left"),
        r"made already.*run\(Node, \.\.\.\)",
    ),
    "run in no thread": (lambda s: s.run(Node, "a", threads=0), "threads is a whole number"),
    "run in half a thread": (lambda s: s.run(Node, "a", threads=0.5), "not 0.5"),
    "stop a number": (lambda s: s.stop(5), "its name or its class, not by 5"),
    "pause nothing": (lambda s: s.pause(None), "not by None"),
    "a type's name": (lambda s: s.next_message("String", "/chatter"), "String from std_msgs.msg"),
    "a service for a message": (lambda s: s.next_message(Trigger, "/a"), "which is a service type"),
    "a message for a type": (
        lambda s: s.next_message(String(), "/a"),
        "a String that has been made: pass the class itself",
    ),
    "a topic that is none": (lambda s: s.next_message(String, 5), "The topic is a string"),
    "no topic": (lambda s: s.next_message(String, ""), "'' is not a topic name"),
    "a topic with a space": (lambda s: s.next_message(String, "a b"), "'a b' is not a topic name"),
    "a QoS by name": (lambda s: s.next_message(String, "/a", qos="sensor"), "not 'sensor'"),
    "a QoS of depth 0": (lambda s: s.next_message(String, "/a", qos=0), "at least 1, not 0"),
    "record a type's name": (lambda s: s.record("/a", "String"), "a message class"),
    "record the wrong way round": (lambda s: s.record(String, "/a"), "a message class"),
    "record nothing": (lambda s: s.record("/a", String, limit=0), "limit is a whole number"),
    "call a type's name": (lambda s: s.call("Trigger", "/a", None), "a service class"),
    "call with True": (
        lambda s: s.call(Trigger, "/a", True),
        r"Trigger\.Request\(\.\.\.\); .*True",
    ),
    "call with the class": (
        lambda s: s.call(Trigger, "/a", Trigger.Request),
        "it was the class Trigger_Request",
    ),
    "call nobody": (lambda s: s.call(Trigger, None, Trigger.Request()), "The service is a string"),
    "call a bad name": (lambda s: s.call(Trigger, "a b", Trigger.Request()), "not a service name"),
    "send a message": (lambda s: s.send_goal(String, "/a", String()), "an action class"),
    "send a number": (lambda s: s.send_goal(Fibonacci, "/a", 5), r"Fibonacci\.Goal\(\.\.\.\)"),
    "send to nobody": (lambda s: s.send_goal(Fibonacci, 5, Fibonacci.Goal()), "action is a string"),
    "send to a bad name": (lambda s: s.send_goal(Fibonacci, "a b", Fibonacci.Goal()), "not a"),
    "feedback to nobody": (
        lambda s: s.send_goal(Fibonacci, "/a", Fibonacci.Goal(), on_feedback=5),
        "on_feedback is a function",
    ),
    "until a number": (lambda s: s.until(5), r"The condition is a function, .* not 5"),
    "until a truth": (lambda s: s.until(True), "not True"),
    "logs of a number": (lambda s: s.logs(5), "not by 5"),
    "logs of level 20": (lambda s: s.logs(level=20), "no log level 20: choose DEBUG"),
    "the last -1 rows": (lambda s: s.logs(last=-1), "last is a whole number"),
    "the last rows": (lambda s: s.logs(last="5"), "not '5'"),
    "close never": (lambda s: s.close(timeout="soon"), "not 'soon'"),
    "call a number at the end": (lambda s: s.on_close(5), "The callback is a function"),
}


@pytest.mark.parametrize("mistake", WRONG)
def test_a_wrong_argument_is_one_sentence(session: course.Session, mistake: str) -> None:
    use, sentence = WRONG[mistake]
    with pytest.raises(SessionError, match=sentence) as caught:
        use(session)
    assert "\n" not in str(caught.value)
    assert caught.value.__suppress_context__ or caught.value.__context__ is None
    session.run(Node, "afterwards")


@pytest.mark.parametrize("timeout", [-1, -0.5, NAN, "5", None, True, [5]])
@pytest.mark.parametrize(
    "wait",
    [
        lambda s, t: s.until(lambda: True, timeout=t),
        lambda s, t: s.next_message(String, "/a", timeout=t),
        lambda s, t: s.wait_for_service(Trigger, "/a", timeout=t),
        lambda s, t: s.call(Trigger, "/a", Trigger.Request(), timeout=t),
        lambda s, t: s.send_goal(Fibonacci, "/a", Fibonacci.Goal(), timeout=t),
        lambda s, t: s.record("/a", String).wait(1, timeout=t),
    ],
    ids=["until", "next_message", "wait_for_service", "call", "send_goal", "record"],
)
def test_a_wrong_timeout_is_one_sentence(session: course.Session, wait, timeout) -> None:
    with pytest.raises(SessionError, match="timeout is a number of seconds"):
        wait(session, timeout)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"threads": "4"}, "threads is a whole number, at least 1, not '4': try threads=4"),
        ({"threads": 0}, "at least 1, not 0"),
        ({"threads": 2.0}, "not 2.0"),
        ({"threads": True}, "not True"),
        ({"domain_id": "5"}, "whole number"),
        ({"discovery": 5}, "LOCALHOST"),
        ({"peers": "robot"}, "peers is a list of addresses"),
        ({"peers": [5]}, "peers is a list of addresses"),
    ],
)
def test_a_wrong_option_is_one_sentence(options, sentence) -> None:
    with pytest.raises(CourseError, match=sentence):
        course.Session(**options)


def test_an_endless_timeout_is_allowed(session: course.Session) -> None:
    assert session.until(lambda: True, timeout=float("inf"))
