"""The gate of an executor: others hold it to change the executor's nodes in safety."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterator

from rclpy.executors import ShutdownException

_TIMEOUT = 5.0  # s; waking an executor takes microseconds, so this bounds what cannot happen


class Gate:
    """Keeps track of whether the spinning thread looks at, or waits on, its nodes' entities.

    `enter` and `leave` are on the path of every callback: they take no lock unless somebody holds
    the gate. That is safe because each side writes its own flag before it reads the other's.

    Attributes:
        stale: True if nodes may have changed under a wait that rclpy has suspended.
        stopping: True once the executor is to end.
    """

    def __init__(self, wake: Callable[[], None]) -> None:
        """Guard an executor whose wait is ended by `wake`."""
        self.stale = False
        self.stopping = False
        self._wake = wake
        self._holds = 0
        self._waiting = False
        self._watchers = 0
        self._condition = threading.Condition()

    @contextlib.contextmanager
    def held(self) -> Iterator[None]:
        """Keep the spinning thread out for the length of the block."""
        with self._condition:
            self._holds += 1
            self.stale = True
        self._wake()
        try:
            with self._condition:
                self._condition.wait_for(lambda: not self._waiting, _TIMEOUT)
            yield
        finally:
            with self._condition:
                self._holds -= 1
                self._condition.notify_all()

    def new_interrupt(self) -> Callable[[], bool]:
        """Return a condition, equal to no other, that is true while a wait should end."""
        return lambda: bool(self._holds or self.stopping)

    def enter(self) -> bool:
        """Begin to wait on the nodes; first let those finish who hold the gate.

        Returns:
            True if the nodes may have changed since the last time.

        Raises:
            ShutdownException: the executor is to end.
        """
        self._waiting = True
        if not (self._holds or self.stale or self.stopping):
            return False
        with self._condition:
            self._waiting = False
            self._condition.notify_all()
            self._condition.wait_for(lambda: not self._holds or self.stopping)
            if self.stopping:
                raise ShutdownException
            self.stale = False
            self._waiting = True
        return True

    def leave(self) -> None:
        """End waiting on the nodes."""
        self._waiting = False
        if self._holds:
            self.notify()

    def stop(self) -> None:
        """Let nobody wait on the nodes any more."""
        self.stopping = True
        self.notify()
        self._wake()

    def notify(self) -> None:
        """Wake those who wait here for a callback to begin or to end."""
        with self._condition:
            self._condition.notify_all()

    def notify_watchers(self) -> None:
        """Do `notify`, if there is anybody to notify."""
        if self._holds or self._watchers:
            self.notify()

    def wait(self, timeout: float) -> None:
        """Return after the next `notify`, or after `timeout` s."""
        with self._condition:
            self._condition.wait(timeout)

    def watch(self, condition: Callable[[], object]) -> None:
        """Return when `condition` holds, somebody holds the gate, or the executor is to end."""
        with self._condition:
            self._watchers += 1
            self._condition.wait_for(
                lambda: condition() or self._holds or self.stopping, timeout=_TIMEOUT
            )
            self._watchers -= 1
