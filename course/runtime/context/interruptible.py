"""Let Ctrl-C end the spinning of rclpy's own executors on a session's context.

Python runs a signal handler only between two steps of the main thread, and `rclpy.spin(node)` waits
in C until something wakes it: without a timer, perhaps for ever. `rclpy.init()` installs handlers
in C for this, which end every context of the process. A session must outlive an interrupt, so it
wakes those executors every now and then instead, as long as there are any. The thread that does so
lives as long as the context: a program that counts threads must always find the same number.
"""

from __future__ import annotations

import contextlib
import threading
import time
import weakref
from collections.abc import Callable, Iterator
from typing import Any

from rclpy.context import Context
from rclpy.exceptions import InvalidHandle
from rclpy.executors import Executor

from course.runtime.executor.background import BackgroundExecutor
from course.runtime.output import rcutils_tap

_PATIENCE_S = 0.5  # s for callbacks that run while the context is shut down
_NAP_S = 0.01  # s between looks at them
_PERIOD_S = 0.1  # s; soon enough for a hand on the keyboard


class SessionContext(Context):
    """The rclpy context of a session: it keeps other people's executors interruptible, and quiet.

    It overrides public methods only. Every executor registers with its context's `on_shutdown`:
    that is how this one hears of those that are not ours.
    """

    def __init__(self) -> None:
        """Make a context; `init` starts it."""
        super().__init__()
        self._ours: weakref.WeakSet[BackgroundExecutor] = weakref.WeakSet()
        self._guests: weakref.WeakSet[Executor] = weakref.WeakSet()
        self._guests_lock = threading.Lock()
        self._waker = threading.Thread(target=self._wake_guests, name="ROS interrupts", daemon=True)
        self._wanted = threading.Event()
        self._over = threading.Event()

    def init(self, *arguments: Any, **options: Any) -> None:
        """Initialize the context."""
        super().init(*arguments, **options)
        self._waker.start()

    def on_shutdown(self, callback: Callable[[], None]) -> None:
        """Call `callback` when the context is shut down."""
        super().on_shutdown(callback)
        owner = getattr(callback, "__self__", None)
        if isinstance(owner, BackgroundExecutor):
            self._ours.add(owner)
        elif isinstance(owner, Executor):
            with self._guests_lock:
                self._guests.add(owner)
                self._wanted.set()

    def shutdown(self) -> None:
        """Shut the context down."""
        self._end_waking()
        with self._at_rest(), rcutils_tap.stay_installed():
            super().shutdown()

    def try_shutdown(self) -> None:
        """Shut the context down, if that has not been done."""
        self._end_waking()
        with self._at_rest(), rcutils_tap.stay_installed():
            super().try_shutdown()

    def join(self, timeout: float) -> None:
        """Wait until no thread of this context is left, after it has been shut down."""
        if self._waker.is_alive():
            self._waker.join(timeout)

    @contextlib.contextmanager
    def _at_rest(self) -> Iterator[None]:
        """Let no callback of ours begin, and those that run end, if they are quick about it.

        rclpy.shutdown() may come at any moment: a callback that publishes just then would raise, as
        its context has ended under it.
        """
        with contextlib.ExitStack() as stack:
            ours = [executor for executor in self._ours if not executor.has_ended]
            for executor in ours:
                stack.enter_context(executor.hold_still())
            deadline = time.monotonic() + _PATIENCE_S
            for executor in ours:
                while executor.runs_elsewhere() and time.monotonic() < deadline:
                    executor.wait_for_a_job(_NAP_S)
            yield

    def _end_waking(self) -> None:
        self._over.set()
        self._wanted.set()

    def _wake_guests(self) -> None:
        # `_end_waking` sets `_over` first and `_wanted` second. So if `_wanted` is cleared here, it
        # is either set again afterwards, or `_over` was set before this looks at it.
        while not self._over.is_set():
            self._wanted.wait()
            if self._over.wait(_PERIOD_S):
                return
            with self._guests_lock:
                if not self._guests:
                    self._wanted.clear()
            self._wake_each()

    def _wake_each(self) -> None:
        with self._guests_lock:
            guests = list(self._guests)
        for guest in guests:
            # One without nodes waits for nobody; one that is shutting down has lost its guard.
            with contextlib.suppress(InvalidHandle, AttributeError, RuntimeError):
                if guest.get_nodes():
                    guest.wake()
