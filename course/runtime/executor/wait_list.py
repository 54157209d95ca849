"""What of an executor's nodes is ready to run: rclpy's wait, at half of its cost.

For each wait rclpy gathers again what the nodes wait on. There are several waits a message, and
there is much to gather: a node has services of its own, and each publisher and subscription has an
event handler. That takes longer than most callbacks (https://github.com/ros2/rclpy/issues/1223).
Here it is kept until something is created or destroyed, and where messages come fast, not every
wait is for what people ask now and then, too: news of profiles that do not fit, and parameters. The
order of what is ready is rclpy's.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, nullcontext
from typing import Any, NamedTuple

from rclpy.callback_groups import (
    CallbackGroup,
    MutuallyExclusiveCallbackGroup,
    ReentrantCallbackGroup,
)
from rclpy.event_handler import (
    EventHandler,
    QoSPublisherEventType,
    QoSSubscriptionEventType,
)
from rclpy.exceptions import InvalidHandle
from rclpy.executors import (
    ConditionReachedException,
    Executor,
    ExternalShutdownException,
    ShutdownException,
    TimeoutException,
)
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.node import Node
from rclpy.task import Task
from rclpy.waitable import NumberOfEntities

Ready = tuple[Task, Any, Any]
"""A task to run, the entity whose callback it is, and that entity's node, if there are these."""

SELDOM_S = 0.05
"""Seconds between two waits for profiles or types that do not fit, which is for people to read, and
for requests that concern parameters."""

ASKED_S = 0.5
"""Seconds for which each wait is for all, once somebody has asked about parameters: who sets one
asks several times in a row, and would wait that long each time."""

_NEWS = (
    QoSPublisherEventType.RCL_PUBLISHER_OFFERED_INCOMPATIBLE_QOS,
    QoSPublisherEventType.RCL_PUBLISHER_INCOMPATIBLE_TYPE,
    QoSSubscriptionEventType.RCL_SUBSCRIPTION_REQUESTED_INCOMPATIBLE_QOS,
    QoSSubscriptionEventType.RCL_SUBSCRIPTION_INCOMPATIBLE_TYPE,
)
"""What rclpy has each publisher and subscription listen to."""

_PARAMETERS = "rcl_interfaces.srv."
"""What the modules of the services' types begin with that rclpy gives each node: six of them, whose
names begin with the node's own. Others may serve one of these types, too."""

_KINDS = ("timer", "subscription", "guard_condition", "client", "service")
"""What a wait set calls its entities, in the order in which they run."""

_ALIKE = (MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup)
"""Groups that say the same of each of their callbacks."""


class Owned(NamedTuple):
    """Something to wait on, its node, and its kind."""

    entity: Any
    node: Node
    kind: str

    def may_begin(self) -> bool:
        """Return whether its callback may still begin, after those that came before it."""
        if not any(self.entity is other for other in _entities_of(self.node, self.kind)):
            return False  # destroyed since
        if self.kind == "timer" and not self.entity.handle.is_timer_ready():
            return False  # cancelled since
        return bool(self.entity.callback_group.can_execute(self.entity))


