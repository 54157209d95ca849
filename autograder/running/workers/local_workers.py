"""Where jobs run: workers take them, and what came of each waits in a queue for the engine."""

from __future__ import annotations

import os
import queue
import signal
import threading
from collections.abc import Iterable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, Self

from autograder import sandbox
from autograder.running import grading_jobs
from autograder.running.grading_jobs import GradingJob, JobResult
from autograder.sandbox import prefork

TICK_S = 1.0
"""Seconds after which a wait looks whether the workers are still there."""

STOP_TIMEOUT_S = 10.0
"""Seconds in which running jobs must have ended once their processes are killed."""


@dataclass(frozen=True)
class Done:
    """What came of the job called ``key``: a result, or the error that kept it from running."""

    key: str
    result: JobResult | None = None
    error: BaseException | None = None


class Workers(Protocol):
    """What the engine needs of its workers. Leaving the block ends what still runs."""

    @property
    def modes(self) -> tuple[str, ...]:
        """The modes in which jobs may be run (see `Abilities.mode_name`), the best one first."""

    def job_capacity(self) -> int:
        """Return how many jobs may be in their hands, so that none of them has to wait for one."""

    def submit(self, key: str, job: GradingJob) -> None:
        """Hand over a job."""

    def wait(self) -> list[Done]:
        """Return what is done; waits for the first, but at most `TICK_S` s, or until `wake`."""

    def wake(self) -> None:
        """End a wait: may be called in a signal handler."""

    def __enter__(self) -> Self:
        """Return itself."""

    def __exit__(self, *_: object) -> None:
        """End what still runs, and forget about it."""


class Keep(Protocol):
    """Keeps a result."""

    def __call__(self, job: GradingJob, result: JobResult) -> None:
        """Keep what came of ``job``; raises StoreError if it cannot."""


class Queue:
    """Done jobs on their way to the engine."""

    def __init__(self) -> None:
        """Start empty."""
        # The one kind of queue that a signal handler may put into.
        self._done: queue.SimpleQueue[Done | None] = queue.SimpleQueue()

    def put(self, done: Done) -> None:
        """Add one."""
        self._done.put(done)

    def wake(self) -> None:
        """End a `wait`."""
        self._done.put(None)

    def wait(self) -> list[Done]:
        """Return all that are there, waiting at most `TICK_S` s for the first."""
        found = []
        with suppress(queue.Empty):
            found.append(self._done.get(timeout=TICK_S))
            while True:
                found.append(self._done.get_nowait())
        return [done for done in found if done is not None]


class LocalWorkers:
    """Threads of this process: each sees one job through, and mostly waits."""

    def __init__(self, count: int, keep: Keep, *, trust: bool, hidden: Iterable[Path]) -> None:
        """Run ``count`` jobs at a time.

        Args:
            count: how many.
            keep: is told each result at once, so that a kill loses none that is there.
            trust: run submissions outside of a sandbox.
            hidden: folders that they must not see.
        """
        self._count = count
        self._keep = keep
        self._hidden = tuple(hidden)
        self._queue = Queue()
        self._stopping = threading.Event()
        self._threads: list[int] = []
        self._running: set[Future[None]] = set()
        self._pool = ThreadPoolExecutor(count, "grading", self._note_thread)
        self.modes = (sandbox.abilities().mode_name(trust=trust),)
        self.wake = self._queue.wake
        self.wait = self._queue.wait

    def job_capacity(self) -> int:
        """Return how many jobs may be here: some wait, so that no thread does."""
        return 2 * self._count + 2

    def submit(self, key: str, job: GradingJob) -> None:
        """Queue a job."""
        future = self._pool.submit(self._run_job, key, job)
        self._running.add(future)
        future.add_done_callback(self._running.discard)

    def _run_job(self, key: str, job: GradingJob) -> None:
        try:
            result = grading_jobs.run(job, self._hidden)
            # What is killed in the middle must not look like a submission that died.
            if not self._stopping.is_set():
                self._keep(job, result)
                self._queue.put(Done(key, result))
        except BaseException as error:  # noqa: BLE001 - the engine decides what it means
            self._queue.put(Done(key, error=error))

    def _note_thread(self) -> None:
        self._threads.append(threading.get_native_id())

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Kill what still runs, so that nobody waits for it."""
        self._stopping.set()
        self._pool.shutdown(wait=False, cancel_futures=True)
        rounds = int(STOP_TIMEOUT_S / 0.1)
        while rounds and self._running:
            for process in self._child_processes():
                with suppress(ProcessLookupError):
                    os.kill(process, signal.SIGKILL)
            prefork.shared.kill_forked()
            wait(set(self._running), timeout=0.1)
            rounds -= 1

    def _child_processes(self) -> list[int]:
        """Return the processes that the threads have started, but for the zygotes."""
        found: list[int] = []
        for thread in self._threads:
            with suppress(OSError):
                children = Path(f"/proc/self/task/{thread}/children").read_text()
                found += map(int, children.split())
        return [process for process in found if process not in prefork.shared.started_pids]
