"""The core of a session: it runs ROS 2 nodes in the background, safely, and nothing else.

Examiners and submissions have no use for live views and diagnosis, which `course.Session` adds.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, suppress
from typing import Any, Self, TypeVar

from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription

from course.errors import SessionError
from course.runtime.callbacks.callback_errors import CallbackError
from course.runtime.callbacks.callback_runs import current_job
from course.runtime.callbacks.transitions import FailedTransition
from course.runtime.context import close_order, signals
from course.runtime.context.close_order import CloseReport
from course.runtime.context.context import Discovery, open_context
from course.runtime.context.interruptible import SessionContext
from course.runtime.domains import domain_discovery, port_bases
from course.runtime.domains.leases import check_domain_id, lease_domain
from course.runtime.executor.blocked import BlockedCallback
from course.runtime.logs.log_store import store
from course.runtime.logs.table import LogTable
from course.runtime.nodes.half_made import Remains
from course.runtime.nodes.node_host import NodeHost
from course.runtime.nodes.node_registry import Factory
from course.runtime.requests.actions import GoalRun
from course.runtime.requests.recorder import Recorder
from course.runtime.requests.session_requests import Requests
from course.runtime.simulated_time import SimulatedTime
from course.runtime.waiting import Pulse
from course.util import argument_checks

T = TypeVar("T")


class CoreSession:
    """One private rclpy Context on one domain, and the nodes it runs in the background.

    Attributes:
        domain_id: the ROS domain, leased or joined.
        options: what the session was made with, by name.
        explains: whether a wait that times out says what `diagnose` finds. A program that only asks
            whether something comes, and expects that it may not, switches it off.
    """

    def __init__(
        self,
        *,
        domain_id: int | None = None,
        discovery: Discovery = "LOCALHOST",
        peers: Sequence[str] = (),
        threads: int = 1,
        sim_time: bool = False,
    ) -> None:
        """Open a session.

        Args:
            domain_id: join this ROS domain, such as 7; None leases one that nobody else uses.
            discovery: how far DDS looks for others: "LOCALHOST", "SUBNET" or "SYSTEM_DEFAULT".
            peers: addresses of further hosts to look for (a robot's, for instance).
            threads: 1 runs all callbacks one after the other, more run them in that many threads.
            sim_time: nodes follow simulated time, which `sim.advance` moves.

        Raises:
            DomainError: the domain is out of range, or none is free.
            SessionError: ROS 2 does not start.
        """
        argument_checks.check_whole_number(threads, "threads", least=1, example=4)
        self._lease = lease_domain() if domain_id is None else None
        self.domain_id: int = (
            self._lease.domain_id if self._lease else self._check_domain(domain_id)
        )
        port_bases.settle(port_bases.current_base())
        self.options = {
            "domain_id": domain_id,
            "discovery": discovery,
            "peers": peers,
            "threads": threads,
            "sim_time": sim_time,
        }
        try:
            context = open_context(self.domain_id, discovery, peers, sim_time=sim_time)
        except BaseException:
            self._release_domain()
            raise
        self.explains = True
        self._host = NodeHost(context, threads)
        self._requests = Requests(self._host, self._find_hints, self._now_ns)
        self._lock = threading.RLock()
        self._endings = Pulse()
        self.context.on_shutdown(self._endings.beat)
        self._report = CloseReport()
        self._closed = False
        self._before_close: list[Callable[[], None]] = []
        self._on_close: list[Callable[[], None]] = []
        self._sim: SimulatedTime | None = None
        if sim_time:
            self._sim = SimulatedTime(self._requests.probe, self._host.pool, self._host.registry)
            self._host.registry.on_made.append(self._sim.welcome)
        self._answering = (
            domain_discovery.Answering(self._lease, self.offered) if self._lease else None
        )
        close_order.register_session(self)

    @property
    def context(self) -> SessionContext:
        """The rclpy context that all its nodes share."""
        return self._host.context

    @property
    def threads(self) -> int:
        """How many threads run callbacks, unless `run` is told otherwise."""
        return self._host.threads

    @property
    def notices(self) -> list[str]:
        """Sentences for the learner about what the session had to put right."""
        return self._host.notices

    # Nodes: see `NodeHost`.

    def run(
        self, factory: Factory | Node, *args: Any, threads: int | None = None, **kwargs: Any
    ) -> Node:
        """Make a node and spin it in the background; return it.

        Running the same factory with the same arguments again, or one whose node has the same
        fully qualified name, replaces the earlier node; also one whose constructor raised, which
        rclpy leaves on the graph half made, with all that it began.

        Args:
            factory: a Node class, a function that returns a Node, or a node of this session.
            args: passed to the factory.
            threads: run this node's callbacks in a pool of this many threads instead of the
                session's own; nodes with the same number share one.
            kwargs: passed to the factory.

        Raises:
            SessionError: the session is closed, or the factory made no node for it.
        """
        return self._host.run(factory, *args, threads=threads, **kwargs)

    def run_beside(self, factory: Factory) -> Node:
        """Make a node and spin it beside all others, even one of the same name or class.

        ROS 2 allows two nodes of one name. In a notebook that is nearly always a cell that was run
        twice, which is why `run` replaces. A program that runs other people's classes needs this.

        Raises:
            SessionError: the session is closed, or the factory made no node for it.
        """
        return self._host.run_beside(factory)

    def run_apart(self, factory: Factory, purpose: str) -> Node:
        """Make a node and spin it in one thread that only nodes of this purpose share.

        No callback of a learner's can hold it up, as for a simulated world; in all else it is as
        with `run`.

        Raises:
            SessionError: the session is closed, or the factory made no node for it.
        """
        return self._host.run_apart(factory, purpose)

    def stop(self, *what: Any) -> None:
        """Stop nodes and take them off the graph; without arguments, every node. Idempotent.

        Args:
            what: nodes, names (``"camera"`` or ``"/front/camera"``) or the classes that made them.

        Raises:
            SessionError: a name that this session never ran.
        """
        self._host.stop(*what)

    def let_go(self, node: Node) -> None:
        """Stop spinning a node and forget it, without destroying it: that is now up to the caller.

        Idempotent.
        """
        self._host.let_go(node)

    def pause(self, *what: Any) -> None:
        """Stop executing callbacks of nodes, while DDS goes on receiving for them. Idempotent."""
        self._host.pause(*what)

    def resume(self, *what: Any) -> None:
        """Execute callbacks of paused nodes again, first those of what has arrived meanwhile."""
        self._host.resume(*what)

    @property
    def nodes(self) -> dict[str, Node]:
        """The nodes that run, by fully qualified name (a snapshot)."""
        return self._host.nodes

    @property
    def errors(self) -> list[CallbackError]:
        """What callbacks raised, in order of first occurrence (a snapshot)."""
        return self._host.errors

    @property
    def failed_transitions(self) -> list[FailedTransition]:
        """What went wrong in transitions of managed nodes, since the last one that succeeded."""
        return self._host.failed_transitions

    def logs(self, node: Any = None, *, level: str = "INFO", last: int | None = 50) -> LogTable:
        """Return what nodes logged and callbacks printed, as a table.

        Args:
            node: a node, its name or its class; None for all.
            level: the lowest level to show: DEBUG, INFO, WARN, ERROR or FATAL.
            last: how many of the latest rows; None for all that are kept (1000 a node).

        Raises:
            SessionError: an unknown level, or a name that this session never ran.
        """
        return self._host.logs(node, level=level, last=last)

    def blocked_callbacks(self, longer_than: float = 1.0) -> list[BlockedCallback]:
        """Return the callbacks that have been running for over `longer_than` seconds.

        Each says where it is, why it does not return if that can be told (a deadlock, above all),
        and what to do about it.
        """
        return self._host.blocked_callbacks(longer_than)

    def take_back_stolen_nodes(self) -> None:
        """Spin nodes again that `rclpy.spin_once(node)` and its like took away; leave a notice.

        Every wait of this session does this first.
        """
        self._host.take_back_stolen_nodes()

    # Waiting and asking: see `Requests`.

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
        return self._requests.until(condition, timeout, what)

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
        return self._requests.next_message(msg_type, topic, qos=qos, timeout=timeout)

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
        self._requests.publish(topic, message, qos=qos, timeout=timeout)

    def publisher(
        self, msg_type: Any, topic: str, *, qos: QoSProfile | int = 10, timeout: float = 5.0
    ) -> AbstractContextManager[Publisher]:
        """Give a publisher of the session's own for the time of a `with` block.

        At the block's end, `timeout` seconds are given to what is under way to reliable
        subscriptions.

        Raises:
            WaitTimeout: the topic has another type.
        """
        return self._requests.publisher(msg_type, topic, qos=qos, timeout=timeout)

    def paced(self, times: int, rate: float) -> Iterator[int]:
        """Yield 1, 2, ..., `times`, `rate` times a second, while the session is open."""
        return self._requests.paced(times, rate)

    def wait_for_service(self, srv_type: Any, name: str, timeout: float = 5.0) -> None:
        """Return when a server of `name` is ready.

        Raises:
            WaitTimeout: none was in time; it says why.
        """
        self._requests.wait_for_service(srv_type, name, timeout)

    def call(self, srv_type: Any, name: str, request: Any, timeout: float = 5.0) -> Any:
        """Call a service and return its response.

        Raises:
            WaitTimeout: no server, or no answer, within `timeout` seconds; it says which.
        """
        return self._requests.call(srv_type, name, request, timeout)

    def answers(self, srv_type: Any, names: Sequence[str], timeout: float = 1.0) -> dict[str, Any]:
        """Return what these services respond to an empty request, by name.

        All are asked at the same time; those that do not answer within `timeout` seconds are left
        out.
        """
        return self._requests.answers(srv_type, names, timeout)

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
        return self._requests.send_goal(
            action_type, name, goal, timeout=timeout, on_feedback=on_feedback
        )

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
        return self._requests.record(topic, msg_type, qos=qos, limit=limit, timeout=timeout)

    def offered(self, names: Sequence[str]) -> dict[str, list[str]]:
        """Return which nodes of this domain publish these topics, or serve these services.

        Args:
            names: as the graph spells them; an action is served as ``/dock/_action/send_goal``.

        Returns:
            The fully qualified names of the nodes, by topic or service; those that nobody offers
            are left out.
        """
        return self._requests.offered(names)

    def participate(self) -> None:
        """Take part in DDS until the session is closed, also while it runs no node.

        Without it the participant comes with the first node and goes with the last one, and the
        next node has to discover all others again.
        """
        self._requests.participate()

    # Time, and looking on.

    @property
    def sim(self) -> SimulatedTime:
        """The session's clock.

        Raises:
            SessionError: the session was opened without `sim_time=True`.
        """
        if self._sim is None:
            raise SessionError(
                "This session runs in real time: open one with course.Session(sim_time=True)."
            )
        return self._sim

    @property
    def observer(self) -> Node:
        """The hidden node through which the session looks at the graph."""
        return self._requests.probe.node

    def watch(
        self,
        msg_type: Any,
        topic: str,
        callback: Callable[..., None],
        qos: QoSProfile | int,
        *,
        raw: bool = False,
    ) -> Subscription:
        """Call ``callback`` with each message on a topic, in a background thread.

        With a second argument, it gets what DDS says about the message, too: its time stamps and
        number (see rclpy's ``create_subscription``). With ``raw`` a message comes as CDR.

        For live views: a node that blocks does not hold it up. `unwatch` ends it.
        """
        return self._requests.probe.subscribe(msg_type, topic, callback, qos, raw=raw)

    def unwatch(self, subscription: Subscription) -> None:
        """End a `watch`. Idempotent."""
        if not self.closed:
            self._requests.probe.drop(subscription)

    def moved_nodes(self) -> list[str]:
        """Return the names of nodes that are in an executor of the learner's own."""
        return self._host.registry.moved_nodes()

    def half_made(self) -> list[Remains]:
        """Return what is left of nodes whose constructor raised."""
        return self._host.registry.half_made.all_remains()

    def paused_nodes(self) -> list[str]:
        """Return the names of paused nodes."""
        return [entry.name for entry in self._host.registry.list_nodes() if entry.paused]

    def nodes_apart(self) -> list[str]:
        """Return the names of nodes made by `run_apart`: they are no work of a learner's."""
        return [entry.name for entry in self._host.registry.list_nodes() if entry.apart]

    # Closing.

    @property
    def closed(self) -> bool:
        """True once the session has been closed, or its context shut down by rclpy.shutdown()."""
        return self._host.closed

    def require_open(self) -> None:
        """Raise a `SessionError` if the session is closed."""
        self._host.require_open()

    def spin(self) -> None:
        """Block until Ctrl-C, SIGTERM or the end of the session; for scripts.

        Returns normally in each case: close the session afterwards, or leave its `with` block.
        """
        seen = self._endings.count
        self.require_open()
        with signals.wake_on_signals(self._endings.beat):
            self._endings.wait(seen)

    def close(self, timeout: float = 5.0) -> CloseReport:
        """Stop every node and thread, shut the context down, give the domain back. Idempotent.

        Args:
            timeout: seconds that callbacks which still run are given, all together; after half of
                them their nodes are destroyed, so that a long one hears that it is to end.

        Returns:
            What was left behind: `leaked` names the threads whose callback did not end. Called
            from a callback of this session, it returns at once, and the report is filled in later.
        """
        self._announce_close()
        job = current_job()
        if job is not None and job.home.session_key is self._host.pool:
            # A thread cannot wait for its own end: another one does it, once this callback is over.
            self._host.closing = True
            threading.Thread(target=self.close, args=(timeout,), name="ROS session closer").start()
            return self._report
        timeout = argument_checks.check_seconds(timeout)
        with self._lock:
            if not self._closed:
                self._host.closing = True
                close_order.close_session(self, self._report, timeout)
                self._closed = True
            return self._report

    def before_close(self, callback: Callable[[], None]) -> None:
        """Call `callback` when the session is about to close, while all its nodes still run."""
        argument_checks.check_function(callback, "The callback", "lambda: print('closing')")
        self._before_close.append(callback)

    def on_close(self, callback: Callable[[], None]) -> None:
        """Call `callback` when the session closes, after its threads have stopped."""
        argument_checks.check_function(callback, "The callback", "lambda: print('closed')")
        self._on_close.append(callback)

    def __enter__(self) -> Self:
        """Return the session, which the `with` block closes at its end."""
        return self

    def __exit__(self, *exc: object) -> None:
        """Close the session."""
        self.close()

    def __repr__(self) -> str:
        """Return the domain and the nodes that run."""
        state = "closed" if self.closed else ", ".join(sorted(self.nodes)) or "no nodes"
        return f"<Session on domain {self.domain_id}: {state}>"

    # Inside.

    def _announce_close(self) -> None:
        while self._before_close and not self.closed:
            with suppress(Exception):  # whatever it wanted to see: the session closes
                self._before_close.pop()()

    def _check_domain(self, domain_id: object) -> int:
        """Return a domain that was asked for, if a session may be on it."""
        return check_domain_id(domain_id)

    def _release_domain(self) -> None:
        if self._lease is not None:
            self._lease.release()

    def _find_hints(self, *, vague: bool, sought: str) -> list[str]:
        return self._further_hints(vague=vague, sought=sought) if self.explains else []

    def _further_hints(self, *, vague: bool, sought: str) -> list[str]:
        """Return what else may be the reason that a wait was in vain, the likeliest first."""
        return []

    def _now_ns(self) -> int | None:
        return None if self._sim is None else self._sim.now_ns

    def dismantle(self, deadline: float) -> list[str]:
        """Do the work of `close`; return the threads that did not end by `deadline`.

        Repeatable: Ctrl-C may have cut the first attempt short.
        """
        self._endings.beat()
        if self._answering is not None:
            self._answering.stop()
        # A callback that is at work for longer than half of the time may wait to be told that its
        # node goes: by the node's own destroy_node(), its goal handle or rclpy.ok(). So what has
        # leaked shows only after all of these.
        now = time.monotonic()
        self._host.pool.stop(now + (deadline - now) / 2)
        problems = self._host.registry.forget_all()
        for callback in self._on_close:
            callback()
        self._host.pulse.beat()
        self.context.try_shutdown()
        leaked = self._host.pool.find_leaks(deadline) + problems
        self._host.pool.shutdown(deadline)
        self.context.join(max(0.1, deadline - time.monotonic()))
        self.context.destroy()
        self._release_domain()
        store.disclaim_nodes(self._host.pool)
        return leaked