class WaitList:
    """What an executor waits on.

    Attributes:
        changed: whether something was created or destroyed since it was made; for others to set.
    """

    def __init__(
        self, executor: Executor, wake: Callable[[], None], *, keeps: bool = False
    ) -> None:
        """Keep the list of an executor.

        Args:
            executor: whose.
            wake: ends its wait when a callback has been begun, or has ended, in another thread.
            keeps: what is destroyed goes only with the next wait, and not at once if nobody waits.
                Each wait costs a third less.
        """
        self._executor = executor
        self._wake = wake
        self._keeps, self._kept = keeps, ExitStack()
        self.changed = True
        self._nodes: Sequence[Node] = ()
        self._groups: dict[CallbackGroup, Any] = {}  # with one entity of each
        self._all = self._often = _Wait((), ())
        self._seldom_due = self._asked_until = 0.0

    def ready_tasks(
        self, timeout: float | None, nodes: Sequence[Node] | None, condition: Callable[[], bool]
    ) -> Generator[Ready, None, None]:
        """Yield what is ready to run, as rclpy's own wait does: at least one, and then no more.

        Args:
            timeout: seconds to wait; for ever if negative or None.
            nodes: to wait on; all of the executor's if None.
            condition: ends the wait when it is true.

        Raises:
            TimeoutException: nothing became ready in time.
            ConditionReachedException: the condition is true.
            ShutdownException: the executor was shut down.
            ExternalShutdownException: its context was.
        """
        executor = self._executor
        take = {
            "waitable": executor._take_waitable, "timer": executor._take_timer,
            "subscription": executor._take_subscription, "client": executor._take_client,
            "guard_condition": executor._take_guard_condition, "service": executor._take_service,
        }  # fmt: skip
        limit = -1.0 if timeout is None else timeout
        deadline = time.monotonic() + limit
        found = False
        while not found and not executor._is_shutdown and not condition():
            looked_at = executor.get_nodes() if nodes is None else nodes
            for begun in self._begun_tasks(looked_at):
                found = True
                yield begun
            ready = self.wait(looked_at, limit)
            if limit > 0:
                limit = max(0.0, deadline - time.monotonic())
            over = limit == 0
            for owned in ready:
                if owned.may_begin():
                    found = True
                    entity, node, kind = owned
                    yield self._make_task(entity, node, take[kind]), entity, node
            if over:
                raise TimeoutException
        if executor._is_shutdown:
            raise ShutdownException
        if condition():
            raise ConditionReachedException

    def clear(self) -> None:
        """Let go of everything: nobody waits any more."""
        self.changed, self._nodes, self._groups = True, (), {}
        self._kept.close()
        self._all = self._often = _Wait((), ())

    def _begun_tasks(self, nodes: Sequence[Node]) -> Iterator[Ready]:
        """Yield the tasks that go on: coroutines, and those that no worker has come to."""
        executor = self._executor
        if not executor._tasks:
            return
        with executor._tasks_lock:
            tasks = list(executor._tasks)
        for task, entity, node in reversed(tasks):
            if not task.executing() and not task.done() and (node is None or node in nodes):
                yield task, entity, node
        with executor._tasks_lock:
            executor._tasks = [
                entry for entry in executor._tasks if not (entry[0].done() or entry[0].cancelled())
            ]

    def wait(self, nodes: Sequence[Node], timeout: float) -> list[Owned]:
        """Return what is ready, after ``timeout`` s at most (for ever if it is negative).

        Raises:
            ShutdownException: the executor was shut down.
            ExternalShutdownException: its context was.
        """
        if self.changed or nodes != self._nodes:
            self.changed = False  # first: what is created from now on changes it again
            self._kept.close()
            self._gather_entities(nodes)
            if self._keeps:
                self._kept.enter_context(self._all.keep_entities())
        left = self._seldom_due - time.monotonic()
        if not self._may_begin_all():
            said: dict[CallbackGroup, bool] = {}
            wait = _Wait(
                [each for each in self._all.owned if _may_begin(each.entity, said)], self._all.own
            )
        elif left > 0 and timeout != 0 and self._often is not self._all:
            wait = self._often
            timeout = left if timeout < 0 else min(left, timeout)
        else:
            wait = self._all
        with nullcontext() if self._keeps else wait.keep_entities():
            wait.misses = wait.misses or self._all.misses
            ready = [] if wait.misses else wait.wait_for_ready(self._executor, timeout)
        if wait is not self._often:
            now = time.monotonic()
            if any(each.kind == "service" and _is_seldom(each) for each in ready):
                self._asked_until = now + ASKED_S
            if now >= self._asked_until:
                self._seldom_due = now + SELDOM_S
        if wait.misses:  # something was destroyed just now
            self.changed = True
        return ready

    def _gather_entities(self, nodes: Sequence[Node]) -> None:
        self._nodes = list(nodes)
        owned = [
            Owned(entity, node, kind)
            for kinds in (("waitable",), _KINDS)
            for node in nodes
            for kind in kinds
            for entity in _entities_of(node, kind)
        ]
        executor = self._executor
        own = executor._guard.handle, executor._sigint_gc.handle
        self._groups = {each.entity.callback_group: each.entity for each in owned}
        self._all = _Wait(owned, own)
        rest = [each for each in owned if not _is_seldom(each)]
        # Without such entities there is no need to wake up and look for them.
        self._often = self._all if len(rest) == len(owned) else _Wait(rest, own)

    def _may_begin_all(self) -> bool:
        """Return whether every callback may begin, as is mostly so."""
        return not self._executor._tasks and all(
            type(group) in _ALIKE and group.can_execute(entity)
            for group, entity in self._groups.items()
        )

    def _make_task(self, entity: Any, node: Node, take: Callable[[Any], Any]) -> Task:
        entity._executor_event = True  # not to be waited on until it is taken
        arguments = (entity, take, self._executor, self._wake)
        task = Task(_run_callback, arguments, executor=self._executor)
        with self._executor._tasks_lock:
            self._executor._tasks.append((task, entity, node))
        return task


async def _run_callback(
    entity: Any, take: Callable[[Any], Any], executor: Executor, wake: Callable[[], None]
) -> None:
    """Run a callback as rclpy does; but if there is nothing to take, its group is free again.

    With rclpy no callback of a mutually exclusive group would ever run again, after a timer that a
    cell cancels just as it fires, say, or a message that is none.
    """
    group = entity.callback_group
    if executor._is_shutdown or not group.beginning_execution(entity):
        entity._executor_event = False
        wake()
        return
    with executor._work_tracker:
        try:
            try:
                call = take(entity)
            finally:
                entity._executor_event = False
                wake()
            if call is not None:
                await call()
        finally:
            group.ending_execution(entity)
            wake()


