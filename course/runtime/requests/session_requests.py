"""What a session can wait for and ask: conditions, messages, services, actions, recordings."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Protocol, TypeVar

from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile

from course.errors import WaitTimeout
from course.runtime.callbacks.callback_runs import current_job
from course.runtime.executor.blocked import BlockedCallback
from course.runtime.nodes.node_host import NodeHost
from course.runtime.requests.actions import GoalRun, Goals
from course.runtime.requests.graph_queries import who_offers
from course.runtime.requests.hidden_node import Probe
from course.runtime.requests.recorder import Recorder
from course.runtime.waiting import Deadline, poll_condition
from course.util import argument_checks

T = TypeVar("T")


_MOST_HINTS = 3


class Hints(Protocol):
    """What knows why a wait may have been in vain."""

    def __call__(self, *, vague: bool, sought: str) -> list[str]:
        """Return what may be the reason, the likeliest first; ``vague`` if
        the error does not know what was waited for, ``sought`` is what it names."""


class Requests:
    """The part of a session that waits and asks; `CoreSession` says what it gets and raises."""

    def __init__(self, host: NodeHost, hints: Hints, now_ns: Callable[[], int | None]) -> None:
        """Ask beside the nodes of ``host``.

        Args:
            host: the part of the session that hosts nodes.
            hints: asked when a wait was in vain.
            now_ns: returns simulated time (ns), or None where time is not simulated.
        """
        self._host = host
        self._hints = hints
        self._now_ns = now_ns
        self._lock = threading.Lock()
        self._probe: Probe | None = None
        self._goals_made: Goals | None = None

    def until(
        self, condition: Callable[[], T], timeout: float = 5.0, what: str = "the condition"
    ) -> T:
        """Return the first true value of `condition`."""
        argument_checks.check_function(condition, "The condition", "lambda: len(heard) > 3")
        timeout = argument_checks.check_seconds(timeout)
        with self._explain_timeouts(vague=True):
            value = poll_condition(condition, timeout, self._host.pulse)
            if value is None:
                raise WaitTimeout(f"Waited {timeout:g} s in vain for {what}.")
            return value

    def next_message(
        self,
        msg_type: Any,
        topic: str,
        *,
        qos: QoSProfile | int | None = None,
        timeout: float = 5.0,
    ) -> Any:
        """Return the next message on `topic`, or the one that a late joiner is given."""
        argument_checks.ros_type(msg_type, "message")
        timeout = argument_checks.check_seconds(timeout)
        with self._explain_timeouts():
            profile = argument_checks.check_qos(qos)
            return self.probe.next_message(msg_type, topic, profile, timeout)

    def publish(
        self, topic: str, message: Any, *, qos: QoSProfile | int = 10, timeout: float = 5.0
    ) -> None:
        """Publish one message, once somebody is there to get it."""
        argument_checks.check_message(message)
        timeout = argument_checks.check_seconds(timeout)
        with self._explain_timeouts():
            profile = argument_checks.check_qos(qos)
            if profile is None:
                profile = QoSProfile(depth=10)
            self.probe.publish(topic, message, profile, timeout)

    @contextlib.contextmanager
    def publisher(
        self, msg_type: Any, topic: str, *, qos: QoSProfile | int = 10, timeout: float = 5.0
    ) -> Iterator[Publisher]:
        """Give a publisher of the session's own for the time of a `with` block."""
        argument_checks.ros_type(msg_type, "message")
        profile = argument_checks.check_qos(qos) or QoSProfile(depth=10)
        with self.probe.open_publisher(
            msg_type, topic, profile, argument_checks.check_seconds(timeout)
        ) as made:
            yield made

    def paced(self, times: int, rate: float) -> Iterator[int]:
        """Yield 1, 2, ..., `times`, `rate` times a second, while the session is open."""
        begun = time.monotonic()
        for number in range(times):
            gap = begun + number / rate - time.monotonic()
            if poll_condition(lambda: self._host.closed, max(0.0, gap), self._host.pulse):
                return
            yield number + 1

    def wait_for_service(self, srv_type: Any, name: str, timeout: float = 5.0) -> None:
        """Return when a server of `name` is ready."""
        argument_checks.ros_type(srv_type, "service")
        timeout = argument_checks.check_seconds(timeout)
        with self._explain_timeouts(), self.probe.open_client(srv_type, name, Deadline(timeout)):
            pass

    def call(self, srv_type: Any, name: str, request: Any, timeout: float = 5.0) -> Any:
        """Call a service and return its response."""
        argument_checks.ros_type(srv_type, "service")
        argument_checks.check_instance(request, srv_type.Request, "request")
        timeout = argument_checks.check_seconds(timeout)
        with self._explain_timeouts():
            return self.probe.call(srv_type, name, request, timeout)

    def answers(self, srv_type: Any, names: Sequence[str], timeout: float = 1.0) -> dict[str, Any]:
        """Return what these services respond to an empty request, by name."""
        return self.probe.collect_answers(srv_type, names, timeout) if names else {}

    def send_goal(
        self,
        action_type: Any,
        name: str,
        goal: Any,
        *,
        timeout: float = 10.0,
        on_feedback: Callable[[Any], None] | None = None,
    ) -> GoalRun:
        """Send a goal; return when the server has accepted or rejected it."""
        argument_checks.ros_type(action_type, "action")
        argument_checks.check_instance(goal, action_type.Goal, "goal")
        if on_feedback is not None:
            argument_checks.check_function(on_feedback, "on_feedback", "print")
        timeout = argument_checks.check_seconds(timeout)
        with self._explain_timeouts():
            probe = self.probe
            self._goals_made = self._goals_made or Goals(probe)
            return self._goals_made.send(action_type, name, goal, timeout, on_feedback)

    def record(
        self,
        topic: str,
        msg_type: Any | None = None,
        *,
        qos: QoSProfile | int | None = None,
        limit: int = 1000,
        timeout: float = 5.0,
    ) -> Recorder:
        """Record a topic from now on."""
        if msg_type is not None:
            argument_checks.ros_type(msg_type, "message")
        argument_checks.check_whole_number(limit, "limit", least=1, example=1000)
        timeout = argument_checks.check_seconds(timeout)
        with self._explain_timeouts():
            profile = argument_checks.check_qos(qos)
            return Recorder(self.probe, topic, msg_type, profile, limit, self._now_ns, timeout)

    def offered(self, names: Sequence[str]) -> dict[str, list[str]]:
        """Return which nodes of this domain publish these topics, or serve these services."""
        made = self._probe
        node = made.node if made is not None else next(iter(self._host.nodes.values()), None)
        return {} if node is None or self._host.closed else who_offers(node, names)

    def participate(self) -> None:
        """Take part in DDS until the session is closed, also while it runs no node."""
        _ = self.probe  # the hidden node is made when it is first asked for, and stays

    @property
    def probe(self) -> Probe:
        """The hidden node through which the session asks, made when it is first needed."""
        self._host.require_open()
        with self._lock:
            if self._probe is None:
                self._probe = Probe(self._host.context, self._host.pool, self._host.pulse)
                self._probe.explaining = self._explain_timeouts
            return self._probe

    # Inside.

    @contextlib.contextmanager
    def _explain_timeouts(self, *, vague: bool = False) -> Iterator[None]:
        """Add to a WaitTimeout what this session knows about its reasons.

        Args:
            vague: its message does not know what was waited for.
        """
        told = len(self._host.notices)
        self._host.take_back_stolen_nodes()
        known = sum(error.count for error in self._host.errors)
        try:
            yield
        except WaitTimeout as error:
            hints = [str(error)]
            if self._host.closed:
                hints.append("The session is closed.")
            hints += self._host.notices[told:]
            if sum(e.count for e in self._host.errors) > known:
                latest = max(self._host.errors, key=lambda e: e.stamp)
                hints.append(f"Meanwhile {latest}.")
            if (job := current_job()) is not None and job.home.threads == 1:
                hints.append("A wait inside a callback holds up all others: run with threads=2.")
            if moved := self._host.registry.moved_nodes():
                hints.append(
                    f"{', '.join(moved)}: in an executor of your own, where callbacks run only "
                    "while it spins; executor.remove_node(node) gives a node back."
                )
            hints += [str(blocked) for blocked in self._held_up_by()[:2]]
            if not self._host.closed:
                found = self._hints(vague=vague, sought=error.sought)
                hints += found[:_MOST_HINTS]
                if (more := len(found) - _MOST_HINTS) > 0:
                    hints.append(f"session.diagnose() names {more} more.")
            raise WaitTimeout(" ".join(hints), error.sought) from None

    def _held_up_by(self) -> list[BlockedCallback]:
        me = current_job()
        mine = None if me is None else (id(me), me.since)
        return [blocked for blocked in self._host.blocked_callbacks() if blocked.key != mine]
