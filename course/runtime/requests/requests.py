"""What a session can wait for and ask: conditions, messages, services, actions, recordings."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeVar

from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile

from course.errors import WaitTimeout
from course.runtime.callbacks.jobs import current_job
from course.runtime.context.interruptible import SessionContext
from course.runtime.executor.blocked import BlockedCallback
from course.runtime.nodes.host import Hosting
from course.runtime.requests.actions import GoalRun, Goals
from course.runtime.requests.graph_queries import who_offers
from course.runtime.requests.hidden_node import Probe
from course.runtime.requests.recorder import Recorder
from course.runtime.waiting import Deadline, poll
from course.util import arguments

T = TypeVar("T")


_MOST_HINTS = 3


class Asking(Hosting):
    """The part of a Session that waits and asks.

    Attributes:
        explains: whether a wait that times out says what `diagnose` finds. A program that only asks
            whether something comes, and expects that it may not, switches it off.
    """

    def __init__(self, context: SessionContext, threads: int) -> None:
        """Ask in `context`; see `Hosting`."""
        super().__init__(context, threads)
        self.explains = True
        self._asking_lock = threading.Lock()
        self._probe_made: Probe | None = None
        self._goals_made: Goals | None = None

    def until(
        self, condition: Callable[[], T], timeout: float = 5.0, what: str = "the condition"
    ) -> T:
        """Return the first true value of `condition`.

        It is asked after each callback of this session, and every 20 ms.

        Args:
            condition: a function without arguments.
            timeout: seconds to wait at most.
            what: what is waited for, to be named in the error.

        Raises:
            WaitTimeout: it was not true in time.
        """
        arguments.function(condition, "The condition", "lambda: len(heard) > 3")
        timeout = arguments.seconds(timeout)
        with self._explaining(vague=True):
            value = poll(condition, timeout, self._pulse)
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
        """Return the next message on `topic`, or the one that a late joiner is given.

        Args:
            msg_type: the message class.
            topic: its name.
            qos: the QoS to request; None requests the strongest that every publisher offers.
            timeout: seconds to wait at most.

        Raises:
            WaitTimeout: none came in time; it says why, as far as the ROS graph knows.
        """
        arguments.ros_type(msg_type, "message")
        timeout = arguments.seconds(timeout)
        with self._explaining():
            profile = arguments.qos(qos)
            return self._probe.next_message(msg_type, topic, profile, timeout)

    def publish(
        self, topic: str, message: Any, *, qos: QoSProfile | int = 10, timeout: float = 5.0
    ) -> None:
        """Publish one message, once somebody is there to get it.

        Args:
            topic: its name.
            message: what to publish.
            qos: the QoS to offer.
            timeout: seconds to wait for a subscription that fits, and for it to have the message.

        Raises:
            WaitTimeout: nobody subscribes with a QoS that fits, or the topic has another type.
        """
        arguments.message(message)
        timeout = arguments.seconds(timeout)
        with self._explaining():
            profile = arguments.qos(qos)
            if profile is None:
                profile = QoSProfile(depth=10)
            self._probe.publish(topic, message, profile, timeout)

    @contextlib.contextmanager
    def publisher(
        self, msg_type: Any, topic: str, *, qos: QoSProfile | int = 10, timeout: float = 5.0
    ) -> Iterator[Publisher]:
        """Give a publisher of the session's own for the time of a `with` block.

        At the block's end, `timeout` seconds are given to what is under way to reliable
        subscriptions.

        Raises:
            WaitTimeout: the topic has another type.
        """
        arguments.ros_type(msg_type, "message")
        profile = arguments.qos(qos) or QoSProfile(depth=10)
        with self._probe.publisher(msg_type, topic, profile, arguments.seconds(timeout)) as made:
            yield made

    def paced(self, times: int, rate: float) -> Iterator[int]:
        """Yield 1, 2, ..., `times`, `rate` times a second, while the session is open."""
        begun = time.monotonic()
        for number in range(times):
            gap = begun + number / rate - time.monotonic()
            if poll(lambda: self.closed, max(0.0, gap), self._pulse):
                return
            yield number + 1

    def wait_for_service(self, srv_type: Any, name: str, timeout: float = 5.0) -> None:
        """Return when a server of `name` is ready.

        Raises:
            WaitTimeout: none was in time; it says why.
        """
        arguments.ros_type(srv_type, "service")
        timeout = arguments.seconds(timeout)
        with self._explaining(), self._probe.client(srv_type, name, Deadline(timeout)):
            pass

    def call(self, srv_type: Any, name: str, request: Any, timeout: float = 5.0) -> Any:
        """Call a service and return its response.

        Raises:
            WaitTimeout: no server, or no answer, within `timeout` seconds; it says which.
        """
        arguments.ros_type(srv_type, "service")
        arguments.instance(request, srv_type.Request, "request")
        timeout = arguments.seconds(timeout)
        with self._explaining():
            return self._probe.call(srv_type, name, request, timeout)

    def answers(self, srv_type: Any, names: Sequence[str], timeout: float = 1.0) -> dict[str, Any]:
        """Return what these services respond to an empty request, by name.

        All are asked at the same time; those that do not answer within `timeout` seconds are left
        out.
        """
        return self._probe.answers(srv_type, names, timeout) if names else {}

    def send_goal(
        self,
        action_type: Any,
        name: str,
        goal: Any,
        *,
        timeout: float = 10.0,
        on_feedback: Callable[[Any], None] | None = None,
    ) -> GoalRun:
        """Send a goal; return when the server has accepted or rejected it.

        Args:
            action_type: the action class.
            name: the action's name.
            goal: the goal message.
            timeout: seconds for server and answer together.
            on_feedback: called with each feedback message, in a background thread.

        Raises:
            WaitTimeout: no server, or no answer, in time.
        """
        arguments.ros_type(action_type, "action")
        arguments.instance(goal, action_type.Goal, "goal")
        if on_feedback is not None:
            arguments.function(on_feedback, "on_feedback", "print")
        timeout = arguments.seconds(timeout)
        with self._explaining():
            probe = self._probe
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
        """Record a topic from now on.

        Args:
            topic: its name.
            msg_type: the message class; None takes the topic's type from the graph.
            qos: the QoS to request; None requests the strongest that every publisher offers now.
            limit: how many messages to keep.
            timeout: seconds to wait for somebody to give the topic a type, without `msg_type`.

        Raises:
            WaitTimeout: `msg_type` is None, and the topic does not appear.
        """
        if msg_type is not None:
            arguments.ros_type(msg_type, "message")
        arguments.whole(limit, "limit", least=1, example=1000)
        timeout = arguments.seconds(timeout)
        with self._explaining():
            profile = arguments.qos(qos)
            return Recorder(self._probe, topic, msg_type, profile, limit, self._now_ns, timeout)

    def offered(self, names: Sequence[str]) -> dict[str, list[str]]:
        """Return which nodes of this domain publish these topics, or serve these services.

        Args:
            names: as the graph spells them; an action is served as ``/dock/_action/send_goal``.

        Returns:
            The fully qualified names of the nodes, by topic or service; those that nobody offers
            are left out.
        """
        made = self._probe_made
        node = made.node if made is not None else next(iter(self.nodes.values()), None)
        return {} if node is None or self.closed else who_offers(node, names)

    def participate(self) -> None:
        """Take part in DDS until the session is closed, also while it runs no node.

        Without it the participant comes with the first node and goes with the last one, and
        whoever comes next has to find all others anew.
        """
        _ = self._probe  # the hidden node is made when it is first asked for, and stays

    # Inside.

    @property
    def _probe(self) -> Probe:
        self._require_open()
        with self._asking_lock:
            if self._probe_made is None:
                self._probe_made = Probe(self.context, self._crew, self._pulse)
                self._probe_made.explaining = self._explaining
            return self._probe_made

    def _now_ns(self) -> int | None:
        """Return simulated time (ns), or None where time is not simulated."""
        return None

    @contextlib.contextmanager
    def _explaining(self, *, vague: bool = False) -> Iterator[None]:
        """Add to a WaitTimeout what this session knows about its reasons.

        Args:
            vague: its message does not know what was waited for.
        """
        told = len(self.notices)
        self.take_back_stolen_nodes()
        known = sum(error.count for error in self.errors)
        try:
            yield
        except WaitTimeout as error:
            hints = [str(error)]
            if self.closed:
                hints.append("The session is closed.")
            hints += self.notices[told:]
            if sum(e.count for e in self.errors) > known:
                latest = max(self.errors, key=lambda e: e.stamp)
                hints.append(f"Meanwhile {latest}.")
            if (job := current_job()) is not None and job.home.threads == 1:
                hints.append("A wait inside a callback holds up all others: run with threads=2.")
            if moved := self._residents.moved():
                hints.append(
                    f"{', '.join(moved)}: in an executor of your own, where callbacks run only "
                    "while it spins; executor.remove_node(node) gives a node back."
                )
            hints += [str(blocked) for blocked in self._held_up_by()[:2]]
            if self.explains and not self.closed:
                found = self._further_hints(vague=vague, sought=error.sought)
                hints += found[:_MOST_HINTS]
                if (more := len(found) - _MOST_HINTS) > 0:
                    hints.append(f"session.diagnose() names {more} more.")
            raise WaitTimeout(" ".join(hints), error.sought) from None

    def _further_hints(self, *, vague: bool, sought: str) -> list[str]:
        """Return what else may be the reason that a wait was in vain, the likeliest first."""
        return []

    def _held_up_by(self) -> list[BlockedCallback]:
        me = current_job()
        mine = None if me is None else (id(me), me.since)
        return [blocked for blocked in self.blocked_callbacks() if blocked.key != mine]