def _may_begin(entity: Any, said: dict[CallbackGroup, bool]) -> bool:
    """Return whether a callback may begin; ``said`` is what its group has said of others."""
    if entity._executor_event:
        return False
    group = entity.callback_group
    if group not in said or type(group) not in _ALIKE:
        said[group] = bool(group.can_execute(entity))
    return said[group]


def _is_seldom(owned: Owned) -> bool:
    """Return whether to hear of something a moment later makes no difference to anybody."""
    entity = owned.entity
    if owned.kind == "service":
        own = entity.service_name.startswith(f"{owned.node.get_fully_qualified_name()}/")
        return own and str(getattr(entity.srv_type, "__module__", "")).startswith(_PARAMETERS)
    # By identity: an event of a publisher equals the one of a subscription with the same number.
    return isinstance(entity, EventHandler) and any(entity.event_type is kind for kind in _NEWS)


def _entities_of(node: Node, kind: str) -> Iterable[Any]:
    entities: Iterable[Any] = getattr(node, "guards" if kind == "guard_condition" else f"{kind}s")
    return entities


class _Wait:
    """A wait on some entities, as often as needed."""

    def __init__(self, owned: Sequence[Owned], own: Sequence[Any]) -> None:
        """Take entities, and the handles of the executor's own guards."""
        self.owned, self.own = owned, own
        self.misses = False  # one of them has been destroyed
        self._waitables: list[Owned] = []
        self._handles: dict[str, list[Any]] = {kind: [] for kind in _KINDS}
        self._place: dict[int, int] = {}  # of an entity among `owned`, by its handle's pointer
        for place, each in enumerate(owned):
            if each.kind == "waitable":
                self._waitables.append(each)
                continue
            try:
                self._place[each.entity.handle.pointer] = place
                self._handles[each.kind].append(each.entity.handle)
            except InvalidHandle:
                self.misses = True
        self._handles["guard_condition"] += own
        self._guards = [each.entity for each in owned if each.kind == "guard_condition"]
        # Of other waitables, each wait may need another number of places.
        self._is_of_one_size = all(isinstance(w.entity, EventHandler) for w in self._waitables)
        items = [each.entity for each in self._waitables]
        items += [handle for handles in self._handles.values() for handle in handles]
        self._use = [(item.__enter__, item.__exit__) for item in items]
        self._wait_set: Any = None

    @contextmanager
    def keep_entities(self) -> Iterator[None]:
        """Let nobody destroy the entities for the length of the block."""
        used = []
        try:
            for begin, end in self._use:
                begin()
                used.append(end)
        except InvalidHandle:
            self.misses = True
        try:
            yield
        finally:
            for end in used:
                end(None, None, None)

    def wait_for_ready(self, executor: Executor, timeout: float) -> list[Owned]:
        """Return what is ready, after ``timeout`` s at most (for ever if it is negative)."""
        for guard in self._guards:
            if guard._executor_triggered:
                guard.trigger()  # its callback has not begun since
        wait_set = self._wait_set or self._make_wait_set(executor)
        if self._is_of_one_size:
            self._wait_set = wait_set
        wait_set.clear_entities()
        for kind, handles in self._handles.items():
            if handles:
                add = getattr(wait_set, f"add_{kind}")
                for handle in handles:
                    add(handle)
        for each in self._waitables:
            each.entity.add_to_wait_set(wait_set)
        wait_set.wait(-1 if timeout < 0 else int(timeout * 1e9))
        if executor._is_shutdown:
            raise ShutdownException
        if not executor._context.ok():
            raise ExternalShutdownException
        ready = [each for each in self._waitables if each.entity.is_ready(wait_set)]
        places = []
        for kind, handles in self._handles.items():
            if handles:
                for pointer in wait_set.get_ready_entities(kind):
                    if (place := self._place.get(pointer)) is not None:
                        places.append(place)
                        if kind == "guard_condition":  # the wait takes what has triggered it
                            self.owned[place].entity._executor_triggered = True
        return ready + [self.owned[place] for place in sorted(places)]

    def _make_wait_set(self, executor: Executor) -> Any:
        count = {kind: len(found) for kind, found in self._handles.items()}
        number = NumberOfEntities(
            count["subscription"], count["guard_condition"], count["timer"], count["client"],
            count["service"],
        )  # fmt: skip
        for each in self._waitables:
            number += each.entity.get_num_entities()
        return _rclpy.WaitSet(
            number.num_subscriptions, number.num_guard_conditions, number.num_timers,
            number.num_clients, number.num_services, number.num_events, executor._context.handle,
        )  # fmt: skip
