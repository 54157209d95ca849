"""Nodes go completely, whatever their own destroy_node() does."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import ClassVar

import pytest
import rclpy
from rclpy.action import ActionServer
from rclpy.action.server import ServerGoalHandle
from rclpy.lifecycle import LifecycleNode
from rclpy.node import Node
from std_srvs.srv import Trigger
from test_msgs.action import Fibonacci

from course import Session
from course.runtime.teardown import destroy_node
from course.runtime.waiting import Pulse, poll_condition


class WithAction(Node):
    """Leaves its action server to whoever destroys it, as rclpy's own examples do."""

    def __init__(self) -> None:
        super().__init__("worker")
        self.server = ActionServer(self, Fibonacci, "work", lambda _: Fibonacci.Result())


class Tidy(WithAction):
    """Destroys its action server itself, as rclpy's documentation asks."""

    def destroy_node(self) -> None:
        self.server.destroy()
        super().destroy_node()


class Raising(WithAction):
    """Has a mistake in its cleanup."""

    def destroy_node(self) -> None:
        raise RuntimeError("my own mistake")


class Forgetful(WithAction):
    """Overrides destroy_node() and forgets the base class."""

    def destroy_node(self) -> None:
        pass


def alone(witness: Node) -> Callable[[], bool]:
    def look() -> bool:
        services = witness.get_service_names_and_types()
        return witness.get_node_names() == ["witness"] and not any("work" in n for n, _ in services)

    return look


@pytest.mark.parametrize("kind", [WithAction, Tidy, Forgetful])
def test_a_stopped_node_is_gone_with_its_action(kind: type[Node]) -> None:
    with Session() as session:
        witness = session.run(Node, "witness")
        session.run(kind)
        session.stop(kind)
        session.until(alone(witness), timeout=20, what="the node and its action to be gone")
        assert session.errors == []
        told = "\n".join(session.notices)
        left = "The destroy_node() of /worker left it on the graph, and the session has taken"
        assert (left in told) == (kind is Forgetful)


def test_a_stopped_managed_node_is_gone_with_its_services_while_somebody_keeps_it() -> None:
    with Session() as session:
        witness = session.run(Node, "witness")

        def services() -> list[str]:
            return [
                name for name, _ in witness.get_service_names_and_types() if "/managed/" in name
            ]

        managed = session.run(LifecycleNode, "managed")
        session.until(lambda: "/managed/change_state" in services())
        session.stop(managed)
        session.until(lambda: not services(), timeout=20, what="its services to be gone")
        session.stop(managed)
        destroy_node(managed)
        assert session.errors == []


def test_a_cleanup_that_raises_is_seen_and_leaves_no_ghost() -> None:
    with Session() as session:
        witness = session.run(Node, "witness")
        session.run(Raising)
        with pytest.raises(RuntimeError, match="my own mistake"):
            session.stop(Raising)
        session.until(alone(witness), timeout=20, what="the node and its action to be gone")


@pytest.mark.parametrize("kind", [WithAction, Tidy, Raising, Forgetful])
def test_a_session_closes_whatever_a_cleanup_does(kind: type[Node]) -> None:
    session = Session()
    session.run(kind)
    report = session.close()
    assert session.closed
    mistakes = ["the cleanup of /worker raised RuntimeError: my own mistake"]
    assert report.leaked == (mistakes if kind is Raising else [])


def test_a_cleanup_that_fails_the_second_time_is_told_and_nothing_else_suffers(
    session: Session,
) -> None:
    class Once(Node):
        gone = False

        def destroy_node(self) -> None:
            if self.gone:
                raise RuntimeError("called twice")
            self.gone = True
            super().destroy_node()

    session.run(Once, "once").destroy_node()
    other = session.run(Node, "other")
    assert list(session.nodes) == [other.get_fully_qualified_name()]
    assert "raised RuntimeError: called twice" in session.notices[-1]


