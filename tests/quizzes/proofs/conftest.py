"""What proofs of keys run on: rclpy alone, with Contexts of its own on a leased domain.

The course's sessions are left out on purpose: what a quiz says about executors must hold for those
of rclpy.
"""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from rclpy.context import Context
from rclpy.executors import Executor, ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node

from course.runtime.domains.leases import lease_domain

TIMEOUT = 60.0
"""Seconds that any wait may take: for a machine under load. What is waited for takes far less."""


class Participant:
    """One Context, which is one DDS participant, with the nodes on it and one of rclpy's executors.

    Its executor is spun by the test's own waits, or by a thread once `spin_in_thread` was called.
    """

    def __init__(self, domain_id: int) -> None:
        self.context = Context()
        self.context.init(args=["--ros-args", "--disable-stdout-logs"], domain_id=domain_id)
        self.executor: Executor = SingleThreadedExecutor(context=self.context)
        self.nodes: list[Node] = []
        self.entities: list[Any] = []  # action servers and clients: nodes do not destroy those
        self._thread: threading.Thread | None = None

    def node(self, name: str, *, spun: bool = True) -> Node:
        node = Node(name, context=self.context, start_parameter_services=False)
        self.nodes.append(node)
        if spun:
            self.executor.add_node(node)
        return node

    def keep(self, entity: Any) -> Any:
        """Destroy an action server or client at the end."""
        self.entities.append(entity)
        return entity

    def spin_in_thread(self, executor: Executor | None = None) -> None:
        """Spin in a thread from now on, with another executor if one is given."""
        if executor is not None:
            for node in self.nodes:
                executor.add_node(node)
            self.executor.shutdown()
            self.executor = executor
        self._thread = threading.Thread(target=self._spin, name="proof spinner")
        self._thread.start()

    def _spin(self) -> None:
        with contextlib.suppress(ExternalShutdownException):
            self.executor.spin()

    def spin_once(self) -> None:
        if self._thread is None:
            self.executor.spin_once(timeout_sec=0.005)

    def close(self) -> None:
        self.executor.shutdown()
        if self._thread is not None:
            self._thread.join(TIMEOUT)
            assert not self._thread.is_alive(), "a callback of this proof did not end"
        for entity in self.entities:
            entity.destroy()
        for node in self.nodes:
            node.destroy_node()
        self.context.try_shutdown()
        self.context.destroy()


class Ros:
    """Participants on one domain that no one else uses."""

    def __init__(self, domain_id: int) -> None:
        self.domain_id = domain_id
        self.participants: list[Participant] = []
        self.main = self.participant()
        self.node = self.main.node

    def participant(self, domain_id: int | None = None) -> Participant:
        participant = Participant(self.domain_id if domain_id is None else domain_id)
        self.participants.append(participant)
        return participant

    def drop(self, participant: Participant) -> None:
        self.participants.remove(participant)
        participant.close()

    def close(self) -> None:
        with contextlib.ExitStack() as stack:  # each of them, whatever another one does
            for participant in self.participants:
                stack.callback(participant.close)

    def until(self, condition: Callable[[], Any], what: str) -> Any:
        """Spin all participants until `condition` is true; it must be in time."""
        deadline = time.monotonic() + TIMEOUT
        while not (value := condition()):
            assert time.monotonic() < deadline, f"waited in vain for {what}"
            for participant in self.participants:
                participant.spin_once()
        return value

    def matched(self, publisher: Any, count: int = 1) -> None:
        self.until(lambda: publisher.get_subscription_count() == count, f"{count} matches")


@pytest.fixture
def ros(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[Ros]:
    monkeypatch.setenv("ROS_LOG_DIR", str(tmp_path / "log"))
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    monkeypatch.setenv("ROS_STATIC_PEERS", "127.0.0.1")
    lease = lease_domain()
    with contextlib.ExitStack() as stack:
        stack.callback(lease.release)
        opened = Ros(lease.domain_id)
        stack.callback(opened.close)
        yield opened
