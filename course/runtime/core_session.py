"""The core of a session: it runs ROS 2 nodes in the background, safely, and nothing else.

Examiners and submissions have no use for live views and diagnosis, which `course.Session` adds.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from typing import Any, Self

from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.subscription import Subscription

from course.domains import neighbours
from course.domains.leases import check_domain_id, lease_domain
from course.errors import SessionError
from course.runtime.callbacks.jobs import current_job
from course.runtime.context import closing, signals
from course.runtime.context.closing import CloseReport
from course.runtime.context.context import Discovery, open_context
from course.runtime.logs.store import store
from course.runtime.nodes.half_made import Remains
from course.runtime.requests.requests import Asking
from course.runtime.simulated_time import SimulatedTime
from course.runtime.waiting import Pulse
from course.util import arguments


class CoreSession(Asking):
    """One private rclpy Context on one domain, and the nodes it runs in the background.

    Attributes:
        domain_id: the ROS domain, leased or joined.
        options: what the session was made with, by name.
        context, threads, notices: see `Hosting`.
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
        arguments.whole(threads, "threads", least=1, example=4)
        self._lease = lease_domain() if domain_id is None else None
        self.domain_id: int = check_domain_id(self._lease.domain_id if self._lease else domain_id)
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
        super().__init__(context, threads)
        self._lock = threading.RLock()
        self._endings = Pulse()
        self.context.on_shutdown(self._endings.beat)
        self._report = CloseReport()
        self._closing = False
        self._closed = False
        self._on_close: list[Callable[[], None]] = []
        self._sim: SimulatedTime | None = None
        if sim_time:
            self._sim = SimulatedTime(self._probe, self._crew, self._residents)
            self._residents.on_made.append(self._sim.welcome)
        self._answering = neighbours.Answering(self._lease, self.offered) if self._lease else None
        closing.register(self)

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
        return self._probe.node

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
        return self._probe.subscribe(msg_type, topic, callback, qos, raw=raw)

    def unwatch(self, subscription: Subscription) -> None:
        """End a `watch`. Idempotent."""
        if not self.closed:
            self._probe.drop(subscription)

    def moved_nodes(self) -> list[str]:
        """Return the names of nodes that are in an executor of the learner's own."""
        return self._residents.moved()

    def half_made(self) -> list[Remains]:
        """Return what is left of nodes whose constructor raised."""
        return self._residents.half_made.all()

    def paused_nodes(self) -> list[str]:
        """Return the names of paused nodes."""
        return [resident.name for resident in self._residents.all() if resident.paused]

    # Closing.

    @property
    def closed(self) -> bool:
        """True once the session has been closed, or its context shut down by rclpy.shutdown()."""
        return self._closing or not self.context.ok()

    def spin(self) -> None:
        """Block until Ctrl-C, SIGTERM or the end of the session; for scripts.

        Returns normally in each case: close the session afterwards, or leave its `with` block.
        """
        seen = self._endings.count
        self._require_open()
        with signals.ending(self._endings.beat):
            self._endings.wait(seen)

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
        timeout = arguments.seconds(timeout)
        with self._lock:
            if not self._closed:
                self._closing = True
                closing.close(self, self._report, timeout)
                self._closed = True
            return self._report

    def on_close(self, callback: Callable[[], None]) -> None:
        """Call `callback` when the session closes, after its threads have stopped."""
        arguments.function(callback, "The callback", "lambda: print('closed')")
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

    def _release_domain(self) -> None:
        if self._lease is not None:
            self._lease.release()

    def _now_ns(self) -> int | None:
        return None if self._sim is None else self._sim.now_ns

    def dismantle(self, deadline: float) -> list[str]:
        """Do the work of `close`; return the threads that did not end by `deadline`.

        Repeatable: Ctrl-C may have cut the first attempt short.
        """
        self._endings.beat()
        if self._answering is not None:
            self._answering.stop()
        leaked = self._crew.stop(deadline)
        leaked += self._residents.forget_all()
        for callback in self._on_close:
            callback()
        self._pulse.beat()
        self.context.try_shutdown()
        self._crew.shutdown(deadline)
        self.context.join(max(0.1, deadline - time.monotonic()))
        self.context.destroy()
        self._release_domain()
        store.disclaim(self._crew)
        return leaked
