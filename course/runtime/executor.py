"""An rclpy executor that spins in the background and that others can hold still for a moment."""

# mypy: allow-untyped-calls

from __future__ import annotations

import contextlib
import threading
import time
import weakref
from collections.abc import Callable, Iterator
from typing import Any

from rclpy.context import Context
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
from rclpy.waitable import Waitable

from course.runtime import streams
from course.runtime.gate import Gate
from course.runtime.jobs import Job, Report, attributed, current_job, watched
from course.runtime.waiting import Pulse
from course.runtime.workers import Workers, sleeps

_WAY_OUT = 5.0  # s; a woken thread needs microseconds to end, unless the machine is very busy


class BackgroundExecutor(Executor):
    """Runs callbacks in one thread of its own, or in a pool of `threads`.

    It is an executor as rclpy documents one: it overrides public methods only. What it adds:
    a raising callback is reported and spinning goes on; `held()` keeps it from waiting on its nodes
    while they are removed or destroyed, which rclpy answers with InvalidHandle otherwise.

    All its threads are daemons: a callback that never returns must not keep a process alive.
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
        self.threads = threads
        self.session_key = session_key
        self.running: set[Job] = set()
        self._scheduled: weakref.WeakSet[Task] = weakref.WeakSet()
        self._awaiting: weakref.WeakSet[Task] = weakref.WeakSet()
        self._returned = False
        self.report = report
        self._pulse = pulse
        self._gate = Gate(self.wake)
        self._interrupted = self._gate.new_interrupt()
        self._round = _fresh_false()
        self._workers = Workers(threads, self._run, name) if threads > 1 else None
        self._threads = [threading.Thread(target=self._loop, name=f"{name} spin", daemon=True)]
        if self._workers is not None:
            self._threads += self._workers.threads

    def start(self) -> None:
        """Start spinning in the background."""
        for thread in self._threads:
            thread.start()

    def request_stop(self) -> None:
        """Let every thread end after the callback that it runs; do not wait for it."""
        self._gate.stop()
        if self._workers is not None:
            self._workers.stop()

    def join(self, deadline: float) -> list[threading.Thread]:
        """Wait for the threads to end; return those that run a callback past `deadline`.

        Args:
            deadline: as of time.monotonic(), s. A thread outside callbacks is on its way out, and
                is waited for in any case: one that is still inside rclpy when the interpreter ends
                would abort the process.
        """
        for thread in self._threads:
            thread.join(max(0.0, deadline - time.monotonic()))
        busy = {job.thread_id for job in self.running.copy()}
        for thread in self._threads:
            if thread.ident not in busy:
                thread.join(_WAY_OUT)
        self._drop_what_never_began()
        return [thread for thread in self._threads if thread.is_alive()]

    def owns(self, thread: threading.Thread) -> bool:
        """Return whether `thread` is one of this executor's own."""
        return thread in self._threads

    @contextlib.contextmanager
    def held(self) -> Iterator[None]:
        """Keep the executor from waiting on its nodes: they can be removed or destroyed safely.

        Callbacks that already run are not waited for. May be called from a callback.
        """
        with self._gate.held():
            yield

    def run_ready(self) -> bool:
        """Run one round of what is ready, and return whether there was anything.

        To be called while `held`. Without workers the callbacks run in the calling thread. rclpy
        resumes a coroutine in every round, whatever it awaits: that alone is not anything.
        """
        if self._workers is None and self.running:
            return False  # the one thread has a callback to run, and the others wait for it
        busy, self._returned = self._returned, False
        while True:
            if self._gate.stale:  # a callback removed a node under this round
                self._round, self._gate.stale = _fresh_false(), False
            try:
                ready: Any = super().wait_for_ready_callbacks(0.0, None, self._round)
            except (TimeoutException, ShutdownException):
                return busy
            if self._workers is not None and self._workers.job_of(ready[0]) is not None:
                return busy  # no worker is free: nothing else can begin either
            busy = busy or ready[0] not in self._awaiting
            self._execute(self._job(*ready))

    @property
    def awaiting(self) -> int:
        """How many callbacks have begun, and await something."""
        return len(self._awaiting)

    def busy_since(self, moment: float) -> bool:
        """Return whether callbacks run that are neither done nor blocked.

        Args:
            moment: a callback taken up before it (monotonic, s) that sleeps counts as blocked. With
                one thread there is nobody to go on without it, so there it does not.
        """
        if self._workers is None:
            return bool(self.running)
        return any(
            job.since > moment or (job.thread_id and not sleeps(job.thread_id))
            for job in self.running.copy()
        )

    def wait_for_a_job(self, timeout: float) -> None:
        """Return when a running callback has ended, or after `timeout` s; while `held`."""
        self._gate.wait(timeout)

    def is_running(self, node: Node) -> bool:
        """Return whether a callback of `node` runs, or is about to, in another thread than this."""
        me = threading.get_ident()
        return any(job.node is node and job.thread_id != me for job in self.running.copy())

    # What rclpy's own executors override.

    def wait_for_ready_callbacks(self, *args: Any, **kwargs: Any) -> tuple[Any, Any, Any]:
        """Return the next job, its entity and its node; only the timeout matters."""
        job = self._next_job(args[0] if args else kwargs.get("timeout_sec"))
        return job, job.entity, job.node

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Wait for one callback and run it, or hand it to a worker."""
        try:
            job = self._next_job(timeout_sec)
        except (ShutdownException, TimeoutException, ConditionReachedException):
            return
        self._execute(job)

    def spin_once_until_future_complete(self, future: Future, timeout_sec: Any = None) -> None:
        """Run one callback; `future` wakes this executor when it is done."""
        future.add_done_callback(lambda _: self.wake())
        self.spin_once(getattr(timeout_sec, "timeout", timeout_sec))

    def create_task(self, callback: Any, *args: Any, **kwargs: Any) -> Task:
        """Schedule `callback`; it is attributed to the node that it belongs to."""
        owner = getattr(getattr(callback, "func", callback), "__self__", None)
        node = owner if isinstance(owner, Node) else None
        shown = callback
        if isinstance(owner, Waitable):  # an action server starts the execution of a goal
            node = next((n for n in self.get_nodes() if owner in n.waitables), None)
            shown = next((arg for arg in args if callable(arg)), callback)
            # rclpy swallows what an execute callback raises: hear of it before rclpy does.
            args = tuple(watched(arg) if arg is shown else arg for arg in args)
        elif node is None and (job := current_job()) is not None:
            node = job.node
        task = super().create_task(attributed(callback, node, shown), *args, **kwargs)
        self._scheduled.add(task)
        return task

    # Inside.

    def _next_job(self, timeout: Any) -> Job:
        try:
            if self._gate.enter():
                # Equal arguments resume rclpy's suspended wait; a new condition starts afresh.
                self._interrupted = self._gate.new_interrupt()
            while True:
                ready: Any = super().wait_for_ready_callbacks(timeout, None, self._interrupted)
                if self._workers is None or (job := self._workers.job_of(ready[0])) is None:
                    return self._job(*ready)
                # rclpy offers a task again and again until a worker has begun it.
                self._gate.watch(lambda begun=job: begun.thread_id)  # type: ignore[misc]
        finally:
            self._gate.leave()

    def _job(self, task: Any, entity: Any, node: Any) -> Job:
        job = Job(task, entity, node, self)
        self.running.add(job)
        return job

    def _execute(self, job: Job) -> None:
        if self._workers is None:
            self._run(job)
        else:
            self._workers.put(job)

    def _loop(self) -> None:
        while not self._gate.stopping:
            try:
                self.spin_once()
            except ExternalShutdownException:
                return
            except InvalidHandle:
                self._drop_destroyed_nodes()

    def _run(self, job: Job) -> None:
        job.thread_id = threading.get_ident()
        self._gate.notify_watchers()
        streams.install()
        failure = job()
        if not job.task.done():
            self._awaiting.add(job.task)
        elif job.task in self._awaiting:
            self._awaiting.discard(job.task)
            self._returned = True
        if job.unfinished is not None:
            streams.finish_lines(job)
        if failure is not None:
            self.report(job, failure)
        self.running.discard(job)
        self._pulse.beat()
        self._gate.notify_watchers()

    def _drop_what_never_began(self) -> None:
        # A coroutine that never began would complain on stderr.
        tasks = list(self._scheduled)
        if self._workers is not None:
            never_begun = self._workers.never_begun()
            self.running.difference_update(never_begun)
            tasks += [job.task for job in never_begun]
        for task in tasks:
            if not task.executing():
                task.cancel()

    def _drop_destroyed_nodes(self) -> None:
        """Take out nodes destroyed behind our back: they make every wait fail."""
        for node in self.get_nodes():
            try:
                with node.handle:
                    pass
            except InvalidHandle:
                self.remove_node(node)


def _fresh_false() -> Callable[[], bool]:
    """Return a condition that is never true and equal to no other."""
    return lambda: False
