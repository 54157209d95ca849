"""Nodes go completely, whatever their own destroy_node() does."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from rclpy.action import ActionServer
from rclpy.lifecycle import LifecycleNode
from rclpy.node import Node
from test_msgs.action import Fibonacci

from course import Session
from course.runtime.teardown import destroy_node


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
