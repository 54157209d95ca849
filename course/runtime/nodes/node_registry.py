"""The nodes of one session: making, replacing, stopping, pausing and finding them."""

from __future__ import annotations

import functools
import threading
import weakref
from collections.abc import Callable, Container, Hashable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from rclpy.context import Context
from rclpy.executors import Executor
from rclpy.node import Node

from course.errors import SessionError
from course.runtime.callbacks.callback_runs import CallbackRun, current_job
from course.runtime.context.context import as_default_context
from course.runtime.executor.background import BackgroundExecutor
from course.runtime.executor.blocked import describe_job
from course.runtime.executor.executor_pool import ExecutorPool
from course.runtime.nodes import name_conflicts
from course.runtime.nodes.half_made import HalfMade, Remains
from course.runtime.nodes.lingering import LingeringCallbacks
from course.runtime.nodes.uninitialised import (
    describe_missing_init,
    explain_uninitialised,
    is_uninitialised,
)
from course.runtime.output.rcutils_tap import hearing_constructors
from course.runtime.ros_names import is_name, node_name
from course.runtime.teardown import destroy_node, is_alive, is_being_destroyed
from course.runtime.waiting import Pulse, poll_condition
from course.util import argument_checks

_CALLBACK_GRACE_S = 2.0  # s that stop() and pause() give a callback that is running
_ENDING_GRACE_S = 1.0  # s that stop() gives it once its node is destroyed, and it can see that

Factory = Callable[..., Node]


@dataclass
class RegisteredNode:
    """A node that a session runs; ``held`` are those that it brought along, while it is paused.

    ``apart`` says whether it is one of the session's own, see `Session.run_apart`.
    """

    node: Node
    name: str
    key: Hashable
    factory: object
    executor: BackgroundExecutor
    apart: bool = False
    paused: bool = False
    held: list[Node] = field(default_factory=list)


