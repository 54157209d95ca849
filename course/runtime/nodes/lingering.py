"""Callbacks that go on though their node has been stopped."""

from __future__ import annotations

from collections.abc import Iterable

from course.runtime.callbacks.callback_runs import CallbackRun
from course.runtime.executor.background import BackgroundExecutor
from course.runtime.executor.blocked import describe_job
from course.runtime.waiting import Pulse, poll_condition


class LingeringCallbacks:
    """Callbacks of a stopped node without which its executor goes on.

    They may end all the same: when the node is destroyed, and tells them to.
    """

    def __init__(self, executor: BackgroundExecutor, jobs: Iterable[CallbackRun]) -> None:
        """Give up the threads of ``executor`` that run ``jobs``."""
        self._executor = executor
        seen = [(job, describe_job(job)) for job in jobs]  # before a thread is another's business
        self._seen = {job: blocked for job, blocked in seen if executor.give_up(job)}

    def describe_after(self, grace_s: float, name: str, pulse: Pulse) -> list[str]:
        """Return a sentence on each that has not ended after ``grace_s`` seconds.

        ``name`` is that of the node; ``pulse`` beats when a callback ends.
        """
        given_up = self._executor.given_up
        poll_condition(lambda: given_up.isdisjoint(self._seen), grace_s, pulse)
        return [
            f"{name} was stopped, but its callback {blocked.what} goes on: it has been running "
            f"for {blocked.seconds:.0f} s. {blocked.reason} The session goes on without it; only "
            "a restart of the kernel or program ends it for good."
            for job, blocked in self._seen.items()
            if job in given_up
        ]
