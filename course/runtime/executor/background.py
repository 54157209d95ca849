"""An rclpy executor that spins in the background and that others can hold still for a moment."""

from __future__ import annotations

import contextlib
import functools
import threading
import time
import weakref
from collections.abc import Callable, Generator, Iterator
from typing import Any

from rclpy.context import Context
from rclpy.event_handler import EventHandler
from rclpy.exceptions import InvalidHandle
from rclpy.executors import (
    ConditionReachedException,
    Executor,
    ExternalShutdownException,
    ShutdownException,
    TimeoutException,
)
from rclpy.node import Node
from rclpy.task import Future, Task

from course.runtime.callbacks.callback_runs import CallbackRun, Report
from course.runtime.callbacks.idleness import Idleness
from course.runtime.callbacks.node_owners import NodeOwners
from course.runtime.callbacks.tasks import CreatedTasks, find_owner
from course.runtime.executor.gate import Gate
from course.runtime.executor.threads import Threads
from course.runtime.executor.wait_list import Ready, WaitList
from course.runtime.executor.worker_threads import WorkerThreads
from course.runtime.output import callback_output
from course.runtime.rclpy_fixes import incompatible_qos_events
from course.runtime.rclpy_fixes.clock_sleep import sleeps_by_clock
from course.runtime.teardown import is_alive
from course.runtime.waiting import Pulse, poll_condition


def _never_true() -> bool:
    return False


def _do_nothing() -> None:
    """Wake nobody: the one thread has run the callback itself."""


def _has_entities(node: Node) -> bool:
    kinds = (
        node.subscriptions, node.timers, node.clients, node.services, node.guards, node.waitables,
    )  # fmt: skip
    return any(True for entities in kinds for _ in entities)