class NodeRegistry:
    """Keeps the nodes of one session."""

    def __init__(
        self, context: Context, pool: ExecutorPool, pulse: Pulse, tell: Callable[[str], None]
    ) -> None:
        """Keep nodes of `context`, spun by `pool`; `tell` passes a sentence on to the learner."""
        self.stopped: weakref.WeakSet[Node] = weakref.WeakSet()
        self.on_made: list[Callable[[Node], None]] = []
        self.half_made = HalfMade(tell)
        self._context = context
        self._pool = pool
        self._pulse = pulse
        self._tell = tell
        self._entries: dict[Node, RegisteredNode] = {}
        self._made_by: dict[str, object] = {}  # every name that ever ran
        self._lock = threading.RLock()

    def list_nodes(self) -> list[RegisteredNode]:
        """Return the nodes that are kept now; those that somebody destroyed are let go of."""
        with self._lock:
            entries = list(self._entries.values())
        for entry in entries:
            if not is_alive(entry.node):
                try:
                    self.stop(entry.node)  # its action servers are still there
                except Exception as error:  # noqa: BLE001 - its cleanup does not take a second call
                    self._tell(
                        f"{entry.name} had been destroyed already; destroying it once more, "
                        f"which must be safe, raised {type(error).__name__}: {error}"
                    )
        return [entry for entry in entries if entry.node not in self.stopped]

    def run(
        self,
        factory: Factory | Node,
        args: tuple[Any, ...],
        kwargs: dict[str, Any],
        threads: int,
        *,
        replace: bool = True,
        purpose: str = "",
    ) -> Node:
        """Make a node and spin it in the executor for ``purpose``; see `Session.run`.

        For ``replace=False`` see `run_beside`, for a purpose `run_apart`.
        """
        argument_checks.check_factory(factory, args, kwargs)
        key = _make_key(factory, args, kwargs) if replace else None
        for entry in self.list_nodes():
            if key is not None and entry.key == key:
                self.stop(entry.node)
        if key is not None:
            self.half_made.clear(lambda remains: remains.key == key)
        node = factory if isinstance(factory, Node) else self._make_node(factory, args, kwargs, key)
        if node.context is not self._context:
            instead = "pass its class to run()"
            if node is not factory:
                instead = "name its class, as factory=TheClass"
            raise SessionError(
                f"{node_name(node)} was made in another rclpy context: {instead}, and let the "
                "session make the node."
            )
        name = node_name(node)
        for entry in self.list_nodes():
            if replace and entry.name == name and entry.node is not node:
                self.stop(entry.node)
        if replace:
            self.half_made.clear(lambda remains: remains.name == name)
        for callback in self.on_made:
            callback(node)
        executor = self._pool.get_executor(threads, purpose)
        with self._lock:
            self._entries[node] = RegisteredNode(
                node, name, key, factory, executor, apart=bool(purpose)
            )
            self._made_by[name] = factory
            executor.add_node(node)  # under the lock: a node without executor looks stolen
        return node

    def is_leaving(self, node: Node | None) -> bool:
        """Return whether `node` is being destroyed, by the session or by hand, or has been."""
        return node is not None and (node in self.stopped or is_being_destroyed(node))

    def stop(self, node: Node) -> None:
        """Stop spinning `node`, let its running callback end, and destroy it. Idempotent.

        A callback that goes on until its node tells it to end has time to do so afterwards.
        """
        entry = self._forget_entry(node)
        if entry is None:
            return
        lingering = self._give_up_callbacks(entry)
        try:
            if destroy_node(node):
                self._tell(
                    f"The destroy_node() of {entry.name} left it on the graph, and the session "
                    "has taken it off; in a program it stays: let the method end with "
                    "super().destroy_node()."
                )
        finally:
            self._tell_who_goes_on(entry, lingering, _ENDING_GRACE_S)

    def let_go(self, node: Node) -> None:
        """Stop spinning `node`, let its running callback end, and forget it. Idempotent."""
        if entry := self._forget_entry(node):
            self._tell_who_goes_on(entry, self._give_up_callbacks(entry))

    def pause(self, entry: RegisteredNode) -> None:
        """Stop executing callbacks; DDS goes on receiving into the node's queues.

        The same is done with nodes that it has brought to its executor: they are part of it.
        """
        entry.paused = True
        jobs = self._take_out(entry.executor, entry.node)
        # In rounds: a callback that was just running may have brought another one.
        while brought := self._brought_along(entry):
            entry.held += brought
            jobs += [job for node in brought for job in self._take_out(entry.executor, node)]
        for job in jobs:
            self._tell(
                f"{entry.name} is paused, but a callback that had begun has not ended: "
                f"{describe_job(job)}"
            )

    def resume(self, entry: RegisteredNode) -> None:
        """Execute callbacks again, beginning with what the queues hold."""
        entry.executor.add_node(entry.node)  # first: it must not look stolen
        held, entry.held = entry.held, []
        for node in filter(is_alive, held):
            entry.executor.add_node(node)
        entry.paused = False

    def stop_half_made(self, what: tuple[Any, ...]) -> None:
        """Take half-made nodes off the graph that `what` stands for; without any, all."""
        self.half_made.clear(
            lambda remains: not what or any(_is_match(remains, item) for item in what),
            replaced=False,
        )

    def forget_all(self) -> list[str]:
        """Destroy every node; no executor may be spinning. Return which cleanups raised what."""
        problems = []
        self.stop_half_made(())
        entries = self.list_nodes()
        nodes = {*(entry.node for entry in entries), *self._pool.all_nodes()}
        nodes.update(node for entry in entries for node in entry.held)
        with self._lock:
            self._entries.clear()
        for node in nodes:
            self.stopped.add(node)
            name = node_name(node)
            try:
                destroy_node(node)
            except Exception as error:  # noqa: BLE001 - a mistake in one node's cleanup, not ours
                problems.append(f"the cleanup of {name} raised {type(error).__name__}: {error}")
        return problems

    def find(self, what: tuple[Any, ...]) -> list[RegisteredNode]:
        """Return what nodes, names or factories stand for; without any, everything.

        Raises:
            SessionError: a name that was never run.
        """
        entries = self.list_nodes()
        if not what:
            return entries
        found = []
        for item in what:
            argument_checks.node_or_name(item)
            matches = [entry for entry in entries if _is_match(entry, item)]
            if not matches and isinstance(item, str):
                self._require_seen(item, entries)
            found += matches
        return found

    def names_of(self, what: Any) -> list[str]:
        """Return the names of nodes that run or ran and that `what` stands for.

        Raises:
            SessionError: a name that was never run.
        """
        argument_checks.node_or_name(what)
        if isinstance(what, Node):
            return [node_name(what)]
        if isinstance(what, str):
            with self._lock:
                names = [known for known in self._made_by if is_name(known, what)]
            return names or [entry.name for entry in self.find((what,))]
        return [name for name, factory in self._made_by.items() if _is_same_factory(factory, what)]

    def find_stolen(self) -> list[RegisteredNode]:
        """Return nodes that some other executor took over and then let go of.

        `rclpy.spin_once(node)` does that: the node leaves its executor and does not come back. A
        node that another executor still holds was moved there on purpose; so was one whose own
        executor has been shut down.
        """
        return [entry for entry in self._nodes_elsewhere() if not _holding_executor(entry)]

    def moved_nodes(self) -> list[str]:
        """Return the names of nodes that an executor holds which is not the session's."""
        return [entry.name for entry in self._nodes_elsewhere() if _holding_executor(entry)]

    def take_back_stolen(self) -> list[str]:
        """Spin nodes again that were `find_stolen`; return their names."""
        stolen = self.find_stolen()
        for entry in stolen:
            entry.executor.add_node(entry.node)
        return [entry.name for entry in stolen]

    # Inside.

    def _make_node(
        self, factory: Factory, args: tuple[Any, ...], kwargs: dict[str, Any], key: Hashable
    ) -> Node:
        # Weakly: what the constructor raises is kept, and with it what this frame refers to.
        before = weakref.WeakSet(threading.enumerate())
        try:
            with as_default_context(self._context), hearing_constructors():
                node = factory(*args, **kwargs)
        except BaseException as error:
            with suppress(Exception):  # rclpy's own error, of a name that cannot be, say, is enough
                name_conflicts.explain_conflict(error)
            with suppress(Exception):
                for name in self.half_made.note_failure(error, factory, key, self._is_news(before)):
                    self._made_by[name] = factory
            if missing := explain_uninitialised(error):
                raise SessionError(missing) from None
            raise
        if not isinstance(node, Node):
            name = getattr(factory, "__qualname__", repr(factory))
            raise SessionError(
                "run() needs a Node class, or a function that returns a node; "
                f"{name} returned {type(node).__name__}."
            )
        if is_uninitialised(node):
            raise SessionError(describe_missing_init(type(node)))
        return node

    def _is_news(self, before: Container[threading.Thread]) -> Callable[[threading.Thread], bool]:
        """Return a function that tells whether a thread is a learner's and was not there before."""
        return lambda thread: thread not in before and not self._pool.has_thread(thread)

    def _nodes_elsewhere(self) -> list[RegisteredNode]:
        """Return the nodes that should be spinning and are not in the executor they belong to."""
        return [
            entry
            for entry in self.list_nodes()
            if not (entry.paused or entry.executor.has_ended)
            and _holding_executor(entry) is not entry.executor
        ]

    def _brought_along(self, entry: RegisteredNode) -> list[Node]:
        """Return the nodes that a node brought to its executor, and that no session was given."""
        with self._lock:
            return [
                node for node in entry.executor.brought_by(entry.node) if node not in self._entries
            ]

    def _forget_entry(self, node: Node) -> RegisteredNode | None:
        with self._lock:
            entry = self._entries.pop(node, None)
        if entry is not None:
            self.stopped.add(node)
        return entry

    def _give_up_callbacks(self, entry: RegisteredNode) -> LingeringCallbacks:
        """Stop spinning a node, and go on without those of its callbacks that do not end soon."""
        return LingeringCallbacks(entry.executor, self._take_out(entry.executor, entry.node))

    def _tell_who_goes_on(
        self, entry: RegisteredNode, lingering: LingeringCallbacks, grace_s: float = 0.0
    ) -> None:
        for sentence in lingering.describe_after(grace_s, entry.name, self._pulse):
            self._tell(sentence)

    def _take_out(self, executor: BackgroundExecutor, node: Node) -> list[CallbackRun]:
        """Stop spinning a node; return its callbacks that have not ended after some time."""
        with executor.hold_still():
            executor.remove_node(node)
        if (job := current_job()) is None or job.node is not node:
            poll_condition(lambda: not executor.running_of(node), _CALLBACK_GRACE_S, self._pulse)
        return [job for job in executor.running_of(node) if job.thread_id]

    def _require_seen(self, name: str, entries: list[RegisteredNode]) -> None:
        with self._lock:
            seen = any(is_name(known, name) for known in self._made_by)
        if not seen:
            running = ", ".join(sorted(entry.name for entry in entries)) or "none"
            raise SessionError(f"No node {name!r} ran in this session; running now: {running}.")


