"""Tell a callback that is blocked from one that works, or would if it were given the chance.

A thread that the kernel shows as asleep may wait for what only the next moment of simulated time
brings. Or it waits for the interpreter's lock, or has been kept from running by other processes:
then it is about to go on, and time must not move on without it. One look cannot tell these apart;
a row of looks can, with the lock let go in between.
"""

from __future__ import annotations

import platform
import threading
import time

from course.util.operating_system import ThreadSample, look_at, system_call_of

PATIENCE_S = 0.2  # s that a callback must have slept
LOOKS = 40  # that must have found it asleep: on a busy machine PATIENCE_S passes in a few
WORK_S = (
    0.5e-3  # s of processor time a look: a loop that spins uses ten times as much, a nap a tenth
)
_FUTEX = {"x86_64": 202, "aarch64": 98}.get(platform.machine())
"""The number of that system call; None where it is not known."""
RESTLESS_LOOKS = 8  # looks in a row at which a blocked thread may have stirred: it looks at a clock


def _waits_without_end(native_id: int) -> bool:
    """Return whether a thread waits for a lock, and with no time-out (futex(2))."""
    call = system_call_of(native_id)
    try:
        return int(call[0]) == _FUTEX and int(call[4], 16) == 0
    except (ValueError, IndexError):  # it runs, or the system does not say
        return False


class Idleness:
    """What a row of looks has shown of the thread that runs one callback."""

    def __init__(self, thread_id: int) -> None:
        """Watch the thread with this identifier of Python's."""
        threads = (t for t in threading.enumerate() if t.ident == thread_id)
        self._native_id = next((t.native_id or 0 for t in threads), 0)
        self._first = self._last = look_at(self._native_id)
        self._start_over(self._first)

    def _start_over(self, look: ThreadSample) -> None:
        self._found = False
        self._first, self._since = look, time.monotonic()
        self._asleep = self._awake = self._stirs = 0

    def is_blocked(self) -> bool:
        """Look once more, and return whether the thread is blocked.

        Between two calls the caller lets go of the interpreter's lock for a moment.
        """
        before = self._last
        look = look_at(self._native_id, before)
        self._last = look
        return self._still_blocked(look, before) if self._found else self._by_now_blocked(look)

    def until_woken(self) -> bool:
        """Return whether it has been found blocked, and waits until another thread wakes it."""
        return self._found and _waits_without_end(self._native_id)

    def _by_now_blocked(self, look: ThreadSample) -> bool:
        """Return whether it has been asleep, but for naps' ends, in enough looks by now."""
        self._asleep += look.asleep
        self._awake += not look.asleep
        looks = self._asleep + self._awake
        works = look.worked - self._first.worked > WORK_S * max(looks, LOOKS)
        if works or self._awake > LOOKS + looks / 4:
            self._start_over(look)
        elif self._asleep >= LOOKS and time.monotonic() - self._since >= PATIENCE_S:
            self._found = look.asleep
        return self._found

    def _still_blocked(self, look: ThreadSample, before: ThreadSample) -> bool:
        """Return whether it has not run since the last look, or does no more than take naps."""
        if look.asleep and look.switches == before.switches:
            self._stirs = 0
            return True
        if not self._stirs:
            self._first = before
        self._stirs += 1
        if look.worked - self._first.worked > WORK_S * RESTLESS_LOOKS:
            self._start_over(look)  # it has gone on
            return False
        return look.asleep and self._stirs > RESTLESS_LOOKS
