"""What an examiner may ask of a subject, and what a student's class can do to it."""

# mypy: allow-untyped-calls

from __future__ import annotations

import inspect
import re
import socket
import threading
from collections import deque
from collections.abc import Iterator

import pytest
from lifecycle_msgs.srv import GetState
from rclpy.lifecycle import LifecycleNode
from rclpy.node import Node
from std_msgs.msg import String

from autograder.bench import StudentError, Subject
from autograder.harness import Harness
from autograder.wire import Channel
from course import Session


class Named(Node):
    def __init__(self, name: str = "nobody", sound: bool = True) -> None:
        super().__init__(name)
        self.create_publisher(String, "talk", 1)
        if not sound:
            raise RuntimeError("no voice")


class OneCleanupOnly(Node):
    def __init__(self) -> None:
        super().__init__("fragile")
        self.things = ["thing"]

    def destroy_node(self) -> None:
        self.things.pop()
        super().destroy_node()


class Managed(LifecycleNode):
    def __init__(self) -> None:
        super().__init__("managed")


class Deaf(Node):
    """Its callback is one that rclpy cannot look into: the error comes from deep in Python."""

    def __init__(self) -> None:
        super().__init__("deaf")
        self.create_subscription(String, "talk", deque[String]().append, 1)


CLASSES = {cls.__name__: cls for cls in (Named, OneCleanupOnly, Managed, Deaf)}


@pytest.fixture
def outside() -> Iterator[Session]:
    with Session() as session:
        yield session


@pytest.fixture
def subject(outside: Session) -> Iterator[Subject]:
    def open_session(threads: int, sim_time: bool) -> Session:
        return Session(domain_id=outside.domain_id, threads=threads, sim_time=sim_time)

    ours, theirs = socket.socketpair()
    channel, other = Channel(ours), Channel(theirs)
    served = threading.Thread(target=Harness(open_session, CLASSES).serve, args=(other,))
    served.start()
    subject = Subject(channel)
    yield subject
    subject.release()
    served.join(20)
    channel.close()
    other.close()
    assert not served.is_alive()


def test_a_constructor_is_given_arguments(subject: Subject) -> None:
    assert subject.start("Named", "ada") == "/ada"
    assert subject.start("Named") == "/nobody"


def test_a_session_tidies_up_after_a_constructor_unless_it_is_asked_not_to(
    subject: Subject, outside: Session
) -> None:
    observer = outside.run(Node, "observer")
    for bare, left in ((False, 1), (True, 2)):
        with pytest.raises(StudentError, match="RuntimeError: no voice"):
            subject.start("Named", "mute", False, bare=bare)
        subject.start("Named", f"talker_{bare}")  # what came before it is known when it is
        outside.until(lambda n=left: observer.count_publishers("talk") == n)  # type: ignore[misc]
        subject.stop("Named")
        outside.until(lambda n=left: observer.count_publishers("talk") == n - 1)  # type: ignore[misc]
    subject.open()
    outside.until(lambda: not observer.count_publishers("talk"))


def test_a_cleanup_that_raises_keeps_nobody_from_a_new_session(subject: Subject) -> None:
    subject.start("OneCleanupOnly")
    subject.call("OneCleanupOnly", "destroy_node")
    with pytest.raises(StudentError, match="IndexError"):
        subject.call("OneCleanupOnly", "destroy_node")
    subject.open()
    assert subject.start("Named", "next") == "/next"


def test_a_destroyed_lifecycle_node_is_gone_once_it_is_collected(
    subject: Subject, outside: Session
) -> None:
    observer = outside.run(Node, "observer")
    node = subject.start("Managed")
    outside.call(GetState, f"{node}/get_state", GetState.Request())
    subject.stop("Managed")
    subject.collect()
    outside.until(lambda: not observer.count_services(f"{node}/get_state"))


def test_a_trace_has_the_students_lines_only(subject: Subject) -> None:
    with pytest.raises(StudentError, match="no signature found") as raised:
        subject.start("Deaf")
    assert re.findall(r'File "(.*)", line', raised.value.trace) == [__file__]
    assert inspect.__file__ not in raised.value.trace
