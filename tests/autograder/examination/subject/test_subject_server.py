"""What an examiner may ask of a subject, and what a student's class can do to it."""

from __future__ import annotations

import asyncio
import inspect
import re
import socket
import sys
import threading
from collections import deque
from collections.abc import Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar

import pytest
import rclpy
from lifecycle_msgs.srv import GetState
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.lifecycle import LifecycleNode
from rclpy.node import Node
from rclpy.task import Future
from std_msgs.msg import String
from std_srvs.srv import Trigger

from autograder.examination import check_context
from autograder.examination.check_context import StudentError, Subject, SubjectGone
from autograder.examination.subject import server
from autograder.examination.subject.server import SubjectServer
from autograder.examination.subject.student_errors import MUST_NOT_SPIN
from autograder.examination.verdict import Progress, Verdict
from autograder.processes.channel import Channel, ChannelClosed, ChannelTimeout
from course import Session
from course.runtime.context.context import default_context_beside


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


class NoCleanup(Node):
    """Its destroy_node() does not call the inherited one."""

    def __init__(self) -> None:
        super().__init__("careless")
        self.create_publisher(String, "talk", 1)

    def destroy_node(self) -> None:
        pass


class EndsItsLoop(Node):
    """Its destroy_node() runs an event loop of its own to the end, as a program's may."""

    def __init__(self) -> None:
        super().__init__("looping")
        self.loop = asyncio.new_event_loop()

    def destroy_node(self) -> None:
        self.loop.run_until_complete(asyncio.sleep(0))
        self.loop.close()
        super().destroy_node()


class Exits(Node):
    def __init__(self) -> None:
        raise SystemExit(1)


class Managed(LifecycleNode):
    def __init__(self) -> None:
        super().__init__("managed")


class Deaf(Node):
    """Its callback is one that rclpy cannot look into: the error comes from deep in Python."""

    def __init__(self) -> None:
        super().__init__("deaf")
        self.create_subscription(String, "talk", deque[String]().append, 1)


class Speechless(Node):
    def __init__(self) -> None:
        super().__init__("speechless")
        raise AssertionError


class Spinner(Node):
    """Its callback spins. What is passed as an executor is none: so nothing is left behind."""

    def __init__(self) -> None:
        super().__init__("spinner")
        self.create_timer(0.05, self.wait)

    def wait(self) -> None:
        rclpy.spin_until_future_complete(self, Future(), executor=object())  # type: ignore[arg-type]


class Raiser(Node):
    def __init__(self) -> None:
        super().__init__("raiser")
        self.create_timer(0.05, self.drive)

    def drive(self) -> None:
        raise KeyError("speed")


class Robot:
    def node_factories(self) -> dict[str, Any]:
        return {"ada": partial(Named, "ada"), "bob": partial(Named, "bob")}


class Careless(Node):
    """Raises in a callback and in a thread; and once more it is rclpy that raises."""

    def __init__(self) -> None:
        super().__init__("careless")
        self.create_timer(0.01, self.fail)
        self.create_timer(0.01, self.misuse)
        threading.Thread(target=self.fail).start()

    def fail(self) -> None:
        raise ValueError("mine")

    def misuse(self) -> None:
        self.declare_parameter("")


class Waiting(Node):
    """Waits in a callback, by the wall clock, for a service that nobody offers."""

    def __init__(self) -> None:
        super().__init__("waiting")
        group = ReentrantCallbackGroup()
        self.asked = self.create_client(Trigger, "nobody", callback_group=group)
        self.create_timer(0.01, self.wait, callback_group=group)

    def wait(self) -> None:
        self.asked.wait_for_service(timeout_sec=60.0)


