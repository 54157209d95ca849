"""The threads of one executor: one that spins, and a pool of workers if there are several."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

from course.runtime.callbacks.callback_runs import CallbackRun
from course.runtime.executor.worker_threads import WorkerThreads

_JOIN_TIMEOUT_S = (
    5.0  # s; a woken thread needs microseconds to end, unless the machine is very busy
)


class Threads:
    """Starts, replaces and joins the threads of one executor.

    All are daemons: a callback that never returns must not keep a process alive.

    Attributes:
        spinner: the thread that waits on the nodes.
    """

    def __init__(self, spin: Callable[[], None], workers: WorkerThreads | None, name: str) -> None:
        """Make a thread that runs `spin`; those of `workers` are to be looked after as well."""
        self._spin = spin
        self._name = f"{name} spin"
        self._workers = workers
        self.spinner = self._new_spinner()
        self._all = [self.spinner, *(workers.threads if workers is not None else [])]

    def start(self) -> None:
        """Start them all."""
        for thread in self._all:
            thread.start()

    def has_thread(self, thread: threading.Thread) -> bool:
        """Return whether `thread` is or was one of these."""
        return thread in self._all

    def replace_busy(self) -> None:
        """Start one more in the place of one that runs callbacks and does not come back."""
        if self._workers is not None:
            thread = self._workers.new_thread()
        else:
            thread = self.spinner = self._new_spinner()
        self._all.append(thread)
        thread.start()

    def join(
        self, deadline: float, running: set[CallbackRun], given_up: set[CallbackRun]
    ) -> list[threading.Thread]:
        """Wait for the threads to end; return those that run a callback past `deadline`.

        Args:
            deadline: as of time.monotonic(), s. A thread outside callbacks is on its way out, and
                is waited for in any case: one that is still inside rclpy when the interpreter ends
                would abort the process.
            running: the callbacks that are waited for.
            given_up: those that are not.
        """
        hopeless = {job.thread_id for job in given_up.copy()}
        me = threading.current_thread()
        others = [thread for thread in self._all if thread is not me]
        for thread in others:
            if thread.ident not in hopeless:
                thread.join(max(0.0, deadline - time.monotonic()))
        busy = hopeless | {job.thread_id for job in running.copy()}
        for thread in others:
            if thread.ident not in busy:
                thread.join(_JOIN_TIMEOUT_S)
        return [thread for thread in others if thread.is_alive()]

    def _new_spinner(self) -> threading.Thread:
        return threading.Thread(target=self._spin, name=self._name, daemon=True)
