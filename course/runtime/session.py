"""Session: run ROS 2 nodes in the background, safely, from a notebook, a script or a test."""

# mypy: allow-untyped-calls

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from typing import Any, Self

from rclpy.context import Context
from rclpy.exceptions import InvalidHandle
from rclpy.node import Node

from course.domains import check_domain_id, lease_domain
from course.errors import SessionError
from course.runtime import closing, logs, signals
from course.runtime.asking import Asking
from course.runtime.callback_errors import CallbackError, ErrorLog
from course.runtime.closing import CloseReport
from course.runtime.context import Discovery, open_context
from course.runtime.crew import Crew
from course.runtime.jobs import Job, current_job
from course.runtime.log_store import store
from course.runtime.logs import LogTable
from course.runtime.names import node_name
from course.runtime.rcutils_tap import keep_every_level
from course.runtime.residents import Factory, Residents
from course.runtime.simtime import SimulatedTime
from course.runtime.waiting import Pulse


class Session(Asking):
    """One private rclpy Context on one domain, and the nodes it runs in the background.

    Attributes:
        domain_id: the ROS domain, leased or joined.
        context: the rclpy context that all its nodes share.
        threads: how many threads run callbacks, unless `run` is told otherwise.
        options: what the session was made with, by name.
        notices: sentences for the learner about what the session had to put right.
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
            domain_id: join this ROS domain, 0 to 101; None leases one that nobody else uses.
            discovery: how far DDS looks for others: "LOCALHOST", "SUBNET" or "SYSTEM_DEFAULT".
            peers: addresses of further hosts to look for (a robot's, for instance).
            threads: 1 runs all callbacks one after the other, more run them in that many threads.
            sim_time: nodes follow simulated time, which `sim.advance` moves.

        Raises:
            DomainError: the domain is out of range, or none is free.
            SessionError: ROS 2 does not start.
        """
        if threads < 1:
            raise SessionError(f"A session needs at least 1 thread, not {threads}.")
        self._lease = lease_domain() if domain_id is None else None
        self.domain_id: int = check_domain_id(self._lease.domain_id if self._lease else domain_id)
        self.threads = threads
        self.options = {
            "domain_id": domain_id,
            "discovery": discovery,
            "peers": peers,
            "threads": threads,
            "sim_time": sim_time,
        }
        try:
            self.context: Context = open_context(
                self.domain_id, discovery, peers, sim_time=sim_time
            )
        except BaseException:
            self._release_domain()
            raise
        self._lock = threading.RLock()
        self._errors = ErrorLog()
        crew = Crew(self.context, f"ROS domain {self.domain_id}", self._on_job)
        super().__init__(self.context, crew, Pulse())
        self._residents = Residents(self.context, crew, self._pulse)
        self._residents.on_made += [keep_every_level, self._claim_log]
        self._opened = time.time()
        self._ended = threading.Event()
        self.context.on_shutdown(self._ended.set)
        self.notices: list[str] = []
        self._report = CloseReport()
        self._closing = False
        self._closed = False
        self._on_close: list[Callable[[], None]] = []
        self._sim: SimulatedTime | None = None
        if sim_time:
            self._sim = SimulatedTime(self._probe, crew, self._residents)
            self._residents.on_made.append(self._sim.welcome)
        closing.register(self)

    # Nodes.

    def run(
        self, factory: Factory | Node, *args: Any, threads: int | None = None, **kwargs: Any
    ) -> Node:
        """Make a node and spin it in the background; return it.

        Running the same factory with the same arguments again, or one whose node has the same
        fully qualified name, replaces the earlier node.

        Args:
            factory: a Node class, a function that returns a Node, or a node of this session.
            args: passed to the factory.
            threads: run this node's callbacks in a pool of this many threads instead of the
                session's own; nodes with the same number share one.
            kwargs: passed to the factory.

        Raises:
            SessionError: the session is closed, or the factory made no node for it.
        """
        self._require_open()
        return self._residents.run(factory, args, kwargs, threads or self.threads)

    def stop(self, *what: Any) -> None:
        """Stop nodes and take them off the graph; without arguments, every node. Idempotent.

        Args:
            what: nodes, names (``"camera"`` or ``"/front/camera"``) or the classes that made them.

        Raises:
            SessionError: a name that this session never ran.
        """
        for resident in self._residents.find(what):
            self._residents.stop(resident.node)

    def pause(self, *what: Any) -> None:
        """Stop executing callbacks of nodes, while DDS goes on receiving for them. Idempotent."""
        for resident in self._residents.find(what):
            self._residents.pause(resident)

    def resume(self, *what: Any) -> None:
        """Execute callbacks of paused nodes again, first those of what has arrived meanwhile."""
        for resident in self._residents.find(what):
            self._residents.resume(resident)

    @property
    def nodes(self) -> dict[str, Node]:
        """The nodes that run, by fully qualified name (a snapshot)."""
        return {resident.name: resident.node for resident in self._residents.all()}

    @property
    def errors(self) -> list[CallbackError]:
        """What callbacks raised, in order of first occurrence (a snapshot)."""
        return list(self._errors.items)

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

    def logs(self, node: Any = None, *, level: str = "INFO", last: int | None = 50) -> LogTable:
        """Return what nodes logged and callbacks printed, as a table.

        Args:
            node: a node, its name or its class; None for all.
            level: the lowest level to show: DEBUG, INFO, WARN, ERROR or FATAL.
            last: how many of the latest rows; None for all that are kept (1000 a node).

        Raises:
            SessionError: an unknown level, or a name that this session never ran.
        """
        names = None if node is None else self._residents.names(node)
        return logs.table(self._crew, self._opened, names, level, last)

    def take_back_stolen_nodes(self) -> None:
        """Spin nodes again that `rclpy.spin_once(node)` and its like took away; leave a notice.

        Every wait of this session does this first.
        """
        for name in self._residents.take_back_stolen():
            self.notices.append(
                f"{name} was taken out of this session by rclpy.spin_once(node) or one of its "
                "relatives, and would never have run another callback. The session has taken it "
                "back; it spins its nodes by itself, so you can leave that line out."
            )

    # Closing.

    @property
    def closed(self) -> bool:
        """True once the session has been closed, or its context shut down by rclpy.shutdown()."""
        return self._closing or not self.context.ok()

    def spin(self) -> None:
        """Block until Ctrl-C, SIGTERM or the end of the session; for scripts.

        Returns normally in each case: close the session afterwards, or leave its `with` block.
        """
        self._require_open()
        with signals.ending(self._ended):
            self._ended.wait()
        if not self.closed:
            self._ended.clear()

    def close(self, timeout: float = 5.0) -> CloseReport:
        """Stop every node and thread, shut the context down, give the domain back. Idempotent.

        Args:
            timeout: seconds that callbacks which still run are given, all together.

        Returns:
            What was left behind: `leaked` names the threads whose callback did not end. Called
            from a callback of this session, it returns at once, and the report is filled in later.
        """
        job = current_job()
        if job is not None and job.home.session_key is self._crew:
            # A thread cannot wait for its own end: another one does it, once this callback is over.
            self._closing = True
            threading.Thread(target=self.close, args=(timeout,), name="ROS session closer").start()
            return self._report
        with self._lock:
            if not self._closed:
                self._closing = True
                closing.close(self, self._report, timeout)
                self._closed = True
            return self._report

    def on_close(self, callback: Callable[[], None]) -> None:
        """Call `callback` when the session closes, after its threads have stopped."""
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

    def _require_open(self) -> None:
        if self.closed:
            raise SessionError("This session is closed: open a new one with course.Session().")

    def _release_domain(self) -> None:
        if self._lease is not None:
            self._lease.release()

    def _now_ns(self) -> int | None:
        return None if self._sim is None else self._sim.now_ns

    def _claim_log(self, node: Node) -> None:
        store.claim(node_name(node), self._crew)

    def _on_job(self, job: Job, failure: BaseException | None) -> None:
        # A callback that outlives its stopped node finds everything destroyed: that is no news.
        late = isinstance(failure, InvalidHandle) and job.node in self._residents.stopped
        if failure is not None and not late:
            self._errors.record(job, failure)
        self._pulse.beat()

    def dismantle(self, deadline: float) -> list[str]:
        """Do the work of `close`; return the threads that did not end by `deadline`.

        Repeatable: Ctrl-C may have cut the first attempt short.
        """
        self._ended.set()
        leaked = self._crew.stop(deadline)
        self._residents.forget_all()
        for callback in self._on_close:
            callback()
        self._pulse.beat()
        self.context.try_shutdown()
        self._crew.shutdown(deadline)
        self.context.destroy()
        self._release_domain()
        store.disclaim(self._crew)
        return leaked