class OfAScript(Node):
    """Written for a process of its own, which rclpy.init() and rclpy.shutdown() frame."""

    def __init__(self) -> None:
        super().__init__("of_a_script")
        self.beats = self.create_publisher(String, "beats", 1)
        self.create_subscription(String, "helper", self.help, 1)
        self.over = threading.Event()
        self.thread = threading.Thread(target=self.beat)
        self.thread.start()

    def beat(self) -> None:
        while rclpy.ok() and not self.over.wait(0.02):
            self.beats.publish(String())

    def help(self, _: String) -> None:
        self.helper = rclpy.create_node("helper")

    def destroy_node(self) -> None:
        self.over.set()
        self.thread.join()
        rclpy.shutdown()
        super().destroy_node()


CLASSES = {
    cls.__name__: cls
    for cls in (
        Named, OneCleanupOnly, NoCleanup, Exits, Managed, Deaf, Speechless, Spinner, Raiser,
        Careless, Waiting, OfAScript,
    )
}  # fmt: skip


@pytest.fixture
def outside() -> Iterator[Session]:
    with Session() as session:
        yield session


def test_progress_is_shown_in_the_thread_that_serves() -> None:
    ours, theirs = socket.socketpair()
    shown: list[tuple[Any, str]] = []

    def show(progress: Any) -> None:
        shown.append((progress, threading.current_thread().name))

    def open_session(threads: int, sim_time: bool) -> Session:
        raise AssertionError("nothing of the student's is asked for")

    serving = SubjectServer(open_session, {}, show)
    served = threading.Thread(target=serving.serve, args=(Channel(theirs),), name="main")
    served.start()
    subject = Subject(Channel(ours))
    progress = Progress(Verdict("qos", "visible", ()), "It starts.", 1, 3)
    subject.show(progress)
    assert [(Progress.from_data(told), thread) for told, thread in shown] == [(progress, "main")]
    subject.release()
    served.join(20)
    assert not served.is_alive()
    ours.close()
    theirs.close()


@pytest.fixture
def subject(outside: Session) -> Iterator[Subject]:
    def open_session(threads: int, sim_time: bool) -> Session:
        return Session(domain_id=outside.domain_id, threads=threads, sim_time=sim_time)

    ours, theirs = socket.socketpair()
    channel, other = Channel(ours), Channel(theirs)
    served = threading.Thread(
        target=SubjectServer(open_session, {**CLASSES, "robot": Robot()}).serve, args=(other,)
    )
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


def test_nobody_tidies_up_after_a_constructor_that_raised(
    subject: Subject, outside: Session
) -> None:
    observer = outside.run(Node, "observer")
    for left in (1, 2):
        with pytest.raises(StudentError, match="RuntimeError: no voice"):
            subject.start("Named", "mute", False)
        subject.collect()
        outside.until(lambda n=left: observer.count_publishers("talk") == n)  # type: ignore[misc]
    subject.start("Named", "talker")  # what came before it is known when it is
    outside.until(lambda: observer.count_publishers("talk") == 3)
    subject.open()
    outside.until(lambda: not observer.count_publishers("talk"))


def test_a_session_tidies_up_after_a_cleanup_unless_it_is_asked_not_to(
    subject: Subject, outside: Session
) -> None:
    observer = outside.run(Node, "observer")
    subject.start("NoCleanup")
    outside.until(lambda: observer.count_publishers("talk") == 1)
    subject.stop("NoCleanup", bare=True)
    subject.start("Named")
    outside.until(lambda: observer.count_publishers("talk") == 2)
    subject.stop("NoCleanup")
    outside.until(lambda: observer.count_publishers("talk") == 1)


def test_without_a_session_a_cleanup_is_called_once(subject: Subject) -> None:
    subject.start("OneCleanupOnly")
    subject.stop("OneCleanupOnly", bare=True)
    subject.stop("OneCleanupOnly")
    assert subject.start("OneCleanupOnly") == "/fragile"


def test_a_constructor_that_exits_has_raised(subject: Subject) -> None:
    with pytest.raises(StudentError, match="SystemExit: 1"):
        subject.start("Exits")
    assert subject.start("Named") == "/nobody"


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


def test_every_declared_node_is_brought_up_and_known_by_its_label(subject: Subject) -> None:
    assert subject.start_all("robot") == {"ada": "/ada", "bob": "/bob"}
    assert subject.sees("robot.bob", {"publishers": ["talk"]})["publishers"]["talk"]


