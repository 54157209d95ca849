"""What a session does with nodes: run, replace, stop, pause them, and keep what they say."""

from __future__ import annotations

import time
from typing import Any

from rclpy.exceptions import InvalidHandle
from rclpy.node import Node

from course.errors import SessionError
from course.runtime.callbacks import transitions
from course.runtime.callbacks.errors import CallbackError, ErrorLog
from course.runtime.callbacks.jobs import Job
from course.runtime.callbacks.transitions import FailedTransition
from course.runtime.context.interruptible import SessionContext
from course.runtime.executor.blocked import BlockedCallback, blocked_callbacks
from course.runtime.executor.pool import Crew
from course.runtime.logs import table
from course.runtime.logs.store import store
from course.runtime.logs.table import LogTable
from course.runtime.names import node_name
from course.runtime.nodes.registry import Factory, Residents
from course.runtime.output.rcutils_tap import keep_every_level
from course.runtime.rclpy_fixes.clock_sleep import sleeps_in_own_context
from course.runtime.waiting import Pulse
from course.util import arguments

_TIMER_CANCELLED = "failed to call timer: timer is canceled"


class Hosting:
    """The part of a Session that hosts nodes.

    Attributes:
        context: the rclpy context that all its nodes share.
        threads: how many threads run callbacks, unless `run` is told otherwise.
        notices: sentences for the learner about what the session had to put right.
    """

    def __init__(self, context: SessionContext, threads: int) -> None:
        """Host nodes of `context`, their callbacks in `threads` threads."""
        self.context = context
        self.threads = threads
        self.notices: list[str] = []
        self._pulse = Pulse()
        self._errors = ErrorLog()
        label = f"ROS domain {context.get_domain_id()}"
        self._crew = Crew(context, label, self._record, self._pulse)
        self._residents = Residents(context, self._crew, self._pulse, self.notices.append)
        self._residents.on_made += [keep_every_level, sleeps_in_own_context, self._claim_log]
        self._opened = time.time()
        transitions.watch()

    @property
    def closed(self) -> bool:
        """True once the context has been shut down."""
        return not self.context.ok()

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
        self._require_open()
        if threads is not None:
            arguments.whole(threads, "threads", least=1, example=4)
        return self._residents.run(factory, args, kwargs, threads or self.threads)

    def run_beside(self, factory: Factory) -> Node:
        """Make a node and spin it beside all others, even one of the same name or class.

        ROS 2 allows two nodes of one name. In a notebook that is nearly always a cell that was run
        twice, which is why `run` replaces; whoever hosts somebody else's classes wants this.

        Raises:
            SessionError: the session is closed, or the factory made no node for it.
        """
        self._require_open()
        return self._residents.run(factory, (), {}, self.threads, replace=False)

    def stop(self, *what: Any) -> None:
        """Stop nodes and take them off the graph; without arguments, every node. Idempotent.

        Args:
            what: nodes, names (``"camera"`` or ``"/front/camera"``) or the classes that made them.

        Raises:
            SessionError: a name that this session never ran.
        """
        for resident in self._residents.find(what):
            self._residents.stop(resident.node)
        self._residents.stop_half_made(what)

    def let_go(self, node: Node) -> None:
        """Stop spinning a node and forget it, without destroying it: that is now up to the caller.

        Idempotent.
        """
        self._residents.let_go(node)

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
    def failed_transitions(self) -> list[FailedTransition]:
        """What went wrong in transitions of managed nodes, since the last one that succeeded."""
        found = [failure for node in self.nodes.values() for failure in transitions.failed(node)]
        return sorted(found, key=lambda failure: failure.number)

    def logs(self, node: Any = None, *, level: str = "INFO", last: int | None = 50) -> LogTable:
        """Return what nodes logged and callbacks printed, as a table.

        Args:
            node: a node, its name or its class; None for all.
            level: the lowest level to show: DEBUG, INFO, WARN, ERROR or FATAL.
            last: how many of the latest rows; None for all that are kept (1000 a node).

        Raises:
            SessionError: an unknown level, or a name that this session never ran.
        """
        if last is not None:
            arguments.whole(last, "last", least=0, example=50)
        names = None if node is None else self._residents.names(node)
        return table.table(self._crew, self._opened, names, level, last)

    def blocked_callbacks(self, longer_than: float = 1.0) -> list[BlockedCallback]:
        """Return the callbacks that have been running for over `longer_than` seconds.

        Each says where it is, why it does not return if that can be told (a deadlock, above all),
        and what to do about it.
        """
        return blocked_callbacks(self._crew.all(), longer_than)

    def take_back_stolen_nodes(self) -> None:
        """Spin nodes again that `rclpy.spin_once(node)` and its like took away; leave a notice.

        Every wait of this session does this first.
        """
        for name in self._residents.take_back_stolen():
            self.notices.append(
                f"{name} was taken out of this session by rclpy.spin(node) or one of its "
                "relatives, and would never have run another callback. The session has taken it "
                "back; it spins its nodes by itself, so you can leave that line out."
            )

    # Inside.

    def _require_open(self) -> None:
        if self.closed:
            raise SessionError(
                "This session is closed, or a node has shut its context down (rclpy.shutdown() "
                "ends every node of it): open a new one with course.Session()."
            )

    def _claim_log(self, node: Node) -> None:
        store.claim(node_name(node), self._crew)

    def _record(self, job: Job, failure: BaseException) -> None:
        # A callback that outlives its node finds everything destroyed, and a timer may be cancelled
        # while rclpy calls it: neither is news.
        outlived = isinstance(failure, InvalidHandle) and self._residents.is_leaving(job.node)
        if not outlived and _TIMER_CANCELLED not in str(failure):
            self._errors.record(job, failure)