class Endless(Node):
    """Has a callback, or a thread, that goes on until its node tells it to end."""

    def __init__(self) -> None:
        super().__init__("endless")
        self.begun, self.over = threading.Event(), threading.Event()
        self.create_service(Trigger, "begin", self.serve)

    def work(self) -> None:
        self.begun.set()
        poll_condition(self.is_over, 60.0, Pulse())

    def is_over(self) -> bool:
        return self.over.is_set()

    def serve(self, _request: object, response: Trigger.Response) -> Trigger.Response:
        return response

    def destroy_node(self) -> None:
        self.over.set()
        super().destroy_node()


class InAService(Endless):
    def serve(self, _request: object, response: Trigger.Response) -> Trigger.Response:
        self.work()
        return response


class InATimer(Endless):
    def __init__(self) -> None:
        super().__init__()
        self.create_timer(0.01, self.work)


class InAThread(Endless):
    """Starts a thread, and joins it in its cleanup."""

    def __init__(self) -> None:
        super().__init__()
        self.thread = threading.Thread(target=self.work)
        self.thread.start()

    def destroy_node(self) -> None:
        self.over.set()
        self.thread.join()
        super().destroy_node()


class InAGoal(Endless):
    """Leaves its action server to whoever destroys it."""

    def __init__(self) -> None:
        super().__init__()
        self.server = ActionServer(self, Fibonacci, "work", self.execute)

    def execute(self, _goal: ServerGoalHandle) -> Fibonacci.Result:
        self.work()
        return Fibonacci.Result()


class WhileTheGoalIsActive(InAGoal):
    def execute(self, goal: ServerGoalHandle) -> Fibonacci.Result:
        self.begun.set()
        poll_condition(lambda: not goal.is_active, 60.0, Pulse())
        return Fibonacci.Result()


class WhileTheContextIsThere(InAGoal):
    """Looks at `rclpy.ok()`, as loops in plain programs do."""

    def is_over(self) -> bool:
        return not rclpy.ok(context=self.context)


def begin(session: Session, kind: type[Endless]) -> Endless:
    """Run a node, and return it once its work has begun."""
    node = session.run(kind)
    assert isinstance(node, Endless)
    if issubclass(kind, InAGoal):
        session.send_goal(Fibonacci, "work", Fibonacci.Goal(order=3))
    elif kind is InAService:
        node.create_client(Trigger, "begin").call_async(Trigger.Request())
    session.until(node.begun.is_set, timeout=20, what="its work to begin")
    return node


KINDS = [InAService, InATimer, InAThread, InAGoal, WhileTheGoalIsActive]


@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("kind", [*KINDS, WhileTheContextIsThere])
def test_work_that_ends_with_its_node_is_no_leak(
    kind: type[Endless], threads: int, capfd: pytest.CaptureFixture[str]
) -> None:
    before = threading.active_count()
    session = Session(threads=threads)
    begin(session, kind)
    report = session.close()
    assert (report.leaked, session.errors, session.notices) == ([], [], [])
    assert threading.active_count() == before
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize("kind", KINDS)
def test_stopping_a_node_ends_its_work_without_a_word(
    kind: type[Endless], threads: int, capfd: pytest.CaptureFixture[str]
) -> None:
    with Session(threads=threads) as session:
        session.run(Node, "other")
        begin(session, kind)
        session.stop(kind)
        assert (session.notices, session.errors) == ([], [])
        begin(session, kind)  # in a thread that is free again
        session.stop(kind)
        assert session.close().leaked == []
    assert capfd.readouterr() == ("", "")


class Deaf(InATimer):
    """Hears nothing of its node's end."""

    released: ClassVar[threading.Event] = threading.Event()

    def is_over(self) -> bool:
        return self.released.is_set()


@pytest.mark.parametrize("end", [Session.close, Session.stop])
def test_work_that_goes_on_without_its_node_is_told(end: Callable[[Session], object]) -> None:
    Deaf.released.clear()
    session = Session()
    begin(session, Deaf)
    end(session)
    report = session.close(timeout=0.2)
    Deaf.released.set()
    assert "a callback of /endless" in report.leaked[0]
    assert len(session.notices) == (end is Session.stop)