def _holding_executor(entry: RegisteredNode) -> Executor | None:
    """Return the executor that has the node, whose wish it is or not."""
    executor = entry.node.executor
    return executor if executor is not None and entry.node in executor.get_nodes() else None


def _is_match(entry: RegisteredNode | Remains, what: Any) -> bool:
    if isinstance(what, str):
        return is_name(entry.name, what)
    if isinstance(what, Node):
        return entry.node is what
    return _is_same_factory(entry.factory, what)


def _is_same_factory(factory: object, other: object) -> bool:
    # A class defined again in a cell is another object of the same name.
    path = _factory_path(other)
    return factory is other or (path is not None and path == _factory_path(factory))


def _factory_path(factory: object) -> tuple[str, str] | None:
    factory = getattr(factory, "func", factory)
    module, name = getattr(factory, "__module__", None), getattr(factory, "__qualname__", None)
    # Every lambda has the same name: it says nothing about the node that it makes.
    return (module, name) if module and name and "<lambda>" not in name else None


def _make_key(factory: object, args: tuple[Any, ...], kwargs: dict[str, Any]) -> Hashable:
    if isinstance(factory, functools.partial):
        args, kwargs = (*factory.args, *args), {**factory.keywords, **kwargs}
    if isinstance(factory, Node) or (path := _factory_path(factory)) is None:
        return None
    return (path, repr(args), repr(sorted(kwargs.items())))