def test_a_node_that_does_not_come_up_is_named() -> None:
    class Silent:
        """Answers what is declared, and then no more."""

        answers: ClassVar[list[dict[str, Any]]] = [
            {"ok": True, "labels": ["ada", "bob"]},
            {"ok": True, "node": "/ada"},
        ]

        def send(self, request: dict[str, Any]) -> None:
            pass

        def receive_fairly(self, timeout: float, delay: object) -> dict[str, Any]:
            if not self.answers:
                raise ChannelTimeout
            return self.answers.pop(0)

    subject = Subject(Silent())  # type: ignore[arg-type]
    with pytest.raises(SubjectGone, match="bring up the nodes of `robot`, and bob did not come up"):
        subject.start_all("robot")


def test_replies_that_each_come_in_time_may_not_take_for_ever(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(check_context, "ALL_REPLIES_TIMEOUT_S", 0.2)
    ours, theirs = (Channel(end) for end in socket.socketpair())
    answered = threading.Event()

    def answer_slowly() -> None:
        with suppress(ChannelClosed):
            while True:
                theirs.receive()
                answered.wait(0.05)
                theirs.send({"ok": True})

    thread = threading.Thread(target=answer_slowly)
    thread.start()
    subject = Subject(ours)
    try:
        collect_often = partial(deque, (subject.collect() for _ in range(100)), maxlen=0)
        with pytest.raises(SubjectGone, match=r"took 0 s in all .* to collect garbage: which"):
            collect_often()
        assert subject.hangs
    finally:
        ours.close()
        theirs.close()
        thread.join()


@pytest.mark.parametrize("sim_time", [False, True])
def test_rclpy_is_ok_for_a_node_and_its_threads_whatever_the_notebook_has_opened(
    subject: Subject, outside: Session, sim_time: bool
) -> None:
    subject.open(sim_time=sim_time)
    subject.start("OfAScript")
    beats = outside.record("beats", String)
    beats.wait(5)
    talker = outside.run(Node, "talker")
    asking = talker.create_publisher(String, "helper", 1)
    outside.until(asking.get_subscription_count)
    asking.publish(String())
    outside.until(lambda: "helper" in talker.get_node_names())
    subject.stop("OfAScript")
    subject.start("Named")  # in the same session, which rclpy.shutdown() did not end
    outside.until(lambda: "nobody" in talker.get_node_names())
    subject.open()
    subject.start("OfAScript")  # in another one, where rclpy is ok again
    beats.wait(len(beats.messages) + 5)
    subject.stop("OfAScript")


def test_the_notebooks_default_context_is_back_after_an_exam(outside: Session) -> None:
    before = rclpy.utilities.g_default_context
    with default_context_beside(outside.domain_id, sim_time=False):
        assert rclpy.ok()
        assert rclpy.utilities.g_default_context is not before
    assert rclpy.utilities.g_default_context is before


def test_who_spins_in_a_callback_is_told_so_and_nobody_else(
    subject: Subject, outside: Session
) -> None:
    subject.start("Spinner")
    outside.until(subject.errors, what="an error")
    assert "AttributeError" in subject.errors()[0]
    assert subject.errors()[0].endswith(MUST_NOT_SPIN)
    subject.open()
    subject.start("Raiser")
    outside.until(subject.errors, what="an error")
    assert subject.errors()[0].endswith("KeyError: 'speed'")


def test_a_trace_has_the_students_lines_only(subject: Subject) -> None:
    with pytest.raises(StudentError, match="no signature found") as raised:
        subject.start("Deaf")
    places = re.findall(r"^  line \d+ of (.*), in ", raised.value.trace, flags=re.MULTILINE)
    assert places == [Path(__file__).name]
    assert inspect.__file__ not in raised.value.trace


def test_what_is_missing_is_not_said_to_have_raised(
    subject: Subject, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delattr(sys, "last_value", raising=False)
    with pytest.raises(StudentError) as raised:
        subject.start("Nobody")
    sentence = "No Nobody was defined: did its cell end with an error?"
    assert raised.value.feedback_text == sentence
    monkeypatch.setattr(sys, "last_value", ValueError("no depth."), raising=False)
    with pytest.raises(StudentError) as raised:
        subject.value("Nobody")
    assert (
        raised.value.feedback_text
        == f"{sentence} The last error of a cell was ValueError: no depth."
    )


def test_the_first_error_of_the_notebook_is_told_and_not_what_came_of_it(
    subject: Subject, monkeypatch: pytest.MonkeyPatch
) -> None:
    missing = NameError("name 'Nobody' is not defined", name="Nobody")
    monkeypatch.setattr(sys, "last_value", missing, raising=False)
    with pytest.raises(StudentError) as raised:
        subject.start("Nobody")
    assert raised.value.feedback_text == "No Nobody was defined: did its cell end with an error?"
    monkeypatch.setattr(
        server, "get_ipython", lambda: SimpleNamespace(first_error=ValueError("no depth"))
    )
    with pytest.raises(StudentError) as raised:
        subject.start("Nobody")
    assert raised.value.feedback_text.endswith(
        " The first error of a cell was ValueError: no depth."
    )
    unread = SyntaxError("invalid syntax", ("<ipython-input-2>", 3, 1, "a b"))
    monkeypatch.setattr(server, "get_ipython", lambda: SimpleNamespace(first_error=unread))
    with pytest.raises(StudentError) as raised:
        subject.start("Nobody")
    assert raised.value.feedback_text.endswith(" SyntaxError: invalid syntax, in line 3.")


def test_an_error_without_a_message_is_told_by_its_name(subject: Subject) -> None:
    with pytest.raises(StudentError) as raised:
        subject.start("Speechless")
    assert raised.value.feedback_text.startswith("It raised AssertionError. It happened here:\n")


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_errors_of_the_students_own_lines_are_told_from_those_of_rclpy(
    subject: Subject, outside: Session
) -> None:
    subject.start("Careless")
    outside.until(lambda: len(subject.errors()) == 2)
    (told,) = subject.own_errors()
    assert re.fullmatch(
        r"Careless\.fail raised ValueError: mine "
        r"\(at line \d+ of test_subject_server\.py: raise ValueError\(.mine.\)\)",
        told,
    )
    (ended,) = subject.thread_errors()
    place = r"\(at line \d+ of test_subject_server\.py: raise .*\)"
    assert re.fullmatch(rf"ValueError: mine {place}", ended)
    subject.open()
    assert not subject.own_errors()
    assert not subject.thread_errors()


def test_a_callback_that_waits_by_the_wall_clock_is_seen_while_it_does(
    subject: Subject, outside: Session
) -> None:
    subject.open(threads=2)
    subject.start("Waiting")
    told, *_ = outside.until(subject.wall_waits)  # each thread may run one
    assert re.fullmatch(
        r"wait_for_service: Waiting\.wait of /waiting \(at line \d+: self\.asked.*\)", told
    )


def test_the_event_loop_of_a_kernel_is_in_no_node_s_way(outside: Session) -> None:
    def open_session(threads: int, sim_time: bool) -> Session:
        return Session(domain_id=outside.domain_id, threads=threads, sim_time=sim_time)

    ours, theirs = socket.socketpair()
    kernel_s_own: list[bool] = []

    async def cell() -> None:
        loop = asyncio.get_running_loop()
        SubjectServer(open_session, {"EndsItsLoop": EndsItsLoop}).serve(Channel(theirs))
        kernel_s_own.append(asyncio.get_running_loop() is loop)

    kernel = threading.Thread(target=lambda: asyncio.run(cell()))
    kernel.start()
    subject = Subject(Channel(ours))
    subject.start("EndsItsLoop")
    subject.stop("EndsItsLoop", bare=True)
    subject.release()
    kernel.join(20)
    ours.close()
    theirs.close()
    assert kernel_s_own == [True]
