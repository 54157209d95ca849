"""The gate of an executor: others hold it to change the executor's nodes in safety."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator

from rclpy.executors import ShutdownException

from course.runtime.waiting import Pulse, poll_condition

_TIMEOUT_S = 5.0  # s; waking an executor takes microseconds, so this bounds what cannot happen


class Gate:
    """Keeps track of whether the spinning thread looks at, or waits on, its nodes' entities.

    `enter` and `leave` are on the path of every callback: they do next to nothing unless somebody
    holds the gate. That is safe because each side writes its own flag before it reads the other's.
    There is no lock: Ctrl-C may interrupt the thread that holds the gate at any step.

    Attributes:
        stale: True if nodes may have changed under a wait that rclpy has suspended.
        stopping: True once the executor is to end.
    """

    def __init__(self, wake: Callable[[], None]) -> None:
        """Guard an executor whose wait is ended by `wake`."""
        self.stale = False
        self.stopping = False
        self._wake = wake
        self._holders: list[object] = []
        self._waiting = False
        self._changes = Pulse()

    @contextlib.contextmanager
    def hold_closed(self) -> Iterator[None]:
        """Keep the spinning thread out for the length of the block."""
        holder = object()
        try:
            self._holders.append(holder)
            self.stale = True
            self._wake()
            poll_condition(lambda: not self._waiting, _TIMEOUT_S, self._changes)
            yield
        finally:
            if holder in self._holders:  # else an interrupt came before that
                self._holders.remove(holder)
            self.notify()

    def new_interrupt(self) -> Callable[[], bool]:
        """Return a condition, equal to no other, that is true while a wait should end."""
        return lambda: bool(self._holders or self.stopping)

    def enter(self) -> bool:
        """Begin to wait on the nodes; first let those finish who hold the gate.

        Returns:
            True if the nodes may have changed since the last time.

        Raises:
            ShutdownException: the executor is to end.
        """
        self._waiting = True
        changed = False
        while self._holders or self.stale or self.stopping:
            self._waiting = False
            self.notify()
            poll_condition(lambda: not self._holders or self.stopping, float("inf"), self._changes)
            if self.stopping:
                raise ShutdownException
            self.stale = False
            self._waiting = changed = True
        return changed

    def leave(self) -> None:
        """End waiting on the nodes."""
        self._waiting = False
        if self._holders:
            self.notify()

    def stop(self) -> None:
        """Let nobody wait on the nodes any more."""
        self.stopping = True
        self.notify()
        self._wake()

    def notify(self) -> None:
        """Wake those who wait here for a callback to begin or to end."""
        self._changes.beat()

    def wait(self, timeout: float) -> None:
        """Return after the next `notify`, or after `timeout` s."""
        self._changes.wait(self._changes.count, timeout)

    def wait_until(self, condition: Callable[[], object]) -> None:
        """Return when `condition` holds, somebody holds the gate, or the executor is to end."""
        poll_condition(
            lambda: condition() or self._holders or self.stopping, _TIMEOUT_S, self._changes
        )