class BackgroundExecutor(Executor):
    """Runs callbacks in one thread of its own, or in a pool of `threads`.

    It is an executor as rclpy documents one: it overrides public methods only. What it adds:
    a raising callback is reported and spinning goes on; `hold_still()` keeps it from waiting on its
    nodes while they are removed or destroyed, which rclpy answers with InvalidHandle otherwise;
    `give_up` gets it going again when a callback never returns.

    Attributes:
        running: the callbacks that run, or wait for a free worker.
        given_up: those that ran too long, in threads that have been replaced.
        finished: how many callbacks have ended.
        endless: when (s, monotonic) callbacks were last found to follow each other without end.
    """

    def __init__(
        self,
        context: Context,
        threads: int,
        name: str,
        *,
        report: Report,
        pulse: Pulse,
        session_key: object,
    ) -> None:
        """Make an executor; `start` makes it spin.

        `report` hears of each callback that raised, `pulse` of each that ended.
        """
        super().__init__(context=context)
        self._wait_list = WaitList(self, super().wake if threads > 1 else _do_nothing)
        self.threads = threads
        self.session_key = session_key
        self.report = report
        self.running: set[CallbackRun] = set()
        self.given_up: set[CallbackRun] = set()
        self.pulse = pulse
        self.gate = Gate(self.wake)
        self.finished = 0
        self.endless = float("-inf")
        self._node_owners = NodeOwners()
        self._created = CreatedTasks()
        self._awaiting: weakref.WeakSet[Task] = weakref.WeakSet()
        self._has_awaited = False  # most programs never do, and looking at a weak set takes time
        self._returned = False  # a coroutine has ended since the last round
        self._newest_end = object()  # another one each time that a callback is done
        self._interrupted = self.gate.new_interrupt()
        self._round = _fresh_false()
        self._workers = WorkerThreads(threads, self._run_job, name) if threads > 1 else None
        self._threads = Threads(self._spin_loop, self._workers, name)

    def start(self) -> None:
        """Start spinning in the background."""
        self._threads.start()

    def request_stop(self) -> None:
        """Let every thread end after the callback that it runs; do not wait for it."""
        self.gate.stop()
        if self._workers is not None:
            self._workers.stop()

    def join(self, deadline: float) -> list[threading.Thread]:
        """Wait for the threads to end; return those that run a callback past `deadline`.

        See `Threads.join`. A thread that was given up is not waited for.
        """
        left = self._threads.join(deadline, self.running, self.given_up)
        self._wait_list.clear()
        self._drop_what_never_began()
        return left

    def has_thread(self, thread: threading.Thread) -> bool:
        """Return whether `thread` is one of this executor's own."""
        return self._threads.has_thread(thread)

    @property
    def has_ended(self) -> bool:
        """Whether it has stopped for good."""
        return self.gate.stopping

    @contextlib.contextmanager
    def hold_still(self) -> Iterator[None]:
        """Keep the executor from waiting on its nodes: they can be removed or destroyed safely.

        Callbacks that already run are not waited for. May be called from a callback.
        """
        with self.gate.hold_closed():
            yield

    def run_ready(self) -> bool:
        """Run one round of what is ready, and return whether there was anything.

        To be called while `hold_still`. Without workers the callbacks run in the calling thread.
        rclpy resumes a coroutine in every round, whatever it awaits: that alone is not anything.
        """
        if self._workers is None and self.running:
            return False  # the one thread has a callback to run, and the others wait for it
        busy, self._returned = self._returned, False
        if not self._may_be_ready():
            return busy
        while True:
            if self.gate.stale:  # a callback removed a node under this round
                self._round, self.gate.stale = _fresh_false(), False
            try:
                ready: Any = super().wait_for_ready_callbacks(0.0, None, self._round)
            except (TimeoutException, ShutdownException):
                return busy
            if self._workers is not None and self._workers.job_of(ready[0]) is not None:
                return busy  # no worker is free: nothing else can begin either
            busy = busy or ready[0] not in self._awaiting
            self._execute_job(self._make_job(*ready))

    @property
    def awaiting_count(self) -> int:
        """How many callbacks have begun, and await something."""
        return len(self._awaiting)

    def working_jobs(self) -> set[CallbackRun]:
        """Return the callbacks that run and are neither done nor blocked; look once at each.

        With one thread there is nobody to go on without a blocked callback, so there it counts,
        too. Call it in a row, with `wait_for_a_job` in between: see `Idleness`.
        """
        running = self.running.copy()
        if self._workers is None:
            return running
        begun = {job for job in running if job.thread_id}
        if len(begun) < len(running) and len({job.thread_id for job in begun}) < self.threads:
            return running - begun  # a worker is free, and has not come to it yet
        return {job for job in begun if not self._is_blocked(job)}  # each is looked at

    def is_resuming(self, job: CallbackRun) -> bool:
        """Return whether a callback that runs has begun before, and awaited something."""
        return job.task in self._awaiting

    @staticmethod
    def _is_blocked(job: CallbackRun) -> bool:
        if sleeps_by_clock(job):
            return True
        if job.idleness is None:
            job.idleness = Idleness(job.thread_id)
        return job.idleness.is_blocked()

    def wait_for_a_job(self, timeout: float) -> None:
        """Return when a running callback has ended, or after `timeout` s; while `hold_still`."""
        self.gate.wait(timeout)

    def runs_elsewhere(self) -> bool:
        """Return whether a callback runs, or is about to, in another thread than this."""
        me = threading.get_ident()
        return any(job.thread_id != me for job in self.running.copy())

    def running_of(self, node: Node) -> list[CallbackRun]:
        """Return callbacks of `node` that run, or are about to, in another thread than this."""
        me = threading.get_ident()
        return [job for job in self.running.copy() if job.node is node and job.thread_id != me]

    def give_up(self, job: CallbackRun) -> bool:
        """Go on without the thread that runs `job`, whose callback does not return.

        A new thread takes its place; the old one ends when its callback does. Return whether that
        was needed: the job may have ended just now.
        """
        with self.hold_still():
            try:
                # Either `_run_job` or this method removes a job, and so decides what its thread
                # does next.
                self.running.remove(job)
            except KeyError:
                return False
            self.given_up.add(job)
            for outer in self.running.copy():  # a callback that spun, and ran this one in between
                if outer.thread_id == job.thread_id:
                    self.running.discard(outer)
                    self.given_up.add(outer)
            self._threads.replace_busy()
        return True

    def brought_by(self, node: Node) -> list[Node]:
        """Return the nodes of this executor that `node` brought along, directly or not."""
        return self._node_owners.brought_by(node, self.get_nodes())

    # What rclpy's own executors override.

    def wake(self) -> None:
        """Wait again: something was created or destroyed, or has changed in another way."""
        self._wait_list.changed = True
        super().wake()

    def add_node(self, node: Node) -> bool:
        """Add a node; one that a callback of another node adds belongs to that node."""
        with self._node_owners.note_arrival(node):
            return bool(super().add_node(node))

    def wait_for_ready_callbacks(self, *args: Any, **kwargs: Any) -> tuple[Any, Any, Any]:
        """Return the next job, its entity and its node; only the timeout matters."""
        job = self._next_job(args[0] if args else kwargs.get("timeout_sec"))
        return job, job.entity, job.node

    def _wait_for_ready_callbacks(
        self,
        timeout_sec: Any = None,
        nodes: list[Node] | None = None,
        condition: Callable[[], bool] = _never_true,
    ) -> Generator[Ready, None, None]:
        timeout = getattr(timeout_sec, "timeout", timeout_sec)
        return self._wait_list.ready_tasks(timeout, nodes, condition)

    def create_task(self, callback: Any, *args: Any, **kwargs: Any) -> Task:
        """Schedule a function, a coroutine function or a coroutine, as every executor does."""
        owner, args = find_owner(callback, args, self.get_nodes())
        make = functools.partial(super().create_task, callback, *args, **kwargs)
        return self._created.create(make, owner)

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Return when one more callback has run, or after `timeout_sec` s (None: no limit).

        The executor spins by itself, so this only waits; except in a callback on the one thread
        that there is, which runs the next callback itself.
        """
        self._spin_once(timeout_sec, _never_true)

    def spin_once_until_future_complete(self, future: Future, timeout_sec: Any = None) -> None:
        """Do `spin_once`, or return when `future` is done."""
        future.add_done_callback(lambda _: self.wake())
        self._spin_once(getattr(timeout_sec, "timeout", timeout_sec), future.done)

    def shutdown(self, timeout_sec: float | None = None) -> bool:
        """Stop spinning; return whether every callback ended within `timeout_sec` s."""
        self.request_stop()
        forever = timeout_sec is None or timeout_sec < 0
        patience = threading.TIMEOUT_MAX if forever else timeout_sec
        inside = self.has_thread(
            threading.current_thread()
        )  # a callback cannot wait for its own end
        left = [] if inside else self.join(time.monotonic() + (patience or 0.0))
        return super().shutdown(timeout_sec=0.0) and not left

    # Inside.

    def _spin_once(self, timeout: float | None, done: Callable[[], bool]) -> None:
        if threading.current_thread() is self._threads.spinner and self._workers is None:
            with contextlib.suppress(ShutdownException, TimeoutException):
                self._run_job(self._next_job(timeout, done))
            return
        seen = self.finished
        limit = float("inf") if timeout is None or timeout < 0 else timeout
        poll_condition(lambda: done() or self.has_ended or self.finished != seen, limit, self.pulse)

    def _next_job(self, timeout: Any, done: Callable[[], bool] = _never_true) -> CallbackRun:
        try:
            if self.gate.enter():
                # Equal arguments resume rclpy's suspended wait; a new condition starts afresh.
                self._interrupted = self.gate.new_interrupt()
            interrupted = self._interrupted
            condition = interrupted if done is _never_true else lambda: interrupted() or done()
            while True:
                ready: Any = super().wait_for_ready_callbacks(timeout, None, condition)
                if self._workers is None or (job := self._workers.job_of(ready[0])) is None:
                    return self._make_job(*ready)
                # rclpy offers a task again and again until a worker has begun it.
                self.gate.wait_until(lambda begun=job: begun.thread_id)  # type: ignore[misc]
        except ConditionReachedException:
            raise ShutdownException from None  # nothing to run for now
        finally:
            self.gate.leave()

    def _may_be_ready(self) -> bool:
        """Return whether there is anything to wait on: to wait in order to see takes far longer."""
        return bool(self._tasks) or any(map(_has_entities, self.get_nodes()))

    def _make_job(self, task: Any, entity: Any, node: Any) -> CallbackRun:
        shown = None
        if entity is None:
            node, shown = self._created.owner_of(task)
        elif isinstance(entity, EventHandler):
            incompatible_qos_events.listen_to(entity)
        job = CallbackRun(task, entity, node, self, shown)
        self.running.add(job)
        return job

    def _execute_job(self, job: CallbackRun) -> None:
        if self._workers is None:
            self._run_job(job)
        else:
            self._workers.put(job)

    def _spin_loop(self) -> None:
        me, threads, gate = threading.current_thread(), self._threads, self.gate
        execute = self._run_job if self._workers is None else self._workers.put
        while threads.spinner is me and not gate.stopping:
            try:
                execute(self._next_job(None))
            except ShutdownException:
                continue
            except ExternalShutdownException:
                return
            except InvalidHandle:
                for node in self.get_nodes():  # one was destroyed behind our back
                    if not is_alive(node):
                        self.remove_node(node)
            except Exception as error:  # noqa: BLE001 - a waitable of the learner's, for instance
                if self.context.ok():  # else rclpy.shutdown() came in between
                    self.report(CallbackRun(Task(_never_true), None, None, self), error)
                self.request_stop()

    def _run_job(self, job: CallbackRun) -> bool:
        """Run a callback; return whether this thread is to go on with others."""
        job.thread_id = threading.get_ident()
        newest_end = self._newest_end
        self.gate.notify()
        callback_output.install_streams()
        failure = job()
        # rclpy resumes each coroutine once before it waits, and leaves out those that run at that
        # moment. What one awaits may be done just after that, and nothing else might ever wake it.
        if done := job.task.done():
            self._newest_end = object()  # before the look at who awaits: one of two sees the other
            if look_again := self._has_awaited and len(self._awaiting) > 0:
                self._returned = self._returned or job.task in self._awaiting
                self._awaiting.discard(job.task)
        else:
            self._has_awaited = True
            self._awaiting.add(job.task)
        if job.unfinished is not None:
            callback_output.finish_lines(job)
        if failure is not None:
            self.report(job, failure)
        if job.entity is None and (job.task.done() or job.task.cancelled()):
            self._created.forget(job.task)
        self.finished += 1
        try:
            self.running.remove(job)
            goes_on = True
        except KeyError:  # somebody has given this thread up
            self.given_up.discard(job)
            goes_on = False
        if self._workers is not None:
            self._workers.end_job(job)
        if look_again if done else self._newest_end is not newest_end:
            self.wake()
        self.pulse.beat()
        self.gate.notify()
        return goes_on

    def _drop_what_never_began(self) -> None:
        # A coroutine that never began would complain on stderr.
        tasks = self._created.unfinished_tasks()
        if self._workers is not None:
            never_begun = self._workers.never_begun()
            self.running.difference_update(never_begun)
            tasks += [job.task for job in never_begun]
        for task in tasks:
            if not task.executing():
                task.cancel()


def _fresh_false() -> Callable[[], bool]:
    """Return a condition that is never true and equal to no other."""
    return lambda: False
