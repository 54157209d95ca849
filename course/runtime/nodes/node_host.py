"""What a session does with nodes: run, replace, stop, pause them, and keep what they say."""

from __future__ import annotations

import time
from typing import Any

from rclpy.exceptions import InvalidHandle
from rclpy.node import Node

from course.errors import SessionError
from course.runtime.callbacks import transitions
from course.runtime.callbacks.callback_errors import CallbackError, ErrorLog
from course.runtime.callbacks.callback_runs import CallbackRun
from course.runtime.callbacks.transitions import FailedTransition
from course.runtime.context.interruptible import SessionContext
from course.runtime.executor.blocked import BlockedCallback, blocked_callbacks
from course.runtime.executor.executor_pool import ExecutorPool
from course.runtime.logs import table
from course.runtime.logs.log_store import store
from course.runtime.logs.table import LogTable
from course.runtime.nodes.node_registry import Factory, NodeRegistry
from course.runtime.output.rcutils_tap import keep_every_level
from course.runtime.rclpy_fixes.clock_sleep import sleeps_in_own_context
from course.runtime.ros_names import node_name
from course.runtime.waiting import Pulse
from course.util import argument_checks

_TIMER_CANCELLED = "failed to call timer: timer is canceled"


class NodeHost:
    """The part of a session that hosts nodes; `CoreSession` says what its methods get and raise.

    Attributes:
        context: the rclpy context that all its nodes share.
        threads: how many threads run callbacks, unless `run` is told otherwise.
        notices: sentences for the learner about what the session had to put right.
        pulse: beats after each callback.
        pool: the executors that spin the nodes.
        registry: the nodes that run.
        closing: whether the session is being closed, or has been.
    """

    def __init__(self, context: SessionContext, threads: int) -> None:
        """Host nodes of `context`, their callbacks in `threads` threads."""
        self.context = context
        self.threads = threads
        self.notices: list[str] = []
        self.closing = False
        self.pulse = Pulse()
        self._errors = ErrorLog()
        label = f"ROS domain {context.get_domain_id()}"
        self.pool = ExecutorPool(context, label, self._record_error, self.pulse)
        self.registry = NodeRegistry(context, self.pool, self.pulse, self.notices.append)
        self.registry.on_made += [keep_every_level, sleeps_in_own_context, self._claim_log]
        self._opened = time.time()
        transitions.watch_transitions()

    @property
    def closed(self) -> bool:
        """True once the session has been closed, or its context shut down."""
        return self.closing or not self.context.ok()

    def run(
        self, factory: Factory | Node, *args: Any, threads: int | None = None, **kwargs: Any
    ) -> Node:
        """Make a node and spin it in the background; return it."""
        self.require_open()
        if threads is not None:
            argument_checks.check_whole_number(threads, "threads", least=1, example=4)
        return self.registry.run(factory, args, kwargs, threads or self.threads)

    def run_beside(self, factory: Factory) -> Node:
        """Make a node and spin it beside all others, even one of the same name or class."""
        self.require_open()
        return self.registry.run(factory, (), {}, self.threads, replace=False)

    def run_apart(self, factory: Factory, purpose: str) -> Node:
        """Make a node and spin it in one thread that only nodes of this purpose share."""
        self.require_open()
        return self.registry.run(factory, (), {}, 1, purpose=purpose)

    def stop(self, *what: Any) -> None:
        """Stop nodes and take them off the graph; without arguments, every node. Idempotent."""
        for entry in self.registry.find(what):
            self.registry.stop(entry.node)
        self.registry.stop_half_made(what)

    def let_go(self, node: Node) -> None:
        """Stop spinning a node and forget it, without destroying it: that is up to the caller."""
        self.registry.let_go(node)

    def pause(self, *what: Any) -> None:
        """Stop executing callbacks of nodes, while DDS goes on receiving for them. Idempotent."""
        for entry in self.registry.find(what):
            self.registry.pause(entry)

    def resume(self, *what: Any) -> None:
        """Execute callbacks of paused nodes again, first those of what has arrived meanwhile."""
        for entry in self.registry.find(what):
            self.registry.resume(entry)

    @property
    def nodes(self) -> dict[str, Node]:
        """The nodes that run, by fully qualified name (a snapshot)."""
        return {entry.name: entry.node for entry in self.registry.list_nodes()}

    @property
    def errors(self) -> list[CallbackError]:
        """What callbacks raised, in order of first occurrence (a snapshot)."""
        return list(self._errors.items)

    @property
    def failed_transitions(self) -> list[FailedTransition]:
        """What went wrong in transitions of managed nodes, since the last one that succeeded."""
        found = [
            failure
            for node in self.nodes.values()
            for failure in transitions.failed_transitions(node)
        ]
        return sorted(found, key=lambda failure: failure.number)

    def logs(self, node: Any = None, *, level: str = "INFO", last: int | None = 50) -> LogTable:
        """Return what nodes logged and callbacks printed, as a table."""
        if last is not None:
            argument_checks.check_whole_number(last, "last", least=0, example=50)
        names = None if node is None else self.registry.names_of(node)
        return table.make_table(self.pool, self._opened, names, level, last)

    def blocked_callbacks(self, longer_than: float = 1.0) -> list[BlockedCallback]:
        """Return the callbacks that have been running for over `longer_than` seconds."""
        return blocked_callbacks(self.pool.all_executors(), longer_than)

    def take_back_stolen_nodes(self) -> None:
        """Spin nodes again that `rclpy.spin_once(node)` and its like took away; leave a notice."""
        for name in self.registry.take_back_stolen():
            self.notices.append(
                f"{name} was taken out of this session by rclpy.spin(node) or one of its "
                "relatives, and would never have run another callback. The session has taken it "
                "back; it spins its nodes by itself, so you can leave that line out."
            )

    def require_open(self) -> None:
        """Raise a `SessionError` if the session is closed."""
        if self.closed:
            raise SessionError(
                "This session is closed, or a node has shut its context down (rclpy.shutdown() "
                "ends every node of it): open a new one with course.Session()."
            )

    # Inside.

    def _claim_log(self, node: Node) -> None:
        store.claim_node(node_name(node), self.pool)

    def _record_error(self, job: CallbackRun, failure: BaseException) -> None:
        # A callback that outlives its node finds everything destroyed, and a timer may be cancelled
        # while rclpy calls it: neither is news.
        outlived = isinstance(failure, InvalidHandle) and self.registry.is_leaving(job.node)
        if not outlived and _TIMER_CANCELLED not in str(failure):
            self._errors.record(job, failure)
