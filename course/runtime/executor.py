"""An rclpy executor that spins in the background and that others can hold still for a moment."""

# mypy: allow-untyped-calls

from __future__ import annotations

import contextlib
import queue
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
from course.runtime.jobs import Job, Report, attributed, current_job, watched

_GATE_TIMEOUT = 5.0  # s; waking an executor takes microseconds, so this bounds what cannot happen


class BackgroundExecutor(Executor):
    """Runs callbacks in one thread of its own, or in a pool of `threads`.

    It is an executor as rclpy documents one: it overrides public methods only. What it adds:
    a raising callback is reported and spinning goes on; `held()` keeps it from waiting on its nodes
    while they are removed or destroyed, which rclpy answers with InvalidHandle otherwise.

    All its threads are daemons: a callback that never returns must not keep a process alive.
    """

    def __init__(
        self, context: Context, threads: int, report: Report, name: str, session_key: object
    ) -> None:
        """Make an executor; `start` makes it spin. `report` hears of each job that ended."""
        super().__init__(context=context)
        self.threads = threads
        self.session_key = session_key
        self.running: set[Job] = set()
        self._in_hand: dict[Task, Job] = {}
        self._crowded = False  # True while the spinning thread waits for a worker
        self._scheduled: weakref.WeakSet[Task] = weakref.WeakSet()
        self._report = report
        self._gate = threading.Condition()
        self._holds = 0
        self._waiting = False  # True while rclpy looks at, or waits on, the nodes' entities
        self._stale = False  # True if nodes may have changed under a suspended wait
        self._stopping = False
        self._interrupted = self._new_condition()
        self._round = _fresh_false()
        self._jobs: queue.SimpleQueue[Job | None] | None = None
        self._threads = [threading.Thread(target=self._loop, name=f"{name} spin", daemon=True)]
        if threads > 1:
            self._jobs = queue.SimpleQueue()
            self._threads += [
                threading.Thread(target=self._work, name=f"{name} worker {n + 1}", daemon=True)
                for n in range(threads)
            ]

    def start(self) -> None:
        """Start spinning in the background."""
        for thread in self._threads:
            thread.start()

    def stop(self, deadline: float) -> list[threading.Thread]:
        """Stop spinning; return the threads that still run a callback at `deadline` (monotonic)."""
        self._stopping = True
        with self._gate:
            self._gate.notify_all()
        self.wake()
        if self._jobs is not None:
            for _ in range(self.threads):
                self._jobs.put(None)
        for thread in self._threads:
            thread.join(max(0.0, deadline - time.monotonic()))
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
        with self._gate:
            self._holds += 1
            self._stale = True
        self.wake()
        try:
            with self._gate:
                self._gate.wait_for(lambda: not self._waiting, _GATE_TIMEOUT)
            yield
        finally:
            with self._gate:
                self._holds -= 1
                self._gate.notify_all()

    def run_ready(self) -> bool:
        """Run one round of what is ready, and return whether there was anything.

        To be called while `held`. Without workers the callbacks run in the calling thread.
        """
        if self._jobs is None and self.running:
            return False  # one thread, and a callback that blocks: the others wait for it
        busy = False
        while True:
            if self._stale:  # a callback removed a node under this round
                self._round, self._stale = _fresh_false(), False
            try:
                ready: Any = super().wait_for_ready_callbacks(0.0, None, self._round)
            except (TimeoutException, ShutdownException):
                return busy
            if ready[0] in self._in_hand:
                return busy  # no worker is free: nothing else can begin either
            busy = True
            self._execute(self._job(*ready))

    def busy_since(self, moment: float) -> bool:
        """Return whether callbacks run that were taken up after `moment` (monotonic, s)."""
        return any(job.since > moment for job in self.running.copy())

    def wait_for_a_job(self, timeout: float) -> None:
        """Return when a running callback has ended, or after `timeout` s; while `held`."""
        with self._gate:
            self._gate.wait(timeout)

    def is_running(self, node: Node) -> bool:
        """Return whether a callback of `node` runs, or is about to, in another thread than this."""
        me = threading.get_ident()
        return any(job.node is node and job.thread_id != me for job in self.running.copy())

    # What rclpy's own executors override.

    def wait_for_ready_callbacks(self, *args: Any, **kwargs: Any) -> tuple[Any, Any, Any]:
        """Return the next job, its entity and its node; the arguments are rclpy's."""
        self._waiting = True  # before looking at _holds: held() does it the other way round
        try:
            if self._holds or self._stale or self._stopping:
                self._let_others_in()
            timeout = args[0] if args else kwargs.get("timeout_sec")
            # Equal arguments resume rclpy's suspended wait; a new condition starts a fresh one.
            while True:
                ready: Any = super().wait_for_ready_callbacks(timeout, None, self._interrupted)
                # rclpy offers a task again and again until a worker has begun it.
                if (job := self._in_hand.get(ready[0])) is None:
                    return self._job(*ready), *ready[1:]
                self._wait_for_start(job)
        finally:
            self._waiting = False
            if self._holds:
                with self._gate:
                    self._gate.notify_all()

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Wait for one callback and run it, or hand it to a worker."""
        try:
            job, _, _ = self.wait_for_ready_callbacks(timeout_sec)
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

    def _new_condition(self) -> Callable[[], bool]:
        return lambda: bool(self._holds or self._stopping)

    def _job(self, task: Any, entity: Any, node: Any) -> Job:
        job = Job(task, entity, node, self, self._finished)
        self.running.add(job)
        return job

    def _execute(self, job: Job) -> None:
        if self._jobs is None:
            self._run(job)
        else:
            self._in_hand[job.task] = job
            self._jobs.put(job)

    def _let_others_in(self) -> None:
        with self._gate:
            self._waiting = False
            self._gate.notify_all()
            self._gate.wait_for(lambda: not self._holds or self._stopping)
            if self._stopping:
                raise ShutdownException
            self._interrupted = self._new_condition()
            self._stale = False
            self._waiting = True

    def _loop(self) -> None:
        while not self._stopping:
            try:
                self.spin_once()
            except ExternalShutdownException:
                return
            except InvalidHandle:
                self._drop_destroyed_nodes()

    def _work(self) -> None:
        assert self._jobs is not None
        while (job := self._jobs.get()) is not None:
            if self._stopping:
                self._jobs.put(job)  # `stop` drops it
                return
            self._run(job)

    def _run(self, job: Job) -> None:
        job.thread_id = threading.get_ident()
        if self._crowded:
            with self._gate:
                self._gate.notify_all()
        streams.install()
        job()
        self._in_hand.pop(job.task, None)
        if job.unfinished:
            streams.finish_lines(job)

    def _wait_for_start(self, job: Job) -> None:
        """Return when a worker has begun `job`; there is nothing better to do until then."""
        with self._gate:
            self._crowded = True
            self._gate.wait_for(
                lambda: job.thread_id or self._holds or self._stopping, _GATE_TIMEOUT
            )
            self._crowded = False

    def _drop_what_never_began(self) -> None:
        # A coroutine that never began would complain on stderr.
        tasks = list(self._scheduled)
        if self._jobs is not None:
            with contextlib.suppress(queue.Empty):
                while True:
                    if (job := self._jobs.get_nowait()) is not None:
                        self.running.discard(job)
                        tasks.append(job.task)
        for task in tasks:
            task.cancel()

    def _finished(self, job: Job, failure: BaseException | None) -> None:
        self.running.discard(job)
        self._report(job, failure)
        if self._holds:
            with self._gate:
                self._gate.notify_all()

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
