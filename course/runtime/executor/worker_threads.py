"""A pool of daemon threads that run jobs.

Not concurrent.futures: its threads are joined at interpreter exit, and a callback that never
returns would keep the process from ending.
"""

from __future__ import annotations

import contextlib
import queue
import threading
from collections.abc import Callable

from rclpy.task import Task

from course.runtime.callbacks.callback_runs import CallbackRun


class WorkerThreads:
    """Runs jobs in `count` threads, first come, first served."""

    def __init__(self, count: int, run: Callable[[CallbackRun], bool], name: str) -> None:
        """Make the pool; its threads, `threads`, are for the caller to start and to join.

        `run` runs a job, `end_job`s it, and returns whether its thread is to go on with the next.
        """
        self._run = run
        self._name = name
        self._queue: queue.SimpleQueue[CallbackRun | None] = queue.SimpleQueue()
        self._in_hand: dict[Task, CallbackRun] = {}
        self._stopping = False
        self.threads: list[threading.Thread] = []
        for _ in range(count):
            self.new_thread()

    def new_thread(self) -> threading.Thread:
        """Add a thread, in the place of one that is to end; the caller starts it."""
        name = f"{self._name} worker {len(self.threads) + 1}"
        self.threads.append(threading.Thread(target=self._run_jobs, name=name, daemon=True))
        return self.threads[-1]

    def put(self, job: CallbackRun) -> None:
        """Hand `job` to the next worker that is free."""
        self._in_hand[job.task] = job
        self._queue.put(job)

    def job_of(self, task: Task) -> CallbackRun | None:
        """Return the job that was put for `task` and has not ended, if there is one."""
        return self._in_hand.get(task)

    def end_job(self, job: CallbackRun) -> None:
        """Forget `job`: its task may be put again, if it is a coroutine that is not done."""
        self._in_hand.pop(job.task, None)

    def stop(self) -> None:
        """Let every worker end after the job that it runs."""
        self._stopping = True
        for _ in self.threads:
            self._queue.put(None)

    def never_begun(self) -> list[CallbackRun]:
        """Return the jobs that no worker has begun, once the workers have stopped."""
        jobs = []
        with contextlib.suppress(queue.Empty):
            while True:
                if (job := self._queue.get_nowait()) is not None:
                    jobs.append(job)
        return jobs

    def _run_jobs(self) -> None:
        # One whose callback went on for long may find a queue that `never_begun` has emptied.
        while not self._stopping and (job := self._queue.get()) is not None:
            if self._stopping:
                self._queue.put(job)  # for `never_begun`
                return
            if not self._run(job):
                return
