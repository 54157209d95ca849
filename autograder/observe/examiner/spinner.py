"""Spins an examiner's nodes: less than a session does for a learner's, for a third of the work.

An examiner hears a thousand messages a submission. Its callbacks are its own: they are functions,
print nothing, end at once and are asked by nobody where they are. So there are no tasks, and no
account is kept of each.
"""

from __future__ import annotations

import threading
import traceback
from collections.abc import Callable
from functools import partial
from typing import Any

from rclpy.context import Context
from rclpy.exceptions import InvalidHandle
from rclpy.executors import Executor, ExternalShutdownException, ShutdownException
from rclpy.subscription import Subscription

from course.errors import WaitTimeout
from course.runtime.executor.wait_list import WaitList
from course.runtime.waiting import Pulse, poll_condition

MOST_AT_ONCE = 16
"""Messages that are taken from one subscription before others have their turn: to wait for the next
takes longer than to take it."""


_PLAIN = ("timer", "subscription")
"""Kinds of which most callbacks are, called without rclpy's coroutine around each."""


def _wake_nobody() -> None:
    """Wake nobody: there is one thread."""


def _take_turn(timer: Any) -> Callable[[], Any]:
    with timer.handle:
        timer.handle.call_timer()
    callback: Callable[[], Any] = timer.callback
    return callback


def _take_message(subscription: Any) -> Callable[[], Any] | None:
    with subscription.handle:
        taken = subscription.handle.take_message(subscription.msg_type, subscription.raw)
    if taken is None:
        return None
    if subscription._callback_type is Subscription.CallbackType.MessageOnly:
        return partial(subscription.callback, taken[0])
    return partial(subscription.callback, *taken)


class Spinner(Executor):
    """Runs the callbacks of an examiner's nodes, which are no coroutines, in its own thread."""

    def __init__(self, context: Context) -> None:
        """Begin to spin, as yet without nodes."""
        super().__init__(context=context)
        self._waits = WaitList(self, _wake_nobody, keeps=True)
        self._pulse = Pulse()
        self._take: dict[str, Callable[[Any], Any]] = {
            "waitable": self._take_waitable, "timer": _take_turn,
            "subscription": _take_message, "client": self._take_client,
            "guard_condition": self._take_guard_condition, "service": self._take_service,
        }  # fmt: skip
        self._thread = threading.Thread(target=self._spin, name="examiner's nodes", daemon=True)
        self._thread.start()

    def until(
        self, condition: Callable[[], Any], timeout: float, what: str, *, often: bool = True
    ) -> Any:
        """Return the first true value of ``condition``, as `course.Session.until` does.

        With ``often`` it is looked at after each callback, else every 20 ms. While many callbacks
        run, to look takes as long as they do.

        Raises:
            WaitTimeout: it was not true in time.
        """
        value = poll_condition(condition, timeout, self._pulse if often else Pulse())
        if value is None:
            raise WaitTimeout(f"Waited {timeout:g} s in vain for {what}.")
        return value

    def wake(self) -> None:
        """Gather what to wait on again: something was created or destroyed."""
        self._waits.changed = True
        super().wake()

    def close(self) -> None:
        """Spin no more, and destroy the nodes."""
        self._is_shutdown = True
        self.wake()
        self._thread.join()
        self._waits.clear()
        for node in self.get_nodes():
            self.remove_node(node)
            node.destroy_node()
        self.shutdown()

    def _spin(self) -> None:
        while True:
            try:
                for owned in self._waits.wait(self.get_nodes(), -1.0):
                    if owned.kind == "subscription":
                        for _ in range(MOST_AT_ONCE):
                            if not self._run_callback(owned.entity, owned.kind):
                                break
                    elif owned.may_begin():
                        self._run_callback(owned.entity, owned.kind)
            except InvalidHandle:
                continue  # destroyed just now
            except (ShutdownException, ExternalShutdownException):
                return

    def _run_callback(self, entity: Any, kind: str) -> bool:
        """Take what is ready, and run the callback; return whether there was anything."""
        try:
            if (call := self._take[kind](entity)) is None:
                return False
            if kind in _PLAIN:
                call()
            else:
                call().send(None)
        except StopIteration:
            pass
        except InvalidHandle:  # destroyed just now
            return False
        except Exception:  # noqa: BLE001 - of a message that is none, say: the next may be one
            traceback.print_exc()
        self._pulse.beat()
        return True
